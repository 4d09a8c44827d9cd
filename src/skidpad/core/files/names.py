"""Names that become parts of paths: the one place where a user's word turns into a file's name."""

from __future__ import annotations

from hashlib import sha256
from pathlib import Path

from skidpad.core.errors import ConfigError

MARKS = "-_.+,=()[]~"  # besides letters and digits
LONGEST = 180  # bytes; file systems take 255
ENDING = 40  # bytes that may follow: a number, a suffix


def path_part(text: str, marks: str = MARKS, longest: int = LONGEST) -> str:
    """Returns `text` as one part of a path: never empty, hidden, "..", too long, or more than one part.

    What is neither letter, digit nor one of `marks` becomes a hyphen; a plain name stays as it is. A
    text of more than `longest` bytes ends in a hash of it.
    """
    plain = "".join(c if c.isalnum() or c in marks else "-" for c in text)
    plain = "-" * (len(plain) - len(plain.lstrip("."))) + plain.lstrip(".")
    encoded = plain.encode()
    if len(encoded) > longest:
        digest = sha256(text.encode(errors="surrogatepass")).hexdigest()[:12]
        plain = encoded[: longest - 13].decode(errors="ignore") + "~" + digest
    return plain or "-"


def slug(label: str) -> str:
    """Returns a label as a part of a file's name: letters, digits and hyphens."""
    return path_part(label, marks="")


def inside(folder: Path, name: str) -> Path:
    """Returns the file or folder of this name in `folder`; ConfigError for a name that leads elsewhere."""
    if name != path_part(name, longest=LONGEST + ENDING):
        raise ConfigError(f"{name!r:.200} is no name of a file or folder in {folder}")
    return folder / name
