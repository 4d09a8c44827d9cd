"""From the options of `skidpad grip` to batches of cells, and driving them."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TypeVar

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from skidpad.campaign.cells import BackendKind
from skidpad.campaign.cluster import runner_of
from skidpad.campaign.grip import (
    GripSummary,
    Runner,
    Task,
    drive_one,
    local,
    run_grip,
    uncertain_cells,
    warm_up,
)
from skidpad.campaign.grip_cells import Friction, GripCell, cross, seeds
from skidpad.campaign.grip_shown import keep_shown, write_stopping
from skidpad.campaign.play import check_controller
from skidpad.cli.carla_backend import backend_choice
from skidpad.cli.server_options import ServerWish
from skidpad.core.errors import ConfigError, require_choice, require_range
from skidpad.core.vocabulary import GripModel, SensorLevel
from skidpad.core.weather import Weather
from skidpad.physics.grip import friction_ratio
from skidpad.physics.presets import GRIP, SNOW, find_weather, preset_groups
from skidpad.recording.grip import GripEntry
from skidpad.scenarios.scene import Mode
from skidpad.scenarios.variation import CutIn, names
from skidpad.stack.settings import load_profile, parse_assignments

Choice = TypeVar("Choice", Friction, CutIn)
BATCH = 20  # repeats after which --until-halfwidth looks again (decision G-8)
KEEP = ("shown", "all")
console = Console(stderr=True)


@dataclass(frozen=True, slots=True, kw_only=True)
class GripWish:
    """What the user asked for, as text and numbers from the command line."""

    scenarios: str = "all"
    weather: str = "all"
    friction: str = "original,reduced"
    model: str = "statistical"
    cutin: str = "fixed"
    repeats: int = 100
    config: int = 2
    assignments: Sequence[str] = ()
    profile: str = "recommended"
    controller: str = "stack"
    sensors: str = "objects"
    actors: str = "physical"
    overlay: bool = False
    four_cells: bool = False  # drops x friction (B-161)
    until_halfwidth: float | None = None
    keep: str = "shown"
    server: ServerWish = ServerWish()


@dataclass(frozen=True, slots=True)
class GripPlan:
    """Batches of cells, and when to stop."""

    batches: Sequence[Sequence[GripCell]]
    until_halfwidth: float | None
    keep_all: bool

    @property
    def cells(self) -> list[GripCell]:
        """All of them, in the order in which they are driven."""
        return [c for batch in self.batches for c in batch]


def plan_grip(wish: GripWish) -> GripPlan:
    """The cells of a campaign; ConfigError or FileError for what cannot be driven."""
    climate = grip_weathers(wish.weather)
    model = GripModel(require_choice("--model", wish.model, ("statistical", "physical")))
    for weather in climate:
        friction_ratio(weather, model)  # rain with ice, snow: says what is wrong
    check_controller(wish.controller)
    settings = load_profile(wish.profile, parse_assignments(wish.assignments))
    template = GripCell(
        scenario=names()[0],
        weather=climate[0],
        friction=Friction.ORIGINAL,
        seed=0,
        model=model,
        mu_ref=settings.mu_ref,
        controller=wish.controller,
        config=wish.config,
        profile=wish.profile,
        settings=settings,
        level=SensorLevel(require_choice("--sensors", wish.sensors, ("objects", "pixels"))),
        actors=Mode(require_choice("--actors", wish.actors, ("physical", "ideal"))),
        overlay=wish.overlay,
        backend=backend_choice(wish.server),
    )
    if wish.overlay and wish.four_cells:
        raise ConfigError("--four-cells drives with and without drops: leave --overlay away")
    if (wish.overlay or wish.four_cells) and template.level is not SensorLevel.PIXELS:
        raise ConfigError("--overlay and --four-cells draw on images: they need --sensors pixels")
    chosen = list(names()) if wish.scenarios == "all" else _parted(wish.scenarios)
    for name in chosen:
        require_choice("scenario", name, names())
    frictions = _choices("--friction", wish.friction, Friction)
    cutins = _choices("--cutin", wish.cutin, CutIn)
    if wish.until_halfwidth is not None:
        require_range("--until-halfwidth", wish.until_halfwidth, 0.001, 0.5)
    size = wish.repeats if wish.until_halfwidth is None else BATCH
    overlays = (False, True) if wish.four_cells else (wish.overlay,)
    if wish.four_cells and len(frictions) != len(Friction):
        raise ConfigError("--four-cells needs both frictions")
    batches = [
        cross(
            template,
            chosen,
            climate,
            frictions,
            cutins,
            seeds(k, min(size, wish.repeats - k)),
            overlays,
        )
        for k in range(0, wish.repeats, size)
    ]
    require_choice("--keep", wish.keep, KEEP)
    return GripPlan(batches, wish.until_halfwidth, wish.keep == "all")


def _parted(text: str) -> list[str]:
    parts = [part.strip() for part in text.split(",") if part.strip()]
    if len(set(parts)) != len(parts) or not parts:
        raise ConfigError(f"need different names parted by commas, got {text!r}")
    return parts


def _choices(option: str, text: str, kind: type[Choice]) -> list[Choice]:
    allowed = [member.value for member in kind]
    return [kind(require_choice(option, part, allowed)) for part in _parted(text)]


def grip_weathers(text: str) -> list[Weather]:
    """`all` is the eleven published presets; else names or YAML files, parted by commas."""
    if text == "all":
        return [w for w in preset_groups()[GRIP].values() if w.name != SNOW]
    return [find_weather(part) for part in _parted(text)]


def drive_grip(
    plan: GripPlan, out: Path, *, workers: int, cluster: str | None, resume: bool, csv: bool
) -> Path:
    """Run the campaign under a progress bar, keep the runs that the report shows, write it."""
    from skidpad.report.grip import write_grip_report

    if any(c.backend.kind is BackendKind.CARLA for c in plan.cells):
        workers = 1  # a CARLA server drives one run at a time
        if cluster:
            raise ConfigError("--cluster needs --backend embedded: a CARLA server drives one run")
    with runner_of(cluster) if cluster else _as_is(local(workers)) as runner:
        summary = _progress(plan, out, runner, resume=resume, csv=csv)
        keep_shown(out, plan.cells, runner)
    weathers = list({c.weather.name: c.weather for c in plan.cells}.values())
    write_stopping(out, weathers, plan.cells[0].mu_ref)
    if summary.mixed_machines:
        console.print("[yellow]runs of different machines or versions: bytes may differ[/]")
    if summary.failed:
        console.print(f"[yellow]{summary.failed} runs crashed or timed out; see the report[/]")
    return write_grip_report(out)


class _as_is:  # noqa: N801  used like a function
    """A runner that needs no closing."""

    def __init__(self, runner: Runner) -> None:
        self.runner = runner

    def __enter__(self) -> Runner:
        return self.runner

    def __exit__(self, *_: object) -> None:
        return None


def _progress(plan: GripPlan, out: Path, runner: Runner, *, resume: bool, csv: bool) -> GripSummary:
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
    )
    half = plan.until_halfwidth
    with Progress(*columns, console=console) as progress:
        task = progress.add_task("driving", total=len(plan.cells))

        def on_run(entry: GripEntry) -> None:
            told = f"{entry.run}: {entry.key.outcome}"
            progress.update(task, advance=1, description=told)

        try:
            return run_grip(
                plan.batches,
                out,
                runner,
                resume=resume,
                csv=csv,
                keep_all=plan.keep_all,
                wanted=None if half is None else lambda e: uncertain_cells(e, half),
                on_run=on_run,
            )
        except KeyboardInterrupt:
            console.print(f"interrupted; what is done is kept: --out {out} --resume finishes it")
            raise SystemExit(130) from None


PROBES = 12  # runs that an estimate drives, spread over the cells


def time_needed(plan: GripPlan, workers: int) -> str:
    """One sentence, from a sample of the plan's own runs driven here; compilation apart."""
    cells = plan.cells
    sample = cells[:: max(len(cells) // PROBES, 1)][:PROBES]
    warm_up()
    with TemporaryDirectory() as folder:
        began = time.process_time()
        for cell in sample:
            drive_one(Task(cell, Path(folder)))
        each = (time.process_time() - began) / len(sample)
    minutes = each * len(cells) / workers / 60.0
    return (
        f"{len(cells)} runs at {each:.2f} s each ({len(sample)} were driven) on {workers} workers: "
        f"about {minutes:.1f} min, without compilation on first use"
    )
