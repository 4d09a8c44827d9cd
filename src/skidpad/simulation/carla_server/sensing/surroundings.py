"""What sensors look at: actors and map, as they are in the newest frame.

Meshes are made when a camera or ray first needs them, and again when actors come or go.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator
from contextlib import contextmanager

import numpy as np
from numpy.typing import NDArray

from skidpad.core.geometry import Pose
from skidpad.core.maths.constants import G
from skidpad.core.states import ActorStates
from skidpad.core.states import ActorTable as Bodies
from skidpad.core.vocabulary import Bodywork, Quality
from skidpad.core.weather import Weather
from skidpad.roads.queries import RoadMap
from skidpad.sensors.pictures.lighting import lighting
from skidpad.sensors.pictures.shading import shade_scene
from skidpad.sensors.raster.live_scene import LiveScene
from skidpad.sensors.raster.passes import Pass
from skidpad.simulation.carla_server.actors.boxes import Boxes
from skidpad.simulation.carla_server.actors.catalogue import Family
from skidpad.simulation.carla_server.actors.registry import SOLID, Actor, ActorTable, Box
from skidpad.simulation.carla_server.clock import Clock
from skidpad.simulation.carla_server.maps.landscape import Landscape
from skidpad.simulation.carla_server.maps.maps import ServedMap
from skidpad.simulation.carla_server.sensing.radio import Air
from skidpad.simulation.carla_server.vehicles.vehicles import Vehicles
from skidpad.simulation.carla_server.weather import Sky

WIDEST = 8192  # px
PAINT = (160, 160, 160)
RIGHT_INDICATOR, LEFT_INDICATOR = 0x10, 0x20  # of VehicleLightState
FLASH = 0.7  # s of a flash of indicators, 86 a minute; UN R48 allows 60 to 120
SKIN = 0.1  # m around a body within which a camera counts as inside


class Pictured:
    """Map and actors with a body for rays and cameras, in the state of one frame."""

    def __init__(
        self,
        roads: RoadMap,
        members: list[Actor],
        bodywork: Bodywork = Bodywork.PLAIN,
        quality: Quality = Quality.FULL,
    ) -> None:
        self.roads, self.members, self._quality = roads, members, quality
        self.rows = {a.id: i for i, a in enumerate(members)}
        self.ids = np.array([0, *(a.id for a in members)], dtype=np.int64)  # by instance
        self.bodies = _bodies(members)
        self.live = LiveScene(roads, self.bodies, WIDEST, bodywork)
        self.states = ActorStates.empty(len(members))
        self.weather: Weather | None = None
        self.elapsed = -np.inf

    def shade(self, weather: Weather) -> None:
        """Sets the light of the pictures to that of this weather."""
        if self.weather is not weather:
            self.weather = weather
            self.shading = shade_scene(
                self.live.static,
                self.bodies,
                lighting(weather, ground=self.live.ground),
                self._quality,
            )


class Surroundings:
    """The world as sensors may see it."""

    def __init__(
        self,
        map: ServedMap,
        landscape: Landscape,
        actors: ActorTable,
        vehicles: Vehicles,
        sky: Sky,
        clock: Clock,
        bodywork: Bodywork = Bodywork.PLAIN,
        quality: Quality = Quality.FULL,
    ) -> None:
        self.bodywork, self._quality = bodywork, quality
        self.map, self.actors, self.moving = map, actors, vehicles.moving
        self._landscape = landscape
        self.gravity = G  # m/s^2, as set by clients
        self.air = Air()
        self._built: tuple[RoadMap, Boxes] | None = None
        self._cars: tuple[int, Boxes] | None = None
        self._vehicles, self._sky, self._clock = vehicles, sky, clock
        self._pictured: Pictured | None = None
        self._still: Pictured | None = None
        self.drawn: dict[Hashable, Pass] = {}  # what cameras have drawn while nothing moves

    @contextmanager
    def standing_still(self) -> Iterator[None]:
        """Promises that nothing changes inside, so that all sensors, in threads too, share one picture."""
        self._still = self.picture()
        try:
            yield
        finally:
            self._still = None
            self.drawn.clear()

    def picture(self) -> Pictured:
        """Everything with a body as it is now; brought up to date once per frame."""
        if self._still is not None:
            return self._still
        members = [a for a in self.actors if a.family in SOLID]
        seen, roads = self._pictured, self._landscape.roads
        if seen is None or seen.members != members or seen.roads is not roads:
            self._pictured = seen = Pictured(roads, members, self.bodywork, self._quality)
        now = self._clock.elapsed
        if seen.elapsed != now:
            seen.states = self._states(members)
            seen.live.place(seen.states, now - seen.elapsed)
            seen.live.show(self.moving.lights.by_id)
            seen.elapsed = now
        seen.shade(self._sky.weather)
        seen.shading.set_braking(np.array([self._brakes(a) for a in members], dtype=np.bool_))
        if self.bodywork is Bodywork.SHAPED:
            seen.shading.set_indicating(self._indicating(members))
        return seen

    def carrier_row(self, sensor: Actor) -> int:
        """Row of the sensor's carrier in the picture, -1 when it has none there."""
        return self.picture().rows.get(sensor.parent, -1)

    def hidden_for(self, sensor: Actor) -> int:
        """Row of the carrier when the sensor sits inside its body, else -1."""
        row = self.carrier_row(sensor)
        if row < 0:
            return -1
        carrier, mount = self.actors.alive[sensor.parent], sensor.mount
        offsets = zip((mount.x, mount.y, mount.z), carrier.centre, carrier.half, strict=True)
        return row if all(abs(m - c) < h + SKIN for m, c, h in offsets) else -1

    def get_roadside_boxes(self) -> Boxes:
        """Returns the boxes that stand beside the road at present."""
        roads = self._landscape.roads
        if self._built is None or self._built[0] is not roads:
            there = ((0, Box(o.centre, o.half)) for o in self._landscape.present())
            self._built = roads, Boxes.of(there)
        return self._built[1]

    def cars(self) -> Boxes:
        """All vehicles as they are in this frame."""
        frame = self._clock.frame
        if self._cars is None or self._cars[0] != frame:
            vehicles = self.actors.of(Family.VEHICLE)
            self._cars = frame, Boxes.of((a.id, self.actors.box(a)) for a in vehicles)
        return self._cars[1]

    @property
    def weather(self) -> Weather:
        """The weather of this frame."""
        return self._sky.weather

    def speed_of_carrier(self, sensor: Actor) -> float:
        """Returns the speed in m/s over the ground of what carries the sensor; 0 without a carrier."""
        row, states = self.carrier_row(sensor), self.picture().states
        return float(np.hypot(states.vx[row], states.vy[row])) if row >= 0 else 0.0

    def lamps(self, vehicle: Actor) -> int:
        """Returns the vehicle's flags of VehicleLightState."""
        return self._vehicles.of(vehicle.id).lights

    def _brakes(self, actor: Actor) -> bool:
        """Returns whether the actor is a vehicle with its brake pedal pressed."""
        return actor.id in self._vehicles and self._vehicles.of(actor.id).control.brake > 0.0

    def _indicating(self, members: list[Actor]) -> NDArray[np.bool_]:
        """Returns whose left and right indicators shine now (n, 2): those switched on, while they flash."""
        shine = self._clock.elapsed % FLASH < 0.5 * FLASH
        flags = [self.lamps(a) if a.id in self._vehicles else 0 for a in members]
        switched = [(f & LEFT_INDICATOR, f & RIGHT_INDICATOR) for f in flags]
        lit: NDArray[np.bool_] = shine & (np.array(switched, dtype=int).reshape(-1, 2) != 0)
        return lit

    def _states(self, members: list[Actor]) -> ActorStates:
        """Poses and motion of all members: bodies by columns, what is attached one by one."""
        out = ActorStates.empty(len(members))
        to = [i for i, a in enumerate(members) if a.body is not None]
        source = [self.moving.row(a.body) for a in members if a.body is not None]
        for column, moving in zip(out, self.moving.states, strict=True):
            column[to] = moving[source]
        for i, actor in enumerate(members):
            if actor.body is None:
                p = actor.pose
                out.x[i], out.y[i], out.z[i] = p.x, p.y, p.z - actor.lift
                out.yaw[i], out.pitch[i], out.roll[i] = p.yaw, p.pitch, p.roll
                out.present[i] = True
        return out


def _bodies(members: list[Actor]) -> Bodies:
    """Returns names, types, kinds, sizes in m and colours of the actors, as arrays in their order."""
    size = 2.0 * np.array([a.half for a in members]).reshape(-1, 3)
    return Bodies(
        names=tuple(str(a.id) for a in members),
        types=tuple(a.blueprint.id for a in members),
        kind=np.array([a.blueprint.kind for a in members], dtype=np.uint8),
        length=size[:, 0],
        width=size[:, 1],
        height=size[:, 2],
        rgb=np.array([_paint(a) for a in members], dtype=np.uint8).reshape(-1, 3),
    )


def _paint(actor: Actor) -> tuple[int, int, int]:
    """Returns the actor's colour as RGB of 0..255; `PAINT` where it has none."""
    text = actor.attributes.get("color")
    if text is None:
        return PAINT
    red, green, blue = (int(v) for v in text.split(","))
    return red, green, blue


def headlights(actors: ActorTable, sensor: Actor) -> Pose:
    """The pose that carries the headlights of a picture."""
    return actors.pose(actors.carrier(sensor) or sensor)
