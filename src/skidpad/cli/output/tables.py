"""Tables in the terminal: folded into its width; in a pipe each row is one line, however long."""

from __future__ import annotations

import sys

from rich.console import Console

PIPE_WIDTH = 1000  # columns; wider than any row


def table_console() -> Console:
    """Returns a console that fits a terminal and wraps nothing in a pipe or file."""
    return Console() if sys.stdout.isatty() else Console(width=PIPE_WIDTH)
