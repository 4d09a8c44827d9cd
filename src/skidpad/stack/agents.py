"""Agents written for CARLA's leaderboard as stacks (decision G-6): `--stack agent:PATH:CLASS`.

An agent has `setup`, `sensors`, `set_global_plan`, `run_step(input_data, timestamp)` and `destroy`.
It lives in CARLA's axes, so everything that goes in or out passes `core.maths.lefthanded`. Its control is
read by attribute; nothing here imports carla.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from math import pi, tau
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from skidpad.core.errors import ConfigError, StackError
from skidpad.core.frames import LidarPoints, SensorFrame
from skidpad.core.geometry import Pose
from skidpad.core.kernels.depthcode import bgra_from_inverse_depth
from skidpad.core.maths.geodesy import geolocation
from skidpad.core.maths.lefthanded import (
    mirror_value,
    pose_from_carla,
    pose_to_carla,
    turn_from_carla,
    vector_from_carla,
    vectors_to_carla,
)
from skidpad.core.sensor_types import read_sensor
from skidpad.core.setup import DT
from skidpad.core.specs import CameraSpec, LidarSpec, Modality, SensorSpec
from skidpad.core.states import StackReport, VehicleCommand
from skidpad.roads.queries import LanePoint, RoadMap
from skidpad.stack.interface import Stack
from skidpad.stack.loading import import_class

METHODS = ("setup", "sensors", "run_step")
CAMERAS = {
    "sensor.camera.rgb": Modality.RGB,
    "sensor.camera.depth": Modality.DEPTH,
    "sensor.camera.semantic_segmentation": Modality.SEMANTIC,
}
GNSS, IMU, SPEEDOMETER = "sensor.other.gnss", "sensor.other.imu", "sensor.speedometer"
POINT_SENSORS = (GNSS, IMU, SPEEDOMETER, "sensor.other.speedometer")
LIDAR = "sensor.lidar.ray_cast"
KINDS = (*CAMERAS, LIDAR, *POINT_SENSORS)
MARK = "agent/"  # before an agent's sensor ids: ours may have the same
G_CARLA = 9.81  # m/s^2, what CARLA's accelerometer feels at rest
RED, ALPHA = 2, 3  # channels of BGRA
ROUTE_LENGTH, ROUTE_STEP = 500.0, 5.0  # m


class RoadOption(IntEnum):
    """What a point of the plan asks for; numbers as in CARLA's agents."""

    LANEFOLLOW = 4


@dataclass(frozen=True, slots=True)
class Vector:
    """Stands for CARLA's Vector3D: x, y, z."""

    x: float
    y: float
    z: float


@dataclass(frozen=True, slots=True)
class Rotation:
    """Stands for CARLA's Rotation, in degrees."""

    pitch: float
    yaw: float
    roll: float


@dataclass(frozen=True, slots=True)
class Transform:
    """A pose as agents read it: `location` and `rotation`."""

    location: Vector
    rotation: Rotation


def load_agent(where: str) -> type[Stack]:
    """Returns a stack class that drives with the agent class named by `path.py:Class` (or module:Class).

    ConfigError where the class lacks one of METHODS; errors of `import_class`.
    """
    kind = import_class(where, "agent")
    for method in METHODS:
        if not callable(getattr(kind, method, None)):
            raise ConfigError(f"agent {where!r}: class {kind.__name__} has no method {method}")
    return type(kind.__name__, (AgentStack,), {"agent_class": kind})


class AgentStack:
    """One agent at the wheel."""

    agent_class: ClassVar[type[Any]]
    report: StackReport = StackReport()

    def __init__(
        self, specs: Sequence[SensorSpec], map: RoadMap, settings: Mapping[str, Any]
    ) -> None:
        del specs
        self.map = map
        self.agent = _instance(self.agent_class)
        self.agent.setup(str(settings.get("config", "")))
        self.wanted: list[dict[str, Any]] = [dict(s) for s in self.agent.sensors()]
        self.specs = tuple(_spec(s) for s in self.wanted if _kind(s) not in POINT_SENSORS)
        self.planned = False

    def sensors(self) -> tuple[SensorSpec, ...]:
        """Returns the specs of the cameras and lidars that the agent asked for.

        The rest is read from the ego's own motion.
        """
        return self.specs

    def tick(self, frame: SensorFrame) -> VehicleCommand:
        """Calls the agent's `run_step` once and returns its command; StackError when it returns no control.

        Before the first call it gives the agent its plan.
        """
        if not self.planned:
            self._plan(frame.ego.pose)
            self.planned = True
        data = {str(s["id"]): (frame.tick, self._reading(s, frame)) for s in self.wanted}
        control = self.agent.run_step(data, frame.tick * DT)
        if control is None:
            raise StackError("run_step returned no control")
        return VehicleCommand(
            throttle=float(control.throttle),
            brake=float(control.brake),
            steer=mirror_value(float(control.steer)),
            handbrake=bool(getattr(control, "hand_brake", False)),
            reverse=bool(getattr(control, "reverse", False)),
        )

    def close(self) -> None:
        """Calls the agent's `destroy`, where it has one."""
        destroy = getattr(self.agent, "destroy", None)
        if callable(destroy):
            destroy()

    def _plan(self, start: Pose) -> None:
        """Gives the agent ROUTE_LENGTH m along the ego's lane, as GPS and as world coordinates.

        Does nothing for an agent without `set_global_plan`; less, or nothing, where the road ends.
        """
        give = getattr(self.agent, "set_global_plan", None)
        place: LanePoint | None = self.map.project(start.x, start.y, start.z)
        if not callable(give):
            return
        gps, world = [], []
        for _ in range(int(ROUTE_LENGTH / ROUTE_STEP)):
            if place is None:
                break
            gps.append((_gps(place.pose), RoadOption.LANEFOLLOW))
            world.append((transform(place.pose), RoadOption.LANEFOLLOW))
            place = self.map.ahead(place, ROUTE_STEP)
        give(gps, world)

    def _reading(self, wanted: Mapping[str, Any], frame: SensorFrame) -> Any:
        """Returns the data of one wanted sensor in CARLA's units and axes, as the Leaderboard hands them.

        StackError for a camera without an image.
        """
        kind, ego = _kind(wanted), frame.ego
        if kind == GNSS:
            place = _gps(ego.pose)
            return np.array([place["lat"], place["lon"], place["z"]])
        if kind == IMU:
            ax, ay, az = vector_from_carla(ego.ax, ego.ay, G_CARLA)
            wx, wy, wz = turn_from_carla(0.0, 0.0, ego.yaw_rate)
            return np.array([ax, ay, az, wx, wy, wz, (pi / 2.0 - ego.pose.yaw) % tau])
        if kind in CAMERAS:
            return _image(MARK + str(wanted["id"]), CAMERAS[kind], frame)
        if kind == LIDAR:
            seen = read_sensor(frame, MARK + str(wanted["id"]), LidarPoints)
            places = vectors_to_carla(*seen.xyz.astype(np.float64).T)
            return np.column_stack((places, seen.intensity)).astype(np.float32)
        return {"speed": ego.speed}


def _instance(kind: type[Any]) -> Any:
    """Returns an instance: newer agents take no argument, older ones the path of their configuration, ""."""
    try:
        return kind()
    except TypeError:
        return kind("")


def _kind(wanted: Mapping[str, Any]) -> str:
    """Returns the sensor type that an agent asks for; raises StackError for an unknown one."""
    kind = str(wanted.get("type", ""))
    if kind not in KINDS:
        known = ", ".join(KINDS)
        raise StackError(f"the agent asks for a sensor {kind!r}; there are: {known}")
    return kind


def _spec(wanted: Mapping[str, Any]) -> SensorSpec:
    """Returns a camera or lidar as the agent describes it, in CARLA's axes.

    What it leaves out is as in the leaderboard: there lidars have 64 channels and reach 85 m.
    """
    mount = pose_from_carla(
        *(float(wanted.get(k, 0.0)) for k in ("x", "y", "z", "roll", "pitch", "yaw"))
    )
    id = MARK + str(wanted["id"])
    if _kind(wanted) == LIDAR:
        return LidarSpec(
            id,
            mount,
            channels=int(wanted.get("channels", 64)),
            range=float(wanted.get("range", 85.0)),
            points_per_second=int(wanted.get("points_per_second", 600_000)),
            rotation_hz=float(wanted.get("rotation_frequency", 10.0)),
            upper_fov_deg=float(wanted.get("upper_fov", 10.0)),
            lower_fov_deg=float(wanted.get("lower_fov", -30.0)),
        )
    return CameraSpec(
        id,
        CAMERAS[_kind(wanted)],
        int(wanted.get("width", 800)),
        int(wanted.get("height", 600)),
        float(wanted.get("fov", 90.0)),
        mount,
    )


def _image(id: str, modality: Modality, frame: SensorFrame) -> NDArray[np.uint8]:
    """Returns (H, W, 4) BGRA bytes, as CARLA's sensors deliver them; StackError without an image.

    Depth is coded over the colours as CARLA does; labels are the red bytes.
    """
    if id not in frame.images:
        raise StackError(
            f"camera {id.removeprefix(MARK)!r} delivers no image: run with --sensors pixels"
        )
    image = frame.images[id]
    if modality is Modality.DEPTH:
        assert image.inverse_depth is not None
        bgra = np.zeros((*image.inverse_depth.shape, 4), dtype=np.uint8)
        bgra_from_inverse_depth(image.inverse_depth, bgra)
        return bgra
    drawn = image.rgb if modality is Modality.RGB else image.labels
    assert drawn is not None
    bgra = np.zeros((*drawn.shape[:2], 4), dtype=np.uint8)
    bgra[..., ALPHA] = 255
    if modality is Modality.RGB:
        bgra[..., :ALPHA] = drawn[:, :, ::-1]
    else:
        bgra[..., RED] = drawn
    return bgra


def _gps(pose: Pose) -> dict[str, float]:
    """Returns latitude, longitude in deg and height in m, around 0 N 0 E; north is left of the x axis."""
    lat, lon = geolocation(pose.x, pose.y, 0.0, 0.0)
    return {"lat": lat, "lon": lon, "z": pose.z}


def transform(pose: Pose) -> Transform:
    """Returns a pose in CARLA's axes, m and deg."""
    x, y, z, roll, pitch, yaw = pose_to_carla(pose)
    return Transform(Vector(x, y, z), Rotation(pitch, yaw, roll))
