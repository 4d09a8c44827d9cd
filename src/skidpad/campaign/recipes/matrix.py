"""The recipe of the matrix: drivers in weathers with seeds, every run with its whole log."""

from __future__ import annotations

from math import inf
from pathlib import Path

from skidpad import __version__
from skidpad.campaign.cells.matrix import join_functions
from skidpad.campaign.driving.pace import Pace
from skidpad.campaign.recipes.recipe import Driven, Recipe, find_reason
from skidpad.campaign.runs.folder import Stopwatch, fresh_folder, last_line, write_config, write_run
from skidpad.campaign.user_files import road_file, with_kept_map
from skidpad.core.courses import Roads
from skidpad.core.errors import ConfigError
from skidpad.core.run import AdasDriver, Function, RunSpec
from skidpad.core.settings.parts import LaneTruth
from skidpad.core.setup import DT
from skidpad.core.vocabulary import Outcome, SensorLevel
from skidpad.core.weather import Weather
from skidpad.evidence.drive.prepared import LeadDefinition, MetricSettings
from skidpad.recording.campaign.added_metrics import AddedMetric
from skidpad.recording.campaign.matrix import MATRIX, MatrixEntry, Metrics, RunKey
from skidpad.roads.bundled import map_name
from skidpad.stack.configurations import V_CRUISE_KMH, V_LIMITER_KMH

TIMES_OF_DAY = ("sunrise", "noon", "night")


def warm_up() -> None:
    """Compiles every kernel that a run may need, by driving a moment of each kind."""
    from skidpad.campaign.runs.drive import drive
    from skidpad.evidence.drive.metrics import run_metrics
    from skidpad.roads.bundled import load_map

    for level in SensorLevel:
        run = drive(4, weather="rain-night", duration=1.0, sensors=level.value)
        run_metrics(run.log, load_map("figure8"))
    see_all()


def see_all() -> None:
    """Draws every image once and looks for lamps, to compile: a moment's drive meets no light."""
    from skidpad.physics.presets import preset
    from skidpad.roads.bundled import load_map
    from skidpad.sensors.bench import convoy
    from skidpad.sensors.published_sensors import twelve_sensors
    from skidpad.sensors.suite import PixelSettings, PixelSuite
    from skidpad.stack.perception.hsv import LampCamera

    road_map, specs = load_map("figure8"), twelve_sensors()
    table, states = convoy(road_map)
    suite = PixelSuite(road_map, table, specs, preset("rain-night"), PixelSettings(render_all=True))
    LampCamera(specs).look(suite.observe(0, states, {}).images)


def drive_one(
    out: Path, cell: RunSpec, checkpoints_s: float | None = None
) -> Driven[RunKey, Metrics]:
    """Drives a run, writes its folder (one that is there is replaced) and returns its row.

    checkpoints_s: s between checkpoints in the folder; None: none.
    """
    # numba and friends are imported only where they are needed, not in the parent.
    from skidpad.campaign.driving.backends import WATCHDOG, keep_server, make_backend
    from skidpad.campaign.driving.run_setup import journey_of
    from skidpad.campaign.runs.run import run
    from skidpad.evidence.drive.added import measure_added
    from skidpad.evidence.drive.metrics import run_metrics
    from skidpad.evidence.drive.route import measure_route
    from skidpad.recording.campaign.added_metrics import write_added_metrics
    from skidpad.recording.run.motion import motion_hash
    from skidpad.roads.bundled import load_map

    folder = fresh_folder(out, cell.name)
    write_config(folder, cell.to_plain())
    watch, pace = Stopwatch(), Pace(DT)
    keep_server(cell.backend)
    backend = make_backend(cell.backend, WATCHDOG)
    here = with_kept_map(cell, out)
    driven = run(here, backend=backend, folder=folder, sinks=(pace,), checkpoints_s=checkpoints_s)
    timing = watch.timing_of(driven, pace.slow_pct)
    digest = write_run(folder, driven)
    metrics = Metrics()
    added: tuple[AddedMetric, ...] = ()
    if len(driven.log):  # a stack may fail before it has answered once
        road = load_map(road_file(roads_of(here)))
        metrics = run_metrics(driven.log, road, metric_settings(cell))
        added = measure_added(driven.log, road, metric_settings(cell))
        journey = journey_of(roads_of(here), road)
        added += () if journey is None else measure_route(driven.log, journey)
        write_added_metrics(folder, added)
    return Driven(
        key=run_key(
            cell,
            driven.outcome,
            digest,
            motion_hash(driven.log),
            missing_vehicles(roads_of(cell), len(driven.log.table)),
        ),
        metrics=metrics,
        timing=timing,
        error=last_line(driven.error),
        added=added,
    )


def missing_vehicles(course: Roads, actors: int) -> int:
    """Returns how many of the vehicles asked for found no place; actors: of the log, ego included."""
    return max(course.vehicles + course.reserve + 1 - actors, 0)


def metric_settings(cell: RunSpec) -> MetricSettings:
    """Returns the definitions of metrics that the run's profile asks for (D-102, D-103)."""
    same_road = cell.settings.metrics.lane_truth is LaneTruth.SAME_ROAD
    return MetricSettings(
        lead=LeadDefinition.SAME_ROAD_AND_LANE if same_road else LeadDefinition.AHEAD_ON_LANE
    )


def run_key(
    cell: RunSpec,
    outcome: Outcome,
    log_hash: str | None = None,
    motion_hash: str | None = None,
    vehicles_missing: int | None = None,
) -> RunKey:
    """Returns the identifying columns of a run's row; hashes are None where it left no log."""
    settings, driver = cell.settings, cell.driver
    ours = driver if isinstance(driver, AdasDriver) else None
    return RunKey(
        config=cell.driver.label,
        weather=cell.weather.name,
        precipitation_kind=cell.weather.precipitation_kind,
        time_of_day=time_of_day(cell.weather),
        seed=cell.seed,
        profile=settings.profile,
        map=map_name(roads_of(cell).map),
        sensors=cell.sensors.value,
        grip=settings.world.grip.value,
        range=settings.sensors.range.value,
        outcome=outcome.value,
        functions="" if ours is None else join_functions(ours.functions, ours.added),
        cruise_kmh=None if ours is None else cruise_target(ours),
        traffic=roads_of(cell).traffic.value,
        version=__version__,
        log_hash=log_hash,
        motion_hash=motion_hash,
        vehicles_missing=vehicles_missing,
    )


def cruise_target(driver: AdasDriver) -> float:
    """Returns the km/h at which a driver cruises where nothing slows it, its limiter considered."""
    limit = V_LIMITER_KMH if Function.LIMITER in driver.functions else inf
    return min(V_CRUISE_KMH if driver.cruise_kmh is None else driver.cruise_kmh, limit)


def roads_of(cell: RunSpec) -> Roads:
    """Returns the roads that a run of the matrix is driven on; ConfigError for another course."""
    if not isinstance(cell.course, Roads):
        raise ConfigError(f"{cell.name} is no run of the matrix")
    return cell.course


def time_of_day(weather: Weather) -> str:
    """Returns which of TIMES_OF_DAY a preset's name ends in, "" for others."""
    return next((t for t in TIMES_OF_DAY if weather.name.endswith(t)), "")


def is_unharmed(metrics: Metrics) -> bool | None:
    """Returns True when no collision was fatal; None where that was not judged."""
    return None if metrics.fatal_collisions is None else metrics.fatal_collisions == 0


def drive_of(key: RunKey) -> tuple[str, str] | None:
    """Returns what drove and the hash of how it moved (T-3); None for a run that did not end."""
    return None if key.motion_hash is None else (key.config, key.motion_hash)


RECIPE = Recipe(
    command="adas",
    columns=MATRIX,
    entry=MatrixEntry,
    key=run_key,
    drive=drive_one,
    warm_up=warm_up,
    success=is_unharmed,
    drive_of=drive_of,
    why_not_quick=find_reason,
    success_means="without an intervention",
)
