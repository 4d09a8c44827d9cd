"""The recipe of the matrix: drivers in weathers with seeds, every run with its whole log."""

from __future__ import annotations

from pathlib import Path

from skidpad import __version__
from skidpad.campaign.cells import Cell
from skidpad.campaign.pace import Pace
from skidpad.campaign.recipe import Driven, Recipe
from skidpad.campaign.runfolder import Stopwatch, fresh_folder, last_line, write_config, write_run
from skidpad.core.setup import DT
from skidpad.core.vocabulary import Outcome, SensorLevel
from skidpad.core.weather import Weather
from skidpad.evidence.drive.prepared import LeadDefinition, MetricSettings
from skidpad.recording.matrix import MATRIX, MatrixEntry, Metrics, RunKey
from skidpad.stack.settings import LaneTruth

TIMES_OF_DAY = ("sunrise", "noon", "night")


def warm_up() -> None:
    """Compile every kernel that a run may need, by driving a moment of each kind."""
    from skidpad.campaign.drive import drive
    from skidpad.evidence.drive.metrics import run_metrics
    from skidpad.roads.bundled import load_map

    for level in SensorLevel:
        run = drive(4, weather="rain-night", duration=1.0, sensors=level.value)
        run_metrics(run.log, load_map("figure8"))
    see_all()


def see_all() -> None:
    """Draw every image once and look for lamps: a moment's drive meets no light."""
    from skidpad.physics.presets import preset
    from skidpad.roads.bundled import load_map
    from skidpad.sensors.bench import convoy
    from skidpad.sensors.suite import PixelSuite
    from skidpad.sensors.twelve import twelve_sensors
    from skidpad.stack.perception.hsv import LampCamera

    road_map, specs = load_map("figure8"), twelve_sensors()
    table, states = convoy(road_map)
    suite = PixelSuite(road_map, table, specs, preset("rain-night"), render_all=True)
    LampCamera(specs).look(suite.observe(0, states, {}).images)


def drive_one(out: Path, cell: Cell) -> Driven[RunKey, Metrics]:
    """In a worker: drive a cell and write its folder."""
    # numba and friends are imported only where they are needed, not in the parent.
    from skidpad.campaign.backends import WATCHDOG, keep_server, make_backend
    from skidpad.campaign.drive import run_cell
    from skidpad.evidence.drive.metrics import run_metrics
    from skidpad.roads.bundled import load_map

    folder = fresh_folder(out, cell.name)
    write_config(folder, cell.resolved())
    watch, pace = Stopwatch(), Pace(DT)
    keep_server(cell.backend)
    backend = make_backend(cell.backend, WATCHDOG)
    run = run_cell(cell, backend=backend, folder=folder, watchers=(pace,))
    timing = watch.timing(len(run.log) * DT, pace.slow_pct)
    digest = write_run(folder, run.log, run.error)
    metrics = Metrics()
    if len(run.log):  # a stack may fail before it has answered once
        metrics = run_metrics(run.log, load_map(cell.map), metric_settings(cell))
    return Driven(
        key=run_key(cell, run.outcome, digest),
        metrics=metrics,
        timing=timing,
        error=last_line(run.error),
    )


def metric_settings(cell: Cell) -> MetricSettings:
    """The definitions that the cell's profile asks for (D-102, D-103)."""
    same_road = cell.settings.lane_truth is LaneTruth.SAME_ROAD
    return MetricSettings(
        lead=LeadDefinition.SAME_ROAD_AND_LANE if same_road else LeadDefinition.AHEAD_ON_LANE
    )


def run_key(cell: Cell, outcome: Outcome, log_hash: str | None = None) -> RunKey:
    """The identifying columns of a cell's row."""
    return RunKey(
        config=cell.driver.label,
        weather=cell.weather.name,
        precipitation_kind=cell.weather.precipitation_kind,
        time_of_day=time_of_day(cell.weather),
        seed=cell.seed,
        profile=cell.profile,
        map=cell.map,
        sensors=cell.level.value,
        grip=cell.settings.grip.value,
        range=cell.settings.range.value,
        outcome=outcome.value,
        version=__version__,
        log_hash=log_hash,
    )


def time_of_day(weather: Weather) -> str:
    """Which of the published times a preset's name ends in, "" for others."""
    return next((t for t in TIMES_OF_DAY if weather.name.endswith(t)), "")


def unharmed(metrics: Metrics) -> bool | None:
    """No fatal collision."""
    return None if metrics.fatal_collisions is None else metrics.fatal_collisions == 0


RECIPE = Recipe(
    command="adas",
    columns=MATRIX,
    entry=MatrixEntry,
    key=run_key,
    drive=drive_one,
    warm_up=warm_up,
    success=unharmed,
    success_means="without a fatal collision",
)
