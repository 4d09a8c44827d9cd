"""The table of views of docs/rendering.md: evenness of colours and classes seen, with and without scenery.

    python tools/scenery_table.py town figure8 --weather clear-noon rain-noon
    python tools/scenery_table.py town figure8 motorway --picture docs/img/scenery.webp

For views from lanes of each map: the share of pixels in the 8 commonest colours after a 5 x 5 median
at 5 bits per channel, processor time of a picture of 800 x 600 with everything, and classes seen.
With --picture, one view of each map instead: without, and with scenery in four weathers.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from time import process_time

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from skidpad.core.geometry import Pose
from skidpad.core.specs import CameraSpec, Modality
from skidpad.core.states import ActorStates, ActorTable
from skidpad.core.vocabulary import Scenery, SemanticClass
from skidpad.physics.presets import preset
from skidpad.roads.bundled import load_map
from skidpad.roads.lanes import LaneKind
from skidpad.roads.queries import RoadMap
from skidpad.scenery.dressing import dress_map
from skidpad.sensors.finish.extras import ALL_EXTRAS
from skidpad.sensors.suite import PixelSettings, PixelSuite

CAMERAS = tuple(
    CameraSpec(m.value, m, 800, 600, 90.0, Pose(0.5, 0.0, 1.5))
    for m in (Modality.RGB, Modality.SEMANTIC)
)
PLACES = (0.1, 0.6)  # shares of the way along the lanes that are long enough
REPEATS = 5
SHOWN = ("clear-noon", "rain-sunrise", "snow", "clear-night")
SIZE = (300, 225)  # px of one picture in the sheet
LONG = 40.0  # m


@dataclass(frozen=True)
class Seen:
    """One view of a map."""

    rgb: NDArray[np.uint8]
    milliseconds: float
    classes: frozenset[SemanticClass]

    @property
    def commonest(self) -> float:
        """Share of the pixels that have one of the 8 commonest colours."""
        return find_commonest_share(self.rgb)


def find_commonest_share(rgb: NDArray[np.uint8]) -> float:
    """Returns the share of pixels in the 8 commonest colours."""
    few = cv2.medianBlur(np.ascontiguousarray(rgb), 5).astype(int) >> 3
    counts = np.bincount(((few[..., 0] << 10) | (few[..., 1] << 5) | few[..., 2]).ravel())
    return float(np.sort(counts)[-8:].sum() / counts.sum())


def choose_places(road_map: RoadMap) -> list[Pose]:
    """Returns places on long lanes, spread over the map."""
    lanes, samples = road_map.lanes, road_map.samples
    fits = np.flatnonzero((lanes.kind == LaneKind.DRIVING) & (lanes.length > LONG))
    found = []
    for share in PLACES:
        lane = fits[int(share * (len(fits) - 1))]
        row = int(lanes.first[lane] + 0.3 * lanes.size[lane])
        x, y, z, yaw = (float(v[row]) for v in (samples.x, samples.y, samples.z, samples.heading))
        found.append(Pose(x, y, z, yaw=yaw))
    return found


def look(road_map: RoadMap, place: Pose, weather: str) -> Seen:
    """Returns what is seen from a place."""
    table = ActorTable(
        names=("ego",), types=("car",), kind=np.zeros(1, np.uint8), length=np.array([4.0]),
        width=np.array([1.9]), height=np.array([1.5]), rgb=np.zeros((1, 3), np.uint8),
    )  # fmt: skip
    settings = PixelSettings(extras=ALL_EXTRAS, in_cockpit=False)
    suite = PixelSuite(road_map, table, CAMERAS, preset(weather), settings)
    states = ActorStates.empty(1)
    states.x[0], states.y[0], states.z[0], states.yaw[0] = place.x, place.y, place.z, place.yaw
    states.present[0] = True
    times = []
    for tick in range(REPEATS):
        images = suite.observe(tick, states, {}).images
        began = process_time()
        rgb = images["rgb"].rgb
        times.append(process_time() - began)
    labels = images["semantic"].labels
    assert rgb is not None
    assert labels is not None
    classes = frozenset(SemanticClass(int(c)) for c in np.unique(labels))
    return Seen(rgb.copy(), 1000.0 * float(np.median(times)), classes)


def draw_sheet(names: Sequence[str], path: Path) -> None:
    """Write one view per map: a row of it without scenery, then with it in SHOWN weathers."""
    rows = []
    for name in names:
        plain = load_map(name)
        place = choose_places(plain)[0]
        row = [look(plain, place, SHOWN[0])]
        row += [look(dress_map(plain, Scenery.FULL), place, weather) for weather in SHOWN]
        small = [cv2.resize(seen.rgb, SIZE, interpolation=cv2.INTER_AREA) for seen in row]
        rows.append(np.hstack(small))
    Image.fromarray(np.ascontiguousarray(np.vstack(rows))).save(path, quality=80, method=6)


def print_shares(names: Sequence[str], weathers: Sequence[str]) -> None:
    """Print the share of the 8 commonest colours with scenery: a row per view, a column per weather."""
    print(f"| view | {' | '.join(weathers)} |\n|---|{'---|' * len(weathers)}")
    for name in names:
        dressed = dress_map(load_map(name), Scenery.FULL)
        for k, place in enumerate(choose_places(dressed)):
            shares = [f"{look(dressed, place, weather).commonest:.0%}" for weather in weathers]
            print(f"| {dressed.name} {k + 1} | {' | '.join(shares)} |", flush=True)


def main() -> None:
    """Print the table as Markdown, or draw the sheet."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("maps", nargs="+")
    parser.add_argument("--weather", nargs="+", default=["clear-noon", "rain-noon"])
    parser.add_argument(
        "--wide", action="store_true", help="shares with scenery, a column per weather"
    )
    parser.add_argument("--picture", type=Path)
    chosen = parser.parse_args()
    if chosen.wide:
        print_shares(chosen.maps, chosen.weather)
        return
    if chosen.picture is not None:
        draw_sheet(chosen.maps, chosen.picture)
        return
    print(
        "| view | weather | 8 commonest colours, none / full | ms, none / full | seen only with full |"
    )
    print("|---|---|---|---|---|")
    for name in chosen.maps:
        plain = load_map(name)
        both = [dress_map(plain, s) for s in (Scenery.NONE, Scenery.FULL)]
        for k, place in enumerate(choose_places(plain)):
            for weather in chosen.weather:
                none, full = (look(m, place, weather) for m in both)
                new = ", ".join(sorted(c.name.lower() for c in full.classes - none.classes))
                print(
                    f"| {plain.name} {k + 1} | {weather} | {none.commonest:.0%} / {full.commonest:.0%} "
                    f"| {none.milliseconds:.1f} / {full.milliseconds:.1f} | {new} |"
                )


if __name__ == "__main__":
    main()
