"""The ego's sensors on the server: attached, listened to, and waited for in every tick."""

from __future__ import annotations

import queue
from collections.abc import Callable, Sequence
from typing import Any

from skidpad.core.errors import BackendError
from skidpad.core.setup import Setup
from skidpad.core.specs import (
    IMU,
    CameraSpec,
    LidarSpec,
    Modality,
    PointSensorSpec,
    RadarSpec,
    SensorSpec,
)
from skidpad.core.vocabulary import SensorLevel
from skidpad.simulation.carla.axes import to_transform
from skidpad.simulation.carla.connection import Connection
from skidpad.simulation.carla.events import EgoEvents

CAMERAS = {
    Modality.RGB: "sensor.camera.rgb",
    Modality.DEPTH: "sensor.camera.depth",
    Modality.SEMANTIC: "sensor.camera.semantic_segmentation",
    Modality.INSTANCE: "sensor.camera.instance_segmentation",
}
# A tick without an event sends nothing that could be waited for. So the last sensor speaks in every
# tick: once it is heard, what the event sensors had to say before it is there too.
LAST = PointSensorSpec("last word of a tick", IMU)
EVENTS = {"collision": "sensor.other.collision", "lane_invasion": "sensor.other.lane_invasion"}


class Mailbox:
    """What one streaming sensor sends; a callback of the wheel's threads only appends."""

    def __init__(self, spec: SensorSpec) -> None:
        self.spec = spec
        self._arrived: queue.SimpleQueue[Any] = queue.SimpleQueue()

    def hear(self, data: Any) -> None:
        """Receives a message of the sensor."""
        self._arrived.put(data)

    def of(self, frame: int, timeout: float) -> Any:
        """Returns the message of this frame or a later one, older ones are dropped.

        None when none comes within `timeout` s of the last.
        """
        while True:
            try:
                data = self._arrived.get(timeout=timeout)
            except queue.Empty:
                return None
            if data.frame >= frame:
                return data


class Sensors:
    """All sensors of the ego. Every one is attached; only those that are read send."""

    def __init__(
        self, connection: Connection, world: Any, ego: Any, setup: Setup, events: EgoEvents
    ) -> None:
        self._connection, self._world, self._ego = connection, world, ego
        self._setup = setup
        self.boxes: dict[str, Mailbox] = {}
        self.actors: list[Any] = []
        self.listening: list[Any] = []
        self.silent: list[str] = []
        pixels = setup.level is SensorLevel.PIXELS
        display = set() if setup.render_all else display_cameras(setup.specs) - setup.asked
        for spec in setup.specs:
            if isinstance(spec, PointSensorSpec):
                if spec.kind in EVENTS:
                    hear = (
                        events.hear_collision if spec.kind == "collision" else events.hear_invasion
                    )
                    self._listen(self._attach(EVENTS[spec.kind], spec, {}), hear)
            elif pixels and isinstance(spec, (CameraSpec, RadarSpec)):
                actor = self._attach(*describe_sensor(spec))
                if spec.id in display:
                    self.silent.append(spec.id)
                    continue
                self._read(actor, spec)
            elif isinstance(spec, LidarSpec):
                self._read(self._attach(*describe_sensor(spec)), spec)
        self._read(self._attach("sensor.other.imu", LAST, {}), LAST)

    def _read(self, actor: Any, spec: SensorSpec) -> None:
        """Starts to collect what the actor sends in a mailbox of its sensor id."""
        box = self.boxes[spec.id] = Mailbox(spec)
        self._listen(actor, box.hear)

    def _listen(self, actor: Any, hear: Callable[[Any], None]) -> None:
        """Calls `hear` with each message of the actor from now on."""
        actor.listen(hear)
        self.listening.append(actor)

    def _attach(self, id: str, spec: SensorSpec, attributes: dict[str, str]) -> Any:
        """Spawns a CARLA sensor with the attributes it has, at its mount on the ego, and returns it."""
        carla = self._connection.carla
        blueprint = self._world.get_blueprint_library().find(id)
        for name, value in attributes.items():
            if blueprint.has_attribute(name):
                blueprint.set_attribute(name, value)
        actor = self._world.spawn_actor(blueprint, to_transform(carla, spec.mount), self._ego)
        self.actors.append(actor)
        return actor

    def collect(self, frame: int, timeout: float | None = None) -> dict[str, Any] | None:
        """Returns the messages of a frame by sensor id; None when one is missing and `timeout` was given.

        BackendError when one is missing after the connection's patience, or is of another frame.
        """
        patience = self._connection.options.timeout if timeout is None else timeout
        found = {}
        for id, box in self.boxes.items():
            data = box.of(frame, patience)
            if data is None and timeout is not None:
                return None
            if data is None or data.frame != frame:
                told = "nothing" if data is None else f"frame {data.frame}"
                raise BackendError(
                    f"CARLA at {self._connection.options.address}: sensor {id} sent {told} instead "
                    f"of frame {frame} within {patience:g} s"
                )
            found[id] = data
        return found

    def close(self) -> None:
        """Stops listening, then destroys the sensors: one that still sends when the client ends aborts it."""
        for actor in self.listening:
            actor.stop()
        self.listening.clear()
        destroy = self._connection.carla.command.DestroyActor  # an actor's own destroy() warns
        self._connection.client.apply_batch_sync([destroy(a) for a in self.actors], False)
        self.actors.clear()


def display_cameras(specs: Sequence[SensorSpec]) -> set[str]:
    """Returns the ids of RGB cameras that only a display shows: all but the first."""
    rgb = [s.id for s in specs if isinstance(s, CameraSpec) and s.modality is Modality.RGB]
    return set(rgb[1:])


def describe_sensor(
    spec: CameraSpec | RadarSpec | LidarSpec,
) -> tuple[str, SensorSpec, dict[str, str]]:
    """Returns CARLA's blueprint id, the spec and the attributes of a sensor (A-018 to A-028)."""
    if isinstance(spec, LidarSpec):
        return (
            "sensor.lidar.ray_cast_semantic",
            spec,
            {
                "channels": str(spec.channels),
                "range": f"{spec.range:g}",
                "points_per_second": str(spec.points_per_second),
                "rotation_frequency": f"{spec.rotation_hz:g}",
                "upper_fov": f"{spec.upper_fov_deg:g}",
                "lower_fov": f"{spec.lower_fov_deg:g}",
                "sensor_tick": "0.0",
            },
        )
    if isinstance(spec, RadarSpec):
        return (
            "sensor.other.radar",
            spec,
            {
                "horizontal_fov": f"{spec.horizontal_fov_deg:g}",
                "vertical_fov": f"{spec.vertical_fov_deg:g}",
                "range": f"{spec.range:g}",
                "points_per_second": str(spec.points_per_second),
                "sensor_tick": "0.0",
            },
        )
    return (
        CAMERAS[spec.modality],
        spec,
        {
            "image_size_x": str(spec.width),
            "image_size_y": str(spec.height),
            "fov": f"{spec.fov_deg:g}",
            "sensor_tick": "0.0",
            **spec.attributes,
        },
    )
