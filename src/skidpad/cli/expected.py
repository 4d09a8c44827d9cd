"""`play --expect`: whether runs are as expected, and what to say where they are not."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from msgspec import Meta, Struct

if TYPE_CHECKING:
    from skidpad.evidence.expectations import Expectation


class Expected(Struct, frozen=True):
    """What a user expects of each run."""

    expect: Annotated[
        tuple[str, ...],
        Meta(description="no-collision, or NAME > NUMBER (min_ttc_s, ...); else exit 1."),
    ] = ()
    junit: Annotated[
        Path | None, Meta(description="Write the expectations of all runs as JUnit XML.")
    ] = None

    def rules(self) -> list[Expectation]:
        """Parsed; ConfigError for what cannot be."""
        from skidpad.core.errors import ConfigError
        from skidpad.evidence.expectations import parse_expectation

        if self.junit is not None and not self.expect:
            raise ConfigError("--junit is about the rules of --expect, and none is given")
        return [parse_expectation(text) for text in self.expect]

    def judge(self, runs: Mapping[str, Path], unplayable: Sequence[str] = ()) -> None:
        """Look at the folders of runs by name; exit code 1 where one is not as expected.

        unplayable: files of which there is no run, which no rule can hold for.
        """
        rules = self.rules()
        if not rules:
            return
        failures = {
            f"{name}: {rule.text}": by
            for name, folder in runs.items()
            for rule, by in zip(rules, _wrong(folder, rules), strict=True)
        }
        failures |= {
            f"{f}: {rule.text}": ["cannot be played"] for f in unplayable for rule in rules
        }
        if self.junit is not None:
            from skidpad.cli.junit import write_junit

            write_junit(self.junit, "skidpad play", failures)
        for text, by in failures.items():
            for sentence in by:
                typer.echo(f"not as expected ({text}): {sentence}", err=True)
        if any(failures.values()):
            raise typer.Exit(1)


def _wrong(folder: Path, rules: Sequence[Expectation]) -> list[list[str]]:
    """For each rule what is wrong with the run in `folder`."""
    from skidpad.campaign.runfolder import ERROR
    from skidpad.evidence.expectations import run_values
    from skidpad.recording.logfiles import TICKS, read_log

    if not (folder / TICKS).is_file():
        return [["the run was not driven to its end"] for _ in rules]
    if (folder / ERROR).is_file():
        return [["its stack failed"] for _ in rules]
    values = run_values(read_log(folder))
    return [[said] if (said := rule.disappointed(values)) else [] for rule in rules]
