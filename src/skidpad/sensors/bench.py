"""CPU time of each sensor stage on figure8 with 20 vehicles: for `skidpad bench sensors`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from statistics import median
from time import process_time_ns

import numpy as np

from skidpad.core.specs import Modality
from skidpad.core.states import ActorStates, ActorTable
from skidpad.core.vocabulary import ActorKind, LightState, RangeModel
from skidpad.physics.presets import preset
from skidpad.roads.bundled import load_map
from skidpad.roads.queries import LanePoint, RoadMap
from skidpad.sensors.published_sensors import twelve_sensors
from skidpad.sensors.suite import PixelSettings, PixelSuite

TICKS = 200
STEP = 1.5  # m per tick: 30 m/s at 20 Hz
CORE = ("depth_roof", "semantic_roof", "depth_bumper", "semantic_bumper")
SPEED = 30.0  # m/s
# Distance from the ego in m, and lanes to its right: close to the published placement.
PLACES = (
    (25, 0), (40, 1), (55, -1), (70, 0), (90, 1), (110, -1), (130, 0), (150, 1), (175, -1),
    (200, 0), (230, 1), (260, -1), (300, 0), (350, 1), (400, -1),
    (-20, 1), (-35, 0), (-50, -1), (-70, 0), (-90, 1),
)  # fmt: skip
KINDS = (ActorKind.CAR, ActorKind.CAR, ActorKind.VAN, ActorKind.CAR, ActorKind.TRUCK)
SIZES = {
    ActorKind.CAR: (4.5, 1.85, 1.48),
    ActorKind.VAN: (5.9, 2.0, 2.5),
    ActorKind.TRUCK: (9.0, 2.5, 3.6),
}
EGO_SIZE = (3.876, 1.973, 1.475)  # m, the published ego's class of car
PAINTS = ((196, 34, 38), (30, 70, 160), (232, 232, 230), (44, 46, 50), (180, 184, 188))


def convoy(map: RoadMap, travelled: float = 0.0) -> tuple[ActorTable, ActorStates]:
    """Returns the ego and 20 vehicles around it, `travelled` m after the map's start."""
    assert map.ego_start is not None, f"map {map.name} has no start for the ego"
    at = map.ego_start
    start = map.on_lane(at.road, at.lane, at.s)
    ego = map.ahead(start, travelled + 1.0) or start
    points = [ego, *(_place(map, ego, *place) for place in PLACES)]
    kinds = [ActorKind.CAR, *(KINDS[i % len(KINDS)] for i in range(len(PLACES)))]
    sizes = np.array([EGO_SIZE, *(SIZES[kind] for kind in kinds[1:])])
    paint = np.array([PAINTS[i % len(PAINTS)] for i in range(len(points))], dtype=np.uint8)
    table = ActorTable(
        tuple(f"vehicle-{i}" for i in range(len(points))),
        tuple(kind.name.lower() for kind in kinds),
        np.array(kinds, dtype=np.uint8),
        sizes[:, 0].copy(),
        sizes[:, 1].copy(),
        sizes[:, 2].copy(),
        paint,
    )
    states = ActorStates.empty(len(points))
    for i, point in enumerate(points):
        states.x[i], states.y[i], states.z[i] = point.x, point.y, point.z
        states.yaw[i] = point.heading
        states.vx[i] = SPEED * np.cos(point.heading)
        states.vy[i] = SPEED * np.sin(point.heading)
    states.present[:] = True
    return table, states


def _place(map: RoadMap, ego: LanePoint, distance: float, lanes_right: int) -> LanePoint:
    """Returns the point `distance` in m ahead, one lane right (1) or left (-1); stays where none is."""
    point = map.ahead(ego, distance) if distance >= 0 else map.behind(ego, -distance)
    point = point or ego
    side = map.right if lanes_right > 0 else map.left
    return (side(point) or point) if lanes_right else point


def run(ticks: int = TICKS, weather: str = "rain-night") -> dict[str, float]:
    """Returns the median CPU time in ms of each stage over single-shot ticks, kernels warm.

    `core` is a tick that reads depth, labels and radar only; `all_images` one that reads all. The
    RGB stages come from the latter, where every picture has thrown the others out of the cache.
    """
    map = load_map("figure8")
    table, _ = convoy(map)
    specs = twelve_sensors()
    suite = PixelSuite(
        map, table, specs, preset(weather), PixelSettings(range_model=RangeModel.PHYSICAL, seed=1)
    )
    frames = [convoy(map, STEP * 10 * k)[1] for k in range(ticks // 10)]
    rgb = [id for id, c in suite.cameras.items() if c.modality is Modality.RGB]
    core = _medians(suite, frames, CORE, ticks)
    everything = _medians(suite, frames, [*CORE, *rgb], ticks)
    return {
        **core,
        **{id: everything[id] for id in rgb},
        "core": sum(core.values()),
        "all_images": sum(everything.values()),
    }


def _medians(
    suite: PixelSuite, frames: list[ActorStates], ids: Sequence[str], ticks: int
) -> dict[str, float]:
    """Returns the median processor time in ms of observing and of rendering each camera, by name."""
    lights = dict.fromkeys(suite.scene.static.lamps.signal.tolist(), LightState.RED)
    times: dict[str, list[float]] = {"observe_and_radar": [], **{id: [] for id in ids}}
    for k in range(-2, ticks):
        state = frames[max(k, 0) % len(frames)]
        spent = {"observe_and_radar": _cpu_ms(partial(suite.observe, k, state, lights))}
        for id in ids:
            spent[id] = _cpu_ms(partial(suite.render, id))
        if k >= 0:
            for name, value in spent.items():
                times[name].append(value)
    return {name: median(values) for name, values in times.items()}


def _cpu_ms(work: Callable[[], object]) -> float:
    """Returns the processor time in ms that a call takes."""
    begin = process_time_ns()
    work()
    return (process_time_ns() - begin) / 1e6
