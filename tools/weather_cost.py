"""What effects of weather cost in a tick at the object level: ratios of processor time, arms in turns.

    python tools/weather_cost.py [ROUNDS] [ARM...]

Each round drives every arm for SECONDS s in this process and takes the median of its ticks. Printed are
the median time of an arm, and median and quartiles of its ratio to the plain arm of its map in the same
round. Numbers stand on docs/physics.md and docs/radar-weather.md.
"""

from __future__ import annotations

import sys
from statistics import median, quantiles

from msgspec import structs

from skidpad.campaign.bench.tick import bench_run, tick_cost
from skidpad.core.environment.surface import SurfacePatch
from skidpad.core.run import RunSpec
from skidpad.core.vocabulary import SensorLevel
from skidpad.roads.bundled import load_map

SECONDS = 15.0
TYRES: dict[str, object] = {
    "tyres": "all_season", "tyre_stiffness": True, "water_drag": True, "roll_over": True,
    "anti_lock": "wheel_speeds", "stability": "wheel_speeds", "wind": True, "wind_speed": 10.0,
    "wind_gusts": 0.2, "wakes": True,
}  # fmt: skip
PUDDLE = (SurfacePatch(name="puddle", water_mm=10.0, circle=(12.0, -3.5, 4.0)),)
RADAR: dict[str, object] = {"radar_model": "physical"}
ARMS: dict[str, tuple[str, dict[str, object], str]] = {  # map, settings, surface
    "figure8": ("figure8", {}, ""),
    "tyres": ("figure8", TYRES, ""),
    "puddle": ("figure8", TYRES, "puddle"),
    "everywhere": ("figure8", TYRES, "everywhere"),
    "radar": ("figure8", RADAR, ""),
    "ghosts": ("figure8", RADAR | {"radar_multipath": True}, ""),
    "tracks": ("figure8", RADAR | {"radar_multipath": True, "radar_output": "tracks"}, ""),
    "motorway": ("motorway", {}, ""),
    "sheet_flow": ("motorway", TYRES | {"sheet_flow": True}, ""),
}


def surface_of(kind: str, map: str) -> tuple[SurfacePatch, ...]:
    """Returns a puddle, or ruts full of water with slush beside them and ice on every road of a map."""
    if kind != "everywhere":
        return PUDDLE if kind else ()
    found = list(PUDDLE)
    for road in sorted(set(load_map(map).lanes.road.tolist())):
        found += [
            SurfacePatch(water_mm=4.0, road=road, side="wheel_paths"),
            SurfacePatch(slush_mm=4.0, road=road, side="beside_wheel_paths"),
            SurfacePatch(ice_mm=1.0, road=road, s=(0.0, 20.0), air_below_c=50.0),
        ]
    return tuple(found)


def run_of(arm: str) -> RunSpec:
    """Returns the drive of an arm: configuration 2, 20 vehicles, rain at noon."""
    map, settings, surface = ARMS[arm]
    base = bench_run(2, "rain-noon", SensorLevel.OBJECTS)
    return structs.replace(
        base,
        course=structs.replace(base.course, map=map),
        settings=base.settings.with_values(settings),
        surface=surface_of(surface, map),
    )


def main() -> None:
    """Prints a line for each arm."""
    rounds = int(sys.argv[1]) if len(sys.argv) > 1 else 15
    arms = sys.argv[2:] or list(ARMS)
    runs = {arm: run_of(arm) for arm in arms}
    taken: dict[str, list[float]] = {arm: [] for arm in arms}
    for spec in runs.values():
        tick_cost(spec, SECONDS)
    for _ in range(rounds):
        for arm, spec in runs.items():
            taken[arm].append(1000.0 * tick_cost(spec, SECONDS).median)
    print("| arm | us per tick | over plain | quartiles |\n|---|---|---|---|")
    for arm in arms:
        plain = ARMS[arm][0]
        ratios = [own / base for own, base in zip(taken[arm], taken[plain], strict=True)]
        low, _, high = quantiles(ratios, n=4)
        print(
            f"| {arm} | {median(taken[arm]):.0f} | {median(ratios):.2f} | {low:.2f} to {high:.2f} |"
        )


if __name__ == "__main__":
    main()
