"""What the terminal shows during a campaign: a bar over all runs, a line for each cell that ended."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from skidpad.campaign.campaign import BATCH, Campaign
from skidpad.campaign.recipes.recipe import cell_of
from skidpad.core.text.wording import count_text
from skidpad.recording.campaign.ledger import Entry

console = Console(stderr=True)


@contextmanager
def interruptible(out: Path) -> Iterator[None]:
    """Lets Ctrl-C end the command with code 130 and a sentence on how to go on.

    out: the folder that the user asked for.
    """
    try:
        yield
    except KeyboardInterrupt:
        console.print(f"interrupted; what is done is kept: --out {out} --resume finishes it")
        raise SystemExit(130) from None


class Shown(Progress):
    """Shows a progress bar of a campaign, and a line when a cell is done or looked at."""

    def __init__(self, campaign: Campaign[Any, Any, Any]) -> None:
        super().__init__(
            TextColumn("{task.description}"),
            BarColumn(),
            MofNCompleteColumn(),
            TimeRemainingColumn(),
            console=console,
            disable=not console.is_terminal,  # a bar in a pipe is torn lines
        )
        self.campaign = campaign
        self.planned = Counter(cell_of(t.name) for t in campaign.tasks)
        self.runs: dict[str, list[Entry[Any, Any]]] = defaultdict(list)
        self.bar = self.add_task("driving", total=len(campaign.tasks))

    def note_end(self, entry: Entry[Any, Any]) -> None:
        """Adds a run that has ended to the bar; prints a line when its cell is done or looked at."""
        cell = cell_of(entry.run)
        runs = self.runs[cell]
        runs.append(entry)
        told = f"{entry.run}: {entry.key.outcome}"
        self.update(self.bar, advance=1, description=told)
        looked_at = self.campaign.until_halfwidth is not None and len(runs) % BATCH == 0
        if looked_at or len(runs) == self.planned[cell]:
            good = sum(self.campaign.success(e) is True for e in runs)
            means = self.campaign.recipe.success_means
            told = f"{cell}: {count_text(len(runs), 'run')}, {good} {means}"
            self.console.print(told, soft_wrap=True)
