"""The options that every campaign takes, and what they do."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated, Any

import typer
from msgspec import Meta, Struct

if TYPE_CHECKING:
    from skidpad.campaign.campaign import Campaign, Summary
    from skidpad.campaign.workers.worker import Runner

Seeds = Annotated[int, typer.Option("--seeds", "--repeats", min=1, help="Runs per cell.")]
FirstSeed = Annotated[int, typer.Option("--first-seed", min=1, help="Seeds count up from it.")]
Checkpoints = Annotated[
    float | None,
    typer.Option(
        min=0.05,
        help="Also write the state to the run's folder each so many s; `rerun --from` begins at the "
        "nearest.",
        show_default=False,
    ),
]
Workers = Annotated[int, Meta(ge=1, description="Processes; default: one per core.")]
CORES = os.cpu_count() or 1


class Driving(Struct, frozen=True, kw_only=True):
    """How a campaign is driven."""

    workers: Workers = CORES
    cluster: Annotated[str | None, Meta(description="Dask scheduler's address, or local:N.")] = None
    until_halfwidth: Annotated[
        float | None,
        Meta(description="Stop a cell once its share of good runs is known to +- this share."),
    ] = None
    resume: Annotated[bool, Meta(description="Finish a campaign.")] = False
    or_next: Annotated[
        bool, Meta(description="If OUT holds another campaign, use OUT-2, OUT-3, ...")
    ] = False
    csv: Annotated[bool, Meta(description="Write CSV beside Parquet.")] = False
    plan: Annotated[
        bool,
        Meta(
            description="Print cells and runs, those that --resume has included, and which go the "
            "quick way; drive and write nothing."
        ),
    ] = False


class CampaignOptions(Driving, frozen=True, kw_only=True):
    """Where and how the runs of a campaign are driven."""

    out: Annotated[Path, Meta(description="Folder for results and report.")]

    @property
    def folder(self) -> Path | None:
        """Returns the folder in which an earlier part of the campaign may lie."""
        return self.out

    def __call__(
        self,
        campaign: Campaign[Any, Any, Any],
        report: Callable[[Path], object],
        parts: Mapping[str, Campaign[Any, Any, Any]] = MappingProxyType({}),
    ) -> Summary:
        """Drives the campaign under a progress bar and prints what `report` says of its folder.

        parts: further campaigns by the folder below its own, driven after it. Returns the summary of the
        campaign itself; ends with exit code 1 when none of its runs has a result, and after a plan with
        0, or 1 where a stack cannot begin.
        """
        from dataclasses import replace

        from skidpad.cli.output.tables import fit_terminal
        from skidpad.core.text.wording import count_text

        campaign = replace(campaign, until_halfwidth=self.until_halfwidth)
        if self.plan:
            planned = {"": campaign, **parts}.items()
            good = [print_plan(part, name and f"{name}: ") for name, part in planned]
            raise typer.Exit(0 if all(good) else 1)
        identities = {".": campaign.identity()} | {n: c.identity() for n, c in parts.items()}
        out = next_folder(self.out, identities) if self.or_next else self.out
        summary = self._run(campaign, out, out)
        if parts:
            report(out)
        for name, part in parts.items():
            self._run(part, out / name, out)
        typer.echo(fit_terminal(str(report(out))))
        if summary.failed == summary.runs > 0:
            typer.echo(f"none of {count_text(summary.runs, 'run')} has a result", err=True)
            raise typer.Exit(1)
        return summary

    def _run(self, campaign: Campaign[Any, Any, Any], folder: Path, out: Path) -> Summary:
        """Drives one campaign into its folder and prints warnings; returns its summary.

        out: the folder that the user asked for, for the sentence after Ctrl-C.
        """
        from skidpad.cli.output.progress import Shown, console, interruptible

        with self._runner(campaign) as runner, Shown(campaign) as shown, interruptible(out):
            summary = campaign.run(
                folder,
                runner,
                resume=self.resume,
                csv=self.csv,
                on_run=shown.note_end,
                on_total=lambda total: shown.update(shown.bar, total=total),
            )
        for warning in summary.warnings():
            console.print(f"[yellow]{warning}[/]")
        return summary

    @contextmanager
    def _runner(self, campaign: Campaign[Any, Any, Any]) -> Iterator[Runner]:
        """Yields the runner of the campaign: on this machine, or on the cluster where one is named.

        Raises ConfigError for a cluster with a CARLA server.
        """
        from skidpad.campaign.workers.cluster import runner_of
        from skidpad.campaign.workers.pool import local
        from skidpad.core.errors import ConfigError

        if self.cluster is None:
            yield local(1 if campaign.alone else self.workers, campaign.recipe.warm_up)
            return
        if campaign.alone:
            raise ConfigError("--cluster needs --backend embedded: a CARLA server drives one run")
        with runner_of(self.cluster, campaign.recipe.warm_up) as runner:
            yield runner


class Estimate(Struct, frozen=True, kw_only=True):
    """How long a campaign would take, instead of driving it."""

    workers: Workers = CORES

    @property
    def folder(self) -> Path | None:
        """Returns None: an estimate writes no folder."""
        return None

    def __call__(
        self,
        campaign: Campaign[Any, Any, Any],
        report: Callable[[Path], object],
        parts: Mapping[str, Campaign[Any, Any, Any]] = MappingProxyType({}),
    ) -> None:
        """Drives a few runs of the campaign and prints one sentence, and one for each part."""
        del report
        self._print(campaign, "")
        for name, part in parts.items():
            self._print(part, f"{name}: ")

    def _print(self, campaign: Campaign[Any, Any, Any], name: str) -> None:
        """Drives a few runs of the campaign and prints how many minutes all of it would take.

        name: text before the sentence, as it stands; "" for none.
        """
        from skidpad.core.text.wording import count_text

        found, workers = campaign.estimate(), 1 if campaign.alone else self.workers
        typer.echo(
            f"{name}{'at most ' * campaign.distinct}{count_text(found.runs, 'run')} at "
            f"{found.cpu_s:.2f} s each (measured on {found.probes}) "
            f"on {count_text(workers, 'worker')}: about {found.minutes(workers):.1f} min, without "
            "compilation on first use"
        )


How = CampaignOptions | Estimate


def print_plan(campaign: Campaign[Any, Any, Any], name: str) -> bool:
    """Prints a line for each cell: its runs, and if they go the quick way, else the first reason.

    name: text before each line, as it stands. Returns False where a stack cannot begin.
    """
    from skidpad.core.errors import StackError
    from skidpad.core.text.wording import count_text

    good = True
    for cell, runs, reason in campaign.plan():
        told = f"quick way: no, {reason}" if reason else "quick way: yes"
        if isinstance(reason, StackError):
            good, told = False, f"cannot be driven: {reason}"
        typer.echo(f"{name}{cell}: {count_text(runs, 'run')}, {told}")
    most = "at most " * (campaign.distinct or campaign.until_halfwidth is not None)
    total = count_text(len(campaign.tasks), "run")
    typer.echo(f"{name}{most}{total} planned, nothing was driven")
    return good


def next_folder(out: Path, identities: Mapping[str, dict[str, Any]]) -> Path:
    """Returns `out`, or the first of out-2, out-3, ... that is empty or holds these campaigns (M-18).

    identities: of each campaign, by its folder below.
    """
    from skidpad.recording.campaign.ledger import FolderState, folder_state

    folder, n = out, 1
    while any(
        folder_state(folder / name, identity) is FolderState.OTHER
        for name, identity in identities.items()
    ):
        n += 1
        folder = out.with_name(f"{out.name}-{n}")
    return folder
