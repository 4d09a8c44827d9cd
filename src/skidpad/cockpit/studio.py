"""Cameras for people: every view of the cockpit, drawn from where everybody is (A-271, A-275).

They look at the same scene as the ego's sensors, but are cameras of their own: what the stack reads
is never touched, a log can be drawn as well as a live drive, and so can a drive without images.
"""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import replace
from enum import Enum
from itertools import chain
from math import atan2, hypot, radians
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.frames import CameraImage
from skidpad.core.geometry import Pose
from skidpad.core.inputs import Outside
from skidpad.core.kernels.threads import Beside
from skidpad.core.specs import CameraSpec, Modality, SensorSpec
from skidpad.core.states import ActorTable, WorldTruth
from skidpad.core.vocabulary import Bodywork, Quality, Scenery
from skidpad.roads.queries import RoadMap
from skidpad.scenery.dressing import dress_map
from skidpad.sensors.finish.extras import ALL_EXTRAS, Extra
from skidpad.sensors.published_sensors import twelve_sensors
from skidpad.sensors.suite import PixelSettings, PixelSuite
from skidpad.simulation.world.world import BRAKING

THINNED = 2  # depth and classes are shown at every second pixel
LOOKED_AT = 0.8  # m, height of what the crash camera looks at
DEPTH_SHOWN = 80.0  # m, white to black


class View(str, Enum):
    """What can be looked at."""

    DRIVER = "driver"
    FOLLOW = "follow"
    TOP = "top"
    LEFT = "left"
    REAR = "rear"
    RIGHT = "right"
    DEPTH = "depth"
    SEMANTIC = "semantic"
    CRASH = "crash"


MAIN = (View.DRIVER, View.FOLLOW, View.TOP, View.CRASH)  # of which one fills the page
SENSOR = {  # the published camera behind a view
    View.DRIVER: "rgb_front",
    View.LEFT: "rgb_mirror_left",
    View.REAR: "rgb_rear",
    View.RIGHT: "rgb_mirror_right",
    View.DEPTH: "depth_roof",
    View.SEMANTIC: "semantic_roof",
}
FOLLOW = CameraSpec(
    "follow", Modality.RGB, 800, 600, 75.0, Pose(-8.5, 0.0, 3.4, 0.0, radians(9.0), 0.0), True
)
TOP = CameraSpec(
    "top", Modality.RGB, 400, 400, 70.0, Pose(4.0, 0.0, 26.0, 0.0, radians(90.0), 0.0), True
)
BESIDE = Pose(-9.0, 7.0, 4.5)  # from where the crash camera looks, in the frame of the ego there
CRASH = CameraSpec("crash", Modality.RGB, 800, 600, 60.0, BESIDE, True)
OWN = {View.FOLLOW: FOLLOW, View.TOP: TOP, View.CRASH: CRASH}


def cameras() -> tuple[SensorSpec, ...]:
    """Returns the cameras of all views; their ids are the words of `View`."""
    by_id = {s.id: s for s in twelve_sensors() if isinstance(s, CameraSpec)}
    found = []
    for view in View:
        spec = OWN[view] if view in OWN else by_id[SENSOR[view]]
        found.append(replace(spec, id=view.value))
    return tuple(found)


class Looks(NamedTuple):
    """What the world looks like in the pictures for people."""

    scenery: Scenery = Scenery.FULL  # beside the roads
    bodywork: Bodywork = Bodywork.SHAPED  # of vehicles and people
    quality: Quality = Quality.FULL


FOR_PEOPLE = Looks()


class Studio:
    """Renders pictures of the moments of one run."""

    def __init__(
        self,
        map: RoadMap,
        table: ActorTable,
        outside: Outside,
        seed: int,
        extras: frozenset[Extra] = ALL_EXTRAS,
        looks: Looks = FOR_PEOPLE,
    ) -> None:
        """looks: of the world in these pictures, whatever the run had."""
        settings = PixelSettings(
            range_model=outside.range_model,
            seed=seed,
            in_cockpit=False,
            extras=extras,
            bodywork=looks.bodywork,
            quality=looks.quality,
        )
        self.suite = PixelSuite(
            dress_map(map, looks.scenery), table, cameras(), outside.weather, settings
        )
        self.outside = outside
        self.suite.change(outside)

    def change(self, outside: Outside, extras: frozenset[Extra] | None = None) -> None:
        """Sets other surroundings or additions to the pictures; extras None: the additions stay."""
        wanted = self.suite.settings.extras if extras is None else extras
        if outside != self.outside or wanted != self.suite.settings.extras:
            self.outside = outside
            self.suite.change(outside, wanted)

    def look(
        self,
        truth: WorldTruth,
        crash: Pose | None = None,
        indicating: NDArray[np.bool_] | None = None,
    ) -> Mapping[str, CameraImage]:
        """Returns the images of a moment by word of the view, each drawn when it is read.

        crash: what the crash camera looks at; None: at the ego. indicating: (n, 2) whose left and
        right indicators are lit. Valid until the next call.
        """
        ego, braking = truth.states.pose(0), truth.commands[:, 1] > BRAKING
        mount = mount_in(
            ego, watching(Pose(ego.x, ego.y, ego.z, yaw=ego.yaw) if crash is None else crash)
        )
        cameras = self.suite.cameras
        cameras[View.CRASH.value] = replace(cameras[View.CRASH.value], mount=mount)
        return self.suite.observe(
            truth.tick, truth.states, truth.lights, braking, indicating
        ).images

    def draw(self, images: Mapping[str, CameraImage], views: Sequence[View]) -> dict[View, Any]:
        """Returns what the page shows of the views, drawn in threads beside each other.

        images: as `look` has returned them. Valid as long as they are.
        """
        together: dict[Hashable, list[View]] = {}
        for view in views:  # cameras of one view share what they draw
            together.setdefault(self.suite.cameras[view.value].view, []).append(view)

        def draw(some: list[View]) -> list[tuple[View, NDArray[Any]]]:
            return [(view, plane(images[view.value])) for view in some]

        with Beside() as threads:
            drawn = [threads.start(draw, some) for some in together.values()]
        found = dict(chain.from_iterable(future.result() for future in drawn))
        return {view: found[view] for view in views}


def watching(place: Pose) -> Pose:
    """Returns the pose of a camera that stands behind and beside a place and looks at it, world."""
    at = place.moved(BESIDE.x, BESIDE.y, BESIDE.z)
    dx, dy = place.x - at.x, place.y - at.y
    return Pose(
        at.x, at.y, at.z, pitch=atan2(BESIDE.z - LOOKED_AT, hypot(dx, dy)), yaw=atan2(dy, dx)
    )


def mount_in(body: Pose, camera: Pose) -> Pose:
    """Returns the mounting on a body of a camera that stands in the world; both poses in the world."""
    turn = body.rotation().T
    x, y, z = turn @ (camera.x - body.x, camera.y - body.y, camera.z - body.z)
    r = turn @ camera.rotation()
    pitch = atan2(-r[2, 0], hypot(r[0, 0], r[1, 0]))
    return Pose(
        float(x), float(y), float(z), atan2(r[2, 1], r[2, 2]), pitch, atan2(r[1, 0], r[0, 0])
    )


def plane(image: CameraImage) -> NDArray[Any]:
    """Returns the part of an image that the page shows: colours, classes, or depth as bytes."""
    if image.packed is not None:
        return image.packed
    if image.labels is not None:
        return np.ascontiguousarray(image.labels[::THINNED, ::THINNED])
    assert image.inverse_depth is not None, "views show colours, classes or depth"
    inverse = image.inverse_depth[::THINNED, ::THINNED]
    with np.errstate(divide="ignore"):
        near = 1.0 - np.minimum(1.0 / (inverse * np.float32(DEPTH_SHOWN)), 1.0)
    shown: NDArray[np.uint8] = (255.0 * near).astype(np.uint8)
    return shown
