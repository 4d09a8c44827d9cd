"""Foreign words as text that can be printed, encoded and stored, however they are made."""

from __future__ import annotations

LONGEST = 2000  # characters of a sentence about somebody's error
OF_A_LIBRARY = 400  # of what a library says of it
CUT = " [...] "


def clean(text: str, longest: int = LONGEST) -> str:
    """Returns `text` without surrogates, which no encoding takes, its middle cut out beyond `longest`."""
    if len(text) > longest:
        half = (longest - len(CUT)) // 2
        text = text[:half] + CUT + text[-half:]
    return text.encode("utf-8", "backslashreplace").decode("utf-8")


def on_a_line(error: BaseException, longest: int = OF_A_LIBRARY) -> str:
    """Returns what an exception says, cleaned and on one line; the name of its type where it says nothing."""
    return clean(" ".join(str(error).split()) or type(error).__name__, longest)


def describe_value(value: object, longest: int = LONGEST) -> str:
    """Returns `repr(value)`, cleaned; the name of its type where that raises."""
    try:
        return clean(repr(value), longest)
    except Exception:  # foreign code: anything can happen
        return f"<{type(value).__name__}>"
