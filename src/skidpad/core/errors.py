"""Every error that Skidpad raises on purpose.

SkidpadError
├── InputError        the user gave something that cannot be used; the command exits with 2
│   ├── ConfigError   a value outside its range, an unknown name or key
│   ├── FileError     a file that is missing, unreadable, or not what it should be
│   │   └── NoLaneError  a map on which nothing can be driven
│   └── OutputError   an output folder that would be overwritten, a full disk
├── BackendError      a simulator that does not answer, or answers nonsense
├── StackError        the stack under test raised, or returned no command
├── CheckpointError   the state of a run cannot be saved, or belongs to another run
└── MissingExtra      an optional dependency that is not installed
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from difflib import get_close_matches
from pathlib import Path

from skidpad.core.text.told import clean
from skidpad.core.text.wording import list_text


class SkidpadError(Exception):
    """Base of all errors raised on purpose; its text is one sentence for a person.

    It may repeat foreign words: they can be printed, and no line of it is longer than `told.LONGEST`.
    """

    def __str__(self) -> str:
        return "\n".join(clean(line) for line in super().__str__().split("\n"))


class InputError(SkidpadError, ValueError):
    """Input that cannot be used: names the file or field, the value and what is allowed."""


class ConfigError(InputError):
    """A value outside its range, an unknown name or an unknown key."""


class FileError(InputError):
    """A file that is missing, unreadable, or not of the expected kind."""


class NoLaneError(FileError):
    """A map on which nothing can be driven."""


class OutputError(InputError):
    """A result that cannot be written without losing an earlier one, or at all."""


class BackendError(SkidpadError):
    """A simulator that cannot be reached or breaks its protocol."""


class StackError(SkidpadError):
    """The stack under test failed; this is the outcome of its run."""


class CheckpointError(SkidpadError):
    """The state of a run that cannot be saved, or that belongs to another run."""


class MissingExtra(SkidpadError, ImportError):
    """An optional dependency is needed: says which, and how to install it."""

    def __init__(self, what: str, extra: str) -> None:
        super().__init__(f"{what} needs an optional part: {install_command(extra)}")
        self.extra = extra


def install_command(extra: str) -> str:
    """Returns the command that installs an extra: of the clone that this is, else by name."""
    clone = Path(__file__).resolve().parents[3]
    if (clone / "pyproject.toml").is_file():
        return f"{sys.executable} -m pip install -e '{clone}[{extra}]'"
    return f"pip install 'skidpad[{extra}]'"


def require_range(field: str, value: float, low: float, high: float) -> float:
    """Returns `value` if low <= value <= high; else raises ConfigError naming field, value and range."""
    if not low <= value <= high:  # also catches NaN
        raise ConfigError(f"{field} must be between {low:g} and {high:g}, got {value!r}")
    return value


def require_choice(
    field: str, value: str, allowed: list[str] | tuple[str, ...], list_command: str = ""
) -> str:
    """Returns `value` if it is one of `allowed`; else raises ConfigError that lists them.

    list_command: the command that lists them where they are too many for a sentence, which then
    names the nearest alone.
    """
    if value not in allowed:
        raise ConfigError(describe_unknown(field, value, allowed, list_command))
    return value


def describe_unknown(field: str, value: str, allowed: Sequence[str], list_command: str = "") -> str:
    """Returns the sentence on a name that is none of `allowed`, as `require_choice` raises it."""
    words = [str.__str__(name) for name in allowed]  # members of enumerations, too
    near = get_close_matches(value, words, n=3)
    hint = f"; did you mean {list_text([repr(name) for name in near], 'or')}?" if near else ""
    if list_command:
        listed = f"{hint} All" if near else "; all"
        return f"unknown {field} {value!r}{listed} {len(allowed)} are listed by: {list_command}"
    return f"unknown {field} {value!r}; choose one of: {', '.join(words)}{hint}"
