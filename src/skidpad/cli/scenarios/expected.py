"""How `skidpad play` judges its runs: rules of `--expect`, the page, JUnit and the exit code."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from msgspec import Meta, Struct

if TYPE_CHECKING:
    from skidpad.recording.run.staging import LeftOut
    from skidpad.report.play.runs import Played


class Expected(Struct, frozen=True):
    """What a user expects of each run."""

    expect: Annotated[
        tuple[str, ...],
        Meta(description="no-collision, or NAME > NUMBER (min_ttc_s, ...); else exit 1."),
    ] = ()
    junit: Annotated[Path | None, Meta(description="Write all verdicts as JUnit XML.")] = None

    def check(self) -> None:
        """Raises ConfigError for a rule that cannot be read, before anything is driven."""
        from skidpad.evidence.expectations import parse_expectation

        for text in self.expect:
            parse_expectation(text)

    def conclude(self, out: Path, left_out: Sequence[LeftOut] = ()) -> tuple[Played, str]:
        """Judges the runs of a folder, writes page, results.csv and JUnit; returns runs and text to print.

        left_out: files that could not be played, which count as errors.
        """
        from skidpad.recording.run.staging import Judging, write_judging

        write_judging(out, Judging(expect=self.expect, left_out=tuple(left_out)))
        played, text = write_played_page(out)
        if self.junit is not None:
            from skidpad.cli.output.junit import write_verdicts

            write_verdicts(self.junit, "skidpad play", played.runs, self.expect)
        return played, text


def write_played_page(out: Path) -> tuple[Played, str]:
    """Writes the page of a folder that `play` wrote; returns its runs and the text to print."""
    from skidpad.cli.scenarios.played_table import played_text
    from skidpad.report.play.page import write_play_report

    played, page = write_play_report(out)
    return played, played_text(played, page)


def played_report(out: Path) -> str:
    """Writes the page again, for `skidpad report`; returns the text to print."""
    return write_played_page(out)[1]


def exit_by_verdicts(played: Played) -> None:
    """Ends the command with exit code 1 where a run is failed, void or in error; else nothing."""
    if played.bad:
        raise typer.Exit(1)
