"""Tables and prose in the terminal: folded into its width; in a pipe a line stays a line, however long."""

from __future__ import annotations

import sys
import textwrap
from shutil import get_terminal_size

from rich.console import Console

PIPE_WIDTH = 1000  # columns; wider than any row


def table_console() -> Console:
    """Returns a console that fits a terminal and wraps nothing in a pipe or file."""
    return Console() if sys.stdout.isatty() else Console(width=PIPE_WIDTH)


def fit_terminal(text: str) -> str:
    """Returns a text whose sentences are filled to the width of a terminal; in a pipe as it is.

    The line of the next command stays whole, so that it can be copied.
    """
    if not sys.stdout.isatty():
        return text
    width = get_terminal_size().columns
    return "\n".join(
        line
        if line.startswith("Next: ")
        else textwrap.fill(line, width, break_long_words=False, break_on_hyphens=False)
        for line in text.split("\n")
    )
