"""Decision M-3 with shaped bodies: pixels and boxes give the published stack the same readings.

A vehicle of each type stands or drives ahead at many distances, straight, turned or in the next
lane; both camera pairs read it from pixels, and from the faces of its box.
"""

from types import SimpleNamespace

import numpy as np
import pytest

from skidpad.core.specs import CameraSpec
from skidpad.core.states import ActorTable
from skidpad.core.vocabulary import ActorKind, Bodywork
from skidpad.core.weather import Weather
from skidpad.physics.types import vehicle_types
from skidpad.sensors.object_level.objects import ObjectSuite
from skidpad.sensors.published_sensors import twelve_sensors
from skidpad.sensors.suite import PixelSettings, PixelSuite
from skidpad.stack.perception.fusion import (
    CameraPair,
    bumper_corridor,
    camera_pair,
    roof_corridor,
)
from support.sensors.worlds import states_at, straight
from support.stack_parts import fuse, read_pair

DISTANCES = np.geomspace(4.0, 74.0, 9)  # m between the bumpers
PLACES = [(left, yaw) for left in (0.0, 1.0) for yaw in (0.0, 0.12)]
SPECS = twelve_sensors()


def read_all(bodywork, type):
    """Returns fused distances by place, NaN for none, from pixels and from boxes."""
    body, ego = vehicle_types()[type], vehicle_types()["mini_cooper_s"]
    table = ActorTable(
        names=("ego", "lead"), types=("mini_cooper_s", type),
        kind=np.array([ActorKind.CAR, body.actor_kind], np.uint8),
        length=np.array([ego.length, body.length]), width=np.array([ego.width, body.width]),
        height=np.array([ego.height, body.height]), rgb=np.full((2, 3), 90, np.uint8),
    )  # fmt: skip
    cameras = [
        s
        for s in SPECS
        if isinstance(s, CameraSpec) and s.id.split("_")[0] in ("depth", "semantic")
    ]
    road = straight(400)
    pixels = PixelSuite(road, table, cameras, Weather(), PixelSettings(bodywork=bodywork))
    boxes = ObjectSuite(road.roadside, table, SPECS, 0, 0.05)
    bumper = CameraPair(
        *(p := camera_pair(SPECS, "depth_bumper", "semantic_bumper")), bumper_corridor(p[1])
    )
    roof = CameraPair(
        *(q := camera_pair(SPECS, "depth_roof", "semantic_roof")), roof_corridor(q[1])
    )
    found = []
    tick = 0
    for left, yaw in PLACES:
        for distance in DISTANCES:
            x = 50.0 + 0.5 * (ego.length + body.length) + distance
            states = states_at([(50.0, -8.75, 0.0, 0.0), (x, -8.75 + left, 0.0, yaw)])
            images = pixels.observe(tick, states, {}).images
            tick += 1
            row = []
            for frame in (
                SimpleNamespace(images=images, segments={}),
                SimpleNamespace(images={}, segments=boxes.segments(states)),
            ):
                one = fuse(read_pair(bumper, frame), read_pair(roof, frame))
                row.append(np.nan if one is None else one)
            found.append(row)
    return np.array(found).T


@pytest.mark.req("M-3")
@pytest.mark.parametrize("bodywork", list(Bodywork))
def test_pixels_and_boxes_give_the_same_readings(bodywork):
    pairs = [read_all(bodywork, type) for type in vehicle_types()]
    pixels, boxes = np.concatenate(pairs, axis=1)
    seen = ~np.isnan(pixels) & ~np.isnan(boxes)
    assert seen.sum() > 150
    assert np.median(np.abs(pixels[seen] - boxes[seen])) <= 0.3
    assert np.mean(np.isnan(pixels) == np.isnan(boxes)) >= 0.97
