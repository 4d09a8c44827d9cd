"""Words around numbers."""

from __future__ import annotations

from collections.abc import Sequence


def count_text(n: int, noun: str, plural: str = "") -> str:
    """Returns `1 run`, `3 runs`, `1,200 runs`; plural: where it is not noun + s."""
    return f"{n:,} {noun if n == 1 else plural or noun + 's'}"


def list_text(words: Sequence[str], last: str = "and") -> str:
    """Returns `a`, `a and b`, `a, b and c`."""
    return f" {last} ".join(filter(None, [", ".join(words[:-1]), *words[-1:]]))


def capitalize_first(text: str) -> str:
    """Returns the text with a large first letter, the others as they are."""
    return text[:1].upper() + text[1:]
