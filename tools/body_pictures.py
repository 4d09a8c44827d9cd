"""Pictures of vehicles and people from ahead, from the side, from behind and at an angle.

    python tools/body_pictures.py docs/img/bodies   # a strip per vehicle type, and a sheet of others

The reference page of vehicles shows the strips; docs/rendering.md shows the sheet.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from math import atan2, cos, pi, radians, sin
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from skidpad.core.geometry import Pose
from skidpad.core.specs import CameraSpec, Modality
from skidpad.core.states import ActorStates, ActorTable
from skidpad.core.vocabulary import ActorKind, Bodywork
from skidpad.physics.presets import preset
from skidpad.physics.types import vehicle_types
from skidpad.roads.bundled import load_map
from skidpad.roads.lanes import LaneKind
from skidpad.roads.queries import RoadMap
from skidpad.sensors.finish.extras import ALL_EXTRAS
from skidpad.sensors.suite import PixelSettings, PixelSuite

MAP, SIZE, ANGLES = "motorway", (640, 480), (0.0, 90.0, 180.0, 35.0, 215.0)  # deg, of the camera
SHOWN = (224, 168)  # px of one picture in a strip
PAINTS = (
    (225, 225, 225),
    (30, 60, 130),
    (150, 25, 30),
    (170, 173, 177),
    (35, 80, 50),
    (95, 98, 102),
)
# one type per style that no type of `vehicles.yaml` has; sizes in m as in the server's catalogue
OTHERS = {
    "coupe": ("vehicle.audi.tt", ActorKind.CAR, (4.1812, 1.9941, 1.3853)),
    "long-nose": ("vehicle.ford.mustang", ActorKind.CAR, (4.7175, 1.8948, 1.3009)),
    "off-roader": ("vehicle.jeep.wrangler_rubicon", ActorKind.CAR, (3.8662, 1.9052, 1.8779)),
    "minibus": ("vehicle.volkswagen.t2", ActorKind.VAN, (4.4804, 2.0693, 2.0378)),
    "heavy lorry": ("vehicle.carlamotors.european_hgv", ActorKind.TRUCK, (7.9357, 2.8911, 3.4619)),
    "fire engine": ("vehicle.carlamotors.firetruck", ActorKind.TRUCK, (8.4680, 2.8911, 3.8274)),
    "sports motorcycle": ("vehicle.yamaha.yzf", ActorKind.MOTORCYCLE, (2.1908, 0.8659, 1.5304)),
    "cruiser": ("vehicle.harley-davidson.low_rider", ActorKind.MOTORCYCLE, (2.3502, 0.7662, 1.6495)),
    "scooter": ("vehicle.vespa.zx125", ActorKind.MOTORCYCLE, (1.8171, 0.8659, 1.5901)),
    "racing bicycle": ("vehicle.diamondback.century", ActorKind.BICYCLE, (1.6562, 0.5824, 1.6198)),
    "city bicycle": ("vehicle.gazelle.omafiets", ActorKind.BICYCLE, (1.8434, 0.6590, 1.7758)),
    "walker 1": ("walker.pedestrian.0001", ActorKind.PEDESTRIAN, (0.3754, 0.3754, 1.86)),
    "walker 2": ("walker.pedestrian.0002", ActorKind.PEDESTRIAN, (0.3754, 0.3754, 1.86)),
    "walker 3": ("walker.pedestrian.0004", ActorKind.PEDESTRIAN, (0.3754, 0.3754, 1.86)),
    "child": ("walker.pedestrian.0009", ActorKind.PEDESTRIAN, (0.5, 0.5, 1.1)),
}  # fmt: skip


def choose_place(road_map: RoadMap) -> Pose:
    """Returns a place in the middle of a long lane."""
    lanes, samples = road_map.lanes, road_map.samples
    lane = int(np.argmax(np.where(lanes.kind == LaneKind.DRIVING, lanes.length, 0.0)))
    row = int(lanes.first[lane] + lanes.size[lane] // 2)
    x, y, z, yaw = (float(v[row]) for v in (samples.x, samples.y, samples.z, samples.heading))
    return Pose(x, y, z, yaw=yaw)


def draw_strip(
    road_map: RoadMap, type: str, kind: ActorKind, size: tuple[float, float, float],
    paint: tuple[int, int, int], weather: str = "clear-noon",
) -> NDArray[np.uint8]:  # fmt: skip
    """Returns pictures of an actor from all angles beside each other."""
    length, width, height = size
    place = choose_place(road_map)
    table = ActorTable(
        names=("ego", "shown"),
        types=("saloon", type),
        kind=np.array([ActorKind.CAR, kind], np.uint8),
        length=np.array([4.0, length]),
        width=np.array([1.8, width]),
        height=np.array([1.5, height]),
        rgb=np.array([(0, 0, 0), paint], np.uint8),
    )
    pictures = []
    for angle in ANGLES:
        away = (
            1.25 * max(length if angle not in (0.0, 180.0) else 0.75 * length, 1.5 * height) + 0.8
        )
        eye = max(1.2, 0.75 * height)
        camera = CameraSpec(
            "c",
            Modality.RGB,
            *SIZE,
            48.0,
            Pose(0.0, 0.0, eye, pitch=atan2(eye - 0.45 * height, away)),
        )
        settings = PixelSettings(
            extras=ALL_EXTRAS, in_cockpit=False, camera_effect=False, bodywork=Bodywork.SHAPED
        )
        suite = PixelSuite(road_map, table, [camera], preset(weather), settings)
        turn = place.yaw + radians(angle)
        states = ActorStates.empty(2)
        states.x[:] = place.x + away * cos(turn), place.x
        states.y[:] = place.y + away * sin(turn), place.y
        states.yaw[:] = turn + pi, place.yaw
        states.z[:], states.present[:] = place.z, True
        rgb = suite.observe(0, states, {}).images["c"].rgb
        assert rgb is not None
        pictures.append(cv2.resize(rgb, SHOWN, interpolation=cv2.INTER_AREA))
    return np.asarray(np.hstack(pictures), dtype=np.uint8)


def main(arguments: Sequence[str] | None = None) -> None:
    """Draws the strips, and the sheet of those that have no strip of their own."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=Path)
    parser.add_argument("--weather", default="clear-noon")
    chosen = parser.parse_args(arguments)
    chosen.out.mkdir(parents=True, exist_ok=True)
    road_map = load_map(MAP)
    for i, (name, v) in enumerate(vehicle_types().items()):
        size = (v.length, v.width, v.height)
        strip = draw_strip(
            road_map, name, v.actor_kind, size, PAINTS[i % len(PAINTS)], chosen.weather
        )
        Image.fromarray(strip).save(chosen.out / f"{name}.webp", quality=80, method=6)
    rows = [
        draw_strip(road_map, type, kind, size, PAINTS[i % len(PAINTS)], chosen.weather)
        for i, (type, kind, size) in enumerate(OTHERS.values())
    ]
    Image.fromarray(np.vstack(rows)).save(chosen.out / "others.webp", quality=78, method=6)


if __name__ == "__main__":
    main()
