"""Camera pictures without a label: can a reader name road, weather and time of day from them alone?

    python tools/unlabelled_pictures.py motorway town Town04.xodr --out DIR --key FILE --seed 1

Draws VIEWS places on each map, REMOTE m from one another where it has room: the kinds of road that a map has
come equally often, and so do weathers and times of day over all pictures. A picture is what the driver sees
in the cockpit: full scenery, shaped bodies among other vehicles, all additions for people. DIR gets 01.png,
02.png ...; FILE, which must lie elsewhere, the answers, of ROADS and SKIES. The same maps and seed give
the same pictures.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from itertools import cycle, islice
from pathlib import Path
from typing import TypeVar

import numpy as np
from PIL import Image

from skidpad.cockpit.studio import SENSOR, View
from skidpad.core.geometry import Pose
from skidpad.core.specs import CameraSpec
from skidpad.core.states import ActorStates, ActorTable
from skidpad.core.traffic.paints import draw_paint
from skidpad.core.vocabulary import Bodywork, LightState, Scenery
from skidpad.physics.presets import find_weather, preset
from skidpad.physics.types import EGO_TYPE, vehicle_types
from skidpad.roads.bundled import load_map
from skidpad.roads.lanes import LaneKind
from skidpad.roads.queries import LanePoint, RoadMap
from skidpad.scenery.dressing import dress_map
from skidpad.scenery.sides import RoadKind, kind_of
from skidpad.sensors.finish.extras import ALL_EXTRAS
from skidpad.sensors.published_sensors import twelve_sensors
from skidpad.sensors.suite import PixelSettings, PixelSuite

VIEWS, REMOTE = 4, 150.0  # of a map; m between two of them
SIZE = (1280, 720)  # px
ROADS = {
    RoadKind.MOTORWAY: "motorway",
    RoadKind.TOWN: "town street",
    RoadKind.RURAL: "country road",
}
TIMES = {"day": 45.0, "low sun": 3.0, "night": -30.0}  # deg of the sun above the horizon
MATRIX = {"clear": "clear", "heavy rain": "rain"}  # as presets name them, with a sun of their own
PUBLISHED = {"day": "noon", "low sun": "sunrise", "night": "night"}
FOG = Path(__file__).parents[1] / "examples" / "fog.yaml"
OTHERS = {
    "rain": preset("rain_40"),
    "fog": find_weather(str(FOG)),
    "snow": preset("snow"),
    "ice": preset("icy_70"),
}
SKIES = {
    **{
        (w, t): preset(f"{name}-{sun}")
        for w, name in MATRIX.items()
        for t, sun in PUBLISHED.items()
    },
    **{
        (w, t): replace(sky, sun_altitude_deg=sun)
        for w, sky in OTHERS.items()
        for t, sun in TIMES.items()
    },
}  # by weather and time
AHEAD, SEEN = 50.0, 90.0  # m ahead: that belong to the same road; where others stand
LEAST_LANES = 2  # of a road; a single one is a ramp
MOST, APART = 6, 14.0  # vehicles at most; m between two, which the longest type fits into
BESIDE, ABOVE = 16.0, 3.0  # m to the side and up or down, beyond which a lane is not of this road

CAMERA = next(
    replace(s, width=SIZE[0], height=SIZE[1])
    for s in twelve_sensors()
    if isinstance(s, CameraSpec) and s.id == SENSOR[View.DRIVER]
)

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Answer:
    """What a picture shows."""

    file: str
    road: str
    weather: str
    time: str
    map: str
    x: float  # m
    y: float
    heading: float  # rad


def deal(rng: np.random.Generator, choices: Sequence[T], count: int) -> list[T]:
    """Returns `count` of the choices in random order, as equally often as they can be."""
    order = [choices[int(k)] for k in rng.permutation(len(choices))]
    dealt = list(islice(cycle(order), count))
    return [dealt[int(k)] for k in rng.permutation(count)]


def deal_skies(rng: np.random.Generator, count: int) -> list[tuple[str, str]]:
    """Returns (weather, time) of each picture: each weather at each time before one comes again."""
    weathers = deal(rng, [*MATRIX, *OTHERS], len(MATRIX) + len(OTHERS))
    times = deal(rng, list(TIMES), len(TIMES))
    turns = range(-(-count // len(weathers)))
    skies = [(w, times[(k + n) % len(times)]) for n in turns for k, w in enumerate(weathers)]
    return [skies[int(k)] for k in rng.permutation(count)]


def places_on(road_map: RoadMap) -> dict[RoadKind, list[LanePoint]]:
    """Returns the places from which a camera sees AHEAD m of its road, by the kind of the road."""
    lanes, samples = road_map.lanes, road_map.samples
    found: dict[RoadKind, list[LanePoint]] = {}
    fits = (lanes.kind == LaneKind.DRIVING) & (lanes.junction < 0) & (lanes.length > AHEAD)
    for lane in np.flatnonzero(fits).tolist():
        section = (lanes.road == lanes.road[lane]) & (lanes.section == lanes.section[lane])
        if int((section & (lanes.kind == LaneKind.DRIVING)).sum()) < LEAST_LANES:
            continue
        kind = kind_of(samples, lanes, int(lanes.road[lane]))
        ways = np.arange(0.0, lanes.length[lane] - AHEAD, 1.0)
        found.setdefault(kind, []).extend(road_map.at(lane, float(s)) for s in ways)
    return found


def choose_place(
    rng: np.random.Generator, places: Sequence[LanePoint], seen: Sequence[LanePoint]
) -> LanePoint:
    """Returns one of the places that lie REMOTE m from all that were seen; one of all where none does."""
    away = [
        place
        for place in places
        if all(np.hypot(place.x - one.x, place.y - one.y) > REMOTE for one in seen)
    ]
    left = away or places
    return left[int(rng.integers(len(left)))]


def choose_others(rng: np.random.Generator, road_map: RoadMap, here: LanePoint) -> list[Pose]:
    """Returns places on lanes ahead for other vehicles, APART m from the camera and each other."""
    samples, lanes = road_map.samples, road_map.lanes
    dx, dy = samples.x - here.x, samples.y - here.y
    c, s = np.cos(here.heading), np.sin(here.heading)
    ahead, left = c * dx + s * dy, c * dy - s * dx
    near = (ahead > APART) & (ahead < SEEN) & (abs(left) < BESIDE)
    near &= (abs(samples.z - here.z) < ABOVE) & (lanes.kind[samples.lane] == LaneKind.DRIVING)
    rows = np.flatnonzero(near)
    found: list[Pose] = []
    for row in rng.permutation(rows)[:MOST].tolist():
        x, y, z, yaw = (float(v[row]) for v in (samples.x, samples.y, samples.z, samples.heading))
        if all(np.hypot(x - p.x, y - p.y) > APART for p in found):
            found.append(Pose(x, y, z, yaw=yaw))
    return found


def draw_picture(
    road_map: RoadMap, here: LanePoint, others: Sequence[Pose], answer: Answer, seed: int
) -> Image.Image:
    """Returns what the driver sees at a place; road_map: with its scenery."""
    kinds = vehicle_types()
    drawn = np.random.default_rng(seed).choice(sorted(kinds), len(others)).tolist()
    types = (EGO_TYPE, *drawn)
    bodies = [kinds[t] for t in types]
    names = tuple(f"{k}" for k in range(len(types)))
    table = ActorTable(
        names, types, np.array([b.actor_kind for b in bodies], dtype=np.uint8),
        np.array([b.length for b in bodies]), np.array([b.width for b in bodies]),
        np.array([b.height for b in bodies]),
        np.array([draw_paint(seed, name) for name in names], dtype=np.uint8),
    )  # fmt: skip
    states = ActorStates.empty(len(types))
    for k, pose in enumerate((here.pose, *others)):
        states.x[k], states.y[k], states.z[k], states.yaw[k] = pose.x, pose.y, pose.z, pose.yaw
    states.present[:] = True
    weather = SKIES[answer.weather, answer.time]
    settings = PixelSettings(
        seed=seed, in_cockpit=False, extras=ALL_EXTRAS, bodywork=Bodywork.SHAPED
    )
    suite = PixelSuite(road_map, table, [CAMERA], weather, settings)
    lights = dict.fromkeys(road_map.signals.id.tolist(), LightState.GREEN)
    rgb = suite.observe(0, states, lights).images[CAMERA.id].rgb
    assert rgb is not None
    return Image.fromarray(np.ascontiguousarray(rgb))


def draw_all(maps: Sequence[str], seed: int, out: Path) -> list[Answer]:
    """Writes the pictures of these maps into a folder and returns what they show."""
    rng = np.random.default_rng(seed)
    count = VIEWS * len(maps)
    skies, numbers = deal_skies(rng, count), (rng.permutation(count) + 1).tolist()
    answers = []
    for name in maps:
        plain = load_map(name)
        places, dressed = places_on(plain), dress_map(plain, Scenery.FULL)
        seen: list[LanePoint] = []
        for kind in deal(rng, sorted(places, key=lambda k: k.value), VIEWS):
            here = choose_place(rng, places[kind], seen)
            seen.append(here)
            number, (weather, time) = numbers.pop(), skies.pop()
            answer = Answer(
                f"{number:02}.png", ROADS[kind], weather, time,
                plain.name, here.x, here.y, here.heading,
            )  # fmt: skip
            others = choose_others(rng, plain, here)
            draw_picture(dressed, here, others, answer, seed + number).save(out / answer.file)
            answers.append(answer)
    return sorted(answers, key=lambda a: a.file)


def main(arguments: Sequence[str] | None = None) -> None:
    """Draws the pictures, and writes the answers where no reader of the pictures looks."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("maps", nargs="+", help="names of bundled maps, or OpenDRIVE files")
    parser.add_argument("--out", type=Path, required=True, help="folder of the pictures")
    parser.add_argument("--key", type=Path, required=True, help="file of the answers")
    parser.add_argument("--seed", type=int, default=1)
    chosen = parser.parse_args(arguments)
    if chosen.key.resolve().parent == chosen.out.resolve():
        parser.error("--key lies among the pictures; give it another folder than --out")
    for folder in (chosen.out, chosen.key.parent):
        folder.mkdir(parents=True, exist_ok=True)
    answers = draw_all(chosen.maps, chosen.seed, chosen.out)
    text = json.dumps([asdict(a) for a in answers], indent=1)
    chosen.key.write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
