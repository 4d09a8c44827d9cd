"""Pictures that commands write: whole or not at all, in a format that their ending names."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from skidpad.core.errors import OutputError, require_choice
from skidpad.recording.files import write_atomically

FORMATS = ("png", "svg", "pdf", "jpg", "webp")


def format_of(path: Path) -> str:
    """Returns the format that the ending of a picture's name asks for; ConfigError for an unknown one."""
    return require_choice("ending of a picture", path.suffix.removeprefix(".").lower(), FORMATS)


def write_picture(path: Path, draw: Callable[[Path, str], None]) -> None:
    """Calls `draw` with a file and a format and puts the file in place at `path`.

    OutputError where the folder is missing: a picture is no reason to make one.
    """
    kind = format_of(path)
    if not path.parent.is_dir():
        raise OutputError(f"cannot write {path}: there is no folder {path.parent}")
    write_atomically(path, lambda part: draw(part, kind))


def write_figure(
    path: Path, draw: Callable[[Any], None], size: tuple[float, float], dpi: int
) -> None:
    """Writes a figure of `size` in inches, on which `draw` draws, as a picture at `path`."""
    format_of(path)
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot as plt

    figure = plt.figure(figsize=size, layout="constrained")
    try:
        draw(figure)
        write_picture(path, lambda part, kind: figure.savefig(part, dpi=dpi, format=kind))
    finally:
        plt.close(figure)
