"""What each effect of weather does to a stack: alone, and all together, against none."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import polars as pl
from msgspec import structs

from skidpad.campaign.driving.drivers import find_driver
from skidpad.campaign.recipes.matrix import roads_of
from skidpad.campaign.runs.run import run
from skidpad.campaign.studies.study import drive_all
from skidpad.campaign.workers.worker import Job
from skidpad.core.courses import Roads
from skidpad.core.environment.surface import SurfacePatch
from skidpad.core.run import CameraDriver, RunSpec
from skidpad.core.settings.parts import load_profile
from skidpad.core.vocabulary import SensorLevel
from skidpad.evidence.drive.metrics import run_metrics
from skidpad.evidence.statistics import Comparison, compare_pairs
from skidpad.physics.presets import find_weather
from skidpad.recording.run.log_files import log_hash
from skidpad.roads.bundled import load_map

NONE, ALL = "none", "all"
NOT_READ, NO_CHANGE = "not read by this stack", "nothing changed"
# settings under which no weather acts on vehicles and sensors
OFF: dict[str, Any] = {"grip": "none", "range": "none", "camera": False, "drivers": False}


@dataclass(frozen=True, slots=True)
class Effect:
    """One effect: its settings over `OFF`, and the sensor through which alone it acts."""

    title: str
    values: Mapping[str, Any]
    sensor: str = ""
    puddles: bool = False  # deep water under the left wheels, on every road


PUDDLE_MM = 10.0
GRIP, RANGE = {"grip": "physical"}, {"range": "physical"}
EFFECTS: dict[str, Effect] = {
    "grip": Effect("grip of tyres", GRIP),
    "stiffness": Effect("grip and slip stiffness", GRIP | {"tyre_stiffness": True}),
    "water": Effect("grip and drag of water", GRIP | {"water_drag": True}),
    "anti_lock": Effect("grip and anti-lock by wheel speeds", GRIP | {"anti_lock": "wheel_speeds"}),
    "stability": Effect(
        "grip and stability control by wheel speeds", GRIP | {"stability": "wheel_speeds"}
    ),
    "roll_over": Effect("roll-over", {"roll_over": True}),
    "puddles": Effect(
        f"grip, drag and {PUDDLE_MM:g} mm of water under the left wheels",
        GRIP | {"water_drag": True},
        puddles=True,
    ),
    "seen_puddles": Effect(
        "the same puddles, and background drivers that slow for them",
        GRIP | {"water_drag": True, "drivers": True, "drivers_patches": True},
        puddles=True,
    ),
    "sheet_flow": Effect(
        "grip and rain that gathers on low superelevation", GRIP | {"sheet_flow": True}
    ),
    "drivers": Effect("background drivers that mind grip and sight", {"drivers": True}),
    "wakes": Effect("air that lorries push aside", {"wakes": True}),
    "wind": Effect("wind with gusts of 0.2", {"wind": True, "wind_gusts": 0.2}),
    "sight": Effect("sight of depth, labels, radar", RANGE, "depth"),
    "radar": Effect("sight and physical radar", RANGE | {"radar_model": "physical"}, "radar"),
    "ghosts": Effect(
        "sight and physical radar with mirror images",
        RANGE | {"radar_model": "physical", "radar_multipath": True},
        "radar",
    ),
    "rivals": Effect(
        "sight and physical radar, half of the others with radars",
        RANGE | {"radar_model": "physical", "radar_interference": 0.5},
        "radar",
    ),
    "lidar": Effect("lidar: lost and false returns", RANGE | {"lidar": "physical"}, "lidar"),
    "spray": Effect(
        "lidar: lost and false returns, and spray",
        RANGE | {"lidar": "physical", "spray": True},
        "lidar",
    ),
    "fog_drops": Effect(
        "lidar: lost and false returns with the drops of advection fog",
        RANGE | {"lidar": "physical", "lidar_fog": "advection"},
        "lidar",
    ),
    "window": Effect(
        "lidar: lost and false returns, wet ground, drops and dirt on the window",
        RANGE
        | {"lidar": "physical", "lidar_wet_ground": True, "lidar_drops_s": 5.0, "lidar_dirt": 0.3},
        "lidar",
    ),
    "pictures": Effect("colour pictures", {"camera": True}, "pictures"),
    "lens": Effect(
        "colour pictures with haze, exposure and drops on the glass",
        {
            "camera": True,
            "camera_haze": True,
            "camera_exposure": True,
            "camera_drops": True,
        },
        "pictures",
    ),
}
# sensors that our drivers read; of another stack it shows only in its drives
READS = {"camera": ("pictures",), "reference": ()} | dict.fromkeys("0123456", ("depth", "radar"))


@dataclass(frozen=True, slots=True)
class Result:
    """What an effect did to one stack."""

    stack: str
    effect: str
    title: str
    interventions: Comparison
    speed: Comparison  # km/h
    changed: int  # of the pairs, drives that differ at all
    is_read: bool  # the sensor through which the effect acts; true for one that needs none

    @property
    def note(self) -> str:
        """Returns why no drive changed: the stack does not read the sensor, or nothing did; "" if one did."""
        if self.changed:
            return ""
        return NO_CHANGE if self.is_read else NOT_READ


def sensor_of(arm: str) -> str:
    """Returns the sensor through which alone an arm acts; "" for an arm that needs none."""
    return EFFECTS[arm].sensor if arm in EFFECTS else ""


def settings_of_arm(arm: str) -> dict[str, Any]:
    """Returns the settings of an arm: "none", one effect by name, or "all"."""
    values = dict(OFF)
    for name, effect in EFFECTS.items():
        if arm in (name, ALL):
            values |= effect.values
    return values


def plan_arm(
    stack: str, weather: str, arm: str, seed: int, duration: float, map: str = "figure8"
) -> RunSpec:
    """Returns the run of an arm; the driver that sees pictures gets them."""
    driver = find_driver(stack)
    pixels = isinstance(driver, CameraDriver)
    spec = RunSpec(
        driver=driver,
        weather=find_weather(weather),
        settings=load_profile("recommended", settings_of_arm(arm)),
        course=Roads(map=map, allow_fewer=True),  # short maps hold fewer
        sensors=SensorLevel.PIXELS if pixels else SensorLevel.OBJECTS,
        seed=seed,
        duration=duration,
    )
    wet = arm == ALL or (arm in EFFECTS and EFFECTS[arm].puddles)
    return structs.replace(spec, surface=_puddles(roads_of(spec).map)) if wet else spec


def _puddles(map_name: str) -> tuple[SurfacePatch, ...]:
    """Returns deep water on the left half of every lane of a map."""
    roads = sorted(set(load_map(map_name).lanes.road.tolist()))
    return tuple(
        SurfacePatch(name=f"puddle {road}", water_mm=PUDDLE_MM, road=road, side="left")
        for road in roads
    )


def drive_arm(spec: RunSpec) -> dict[str, Any]:
    """Drives one arm in a worker and returns its row."""
    driven = run(spec)
    metrics = run_metrics(driven.log, load_map(roads_of(spec).map))
    return {
        "seed": spec.seed,
        "outcome": driven.outcome.value,
        "interventions": metrics.interventions,
        "mean_speed_kmh": metrics.mean_speed_kmh,
        "log_hash": log_hash(driven.log),
    }


def drive_effects(
    stack: str,
    weather: str,
    seeds: Sequence[int],
    duration: float,
    workers: int,
    effects: Sequence[str] = tuple(EFFECTS),
    on_run: Callable[[int, int], None] = lambda *_: None,
    map: str = "figure8",
) -> pl.DataFrame:
    """Drives none, each effect alone and all together with the same seeds; returns a row per run.

    on_run: called with the runs done and the runs in all. Raises SkidpadError when a run fails.
    """
    arms = (NONE, *effects, ALL)
    jobs = [
        Job(f"{arm}-{seed}", drive_arm, spec, spec.deadline_s)
        for arm in arms
        for seed in seeds
        for spec in (plan_arm(stack, weather, arm, seed, duration, map),)
    ]
    about = {"stack": stack, "weather": weather, "map": map}
    rows = zip(jobs, drive_all("effects", jobs, workers, on_run), strict=True)
    return pl.DataFrame([about | {"arm": job.key.rsplit("-", 1)[0]} | row for job, row in rows])


def compare_effects(rows: pl.DataFrame) -> list[Result]:
    """Returns each arm compared with none, pair by pair of equal seeds; rows: of one stack and weather."""
    arms = [arm for arm in rows["arm"].unique(maintain_order=True).to_list() if arm != NONE]
    by_arm = {arm: rows.filter(pl.col("arm") == arm).sort("seed") for arm in (NONE, *arms)}
    base, stack = by_arm[NONE], rows["stack"][0]
    changed = {arm: int((by_arm[arm]["log_hash"] != base["log_hash"]).sum()) for arm in arms}
    # a sensor through which one effect acts is read by the stack, whatever the others do
    read = {"", *READS.get(stack, ()), *(sensor_of(arm) for arm in arms if changed[arm])}
    found = []
    for arm in arms:
        pairs = {
            name: compare_pairs((by_arm[arm][name] - base[name]).to_numpy().astype(float))
            for name in ("interventions", "mean_speed_kmh")
        }
        title = "all together" if arm == ALL else EFFECTS[arm].title
        found.append(
            Result(
                stack,
                arm,
                title,
                pairs["interventions"],
                pairs["mean_speed_kmh"],
                changed[arm],
                sensor_of(arm) in read,
            )
        )
    return found
