"""The embedded simulator as a backend: the moving world, seen through the ego's sensors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from skidpad.core.errors import BackendError
from skidpad.core.frames import Frame, SensorFrame
from skidpad.core.geometry import Pose
from skidpad.core.inputs import Outside
from skidpad.core.maths.randomness import stream, stream_key
from skidpad.core.setup import ActorCommand, Setup
from skidpad.core.specs import AIR_THERMOMETER, RAIN_SENSOR
from skidpad.core.states import EgoEstimate, VehicleCommand, WorldTruth
from skidpad.core.vocabulary import SensorLevel, Supervision
from skidpad.physics.fleet import shown_gear
from skidpad.physics.grip import road_of
from skidpad.roads.queries import RoadMap
from skidpad.sensors.requested import AskedSensors
from skidpad.simulation.sensing import sensing_of
from skidpad.simulation.world.feel import feel_motion
from skidpad.simulation.world.stage import build_world, patches_of
from skidpad.simulation.world.touch import EGO
from skidpad.simulation.world.world import World

REVERSE = 4  # column of the commands
UNLIT = np.zeros(0, dtype=np.bool_)  # brake lamps where no sensor sees any


class EmbeddedBackend:
    """A world that advances one fixed step at a time (decision L-4).

    poison: spoil the buffers of earlier frames, to find readers that keep them (decision X-11).
    """

    def __init__(self, poison: bool = False) -> None:
        self.poison = poison
        self._world: World | None = None

    @property
    def world(self) -> World:
        """The run's world; BackendError before the first reset."""
        if self._world is None:
            raise BackendError("the embedded simulator was not reset, or was closed")
        return self._world

    @property
    def map(self) -> RoadMap:
        """Returns the map of the run."""
        return self.world.map

    def reset(self, setup: Setup, seed: int) -> Frame:
        """Begin a run: everything is built anew (decision X-12)."""
        self._world, self._noise = build_world(setup, seed), setup.localisation_noise
        self._setup, self._seed = setup, seed
        self._unseen: NDArray[np.bool_] | None = None  # hidden from all sensors; None: none is
        self._brake_lamps: list[tuple[int, bool]] = []
        self._localisation = stream(seed, "ego", "localisation")
        self._outside: Outside | None = None  # as told last
        self.sensing = sensing_of(self.map, self.world.table, setup, seed, self.poison)
        self._asked = self._make_asked() if setup.asked else None
        self._sees_lamps = setup.level is SensorLevel.PIXELS or bool(setup.asked)
        return self._frame()

    def step(self, command: VehicleCommand, actor_commands: Sequence[ActorCommand] = ()) -> Frame:
        """Applies the commands for one step and returns its frame."""
        self.make_step(command, actor_commands)
        return self._frame()

    def make_step(self, command: VehicleCommand, actor_commands: Sequence[ActorCommand]) -> None:
        """Applies the commands for one step and reads no sensors."""
        self.world.command(EGO, command)
        self.world.step(actor_commands)

    def read_frame(self) -> SensorFrame:
        """Returns the frame of the present tick, to which a kernel may have stepped the world."""
        return self._frame()

    @property
    def has_common_frames(self) -> bool:
        """Whether frames hold the common sensors of all actors, the exact pose and the air alone."""
        asks_more = self._asked is not None and not self._asked.is_air_alone
        return self._noise == 0.0 and self._unseen is None and not asks_more

    def read_air(self) -> tuple[int, float]:
        """Returns the stage of the rain sensor and the deg C of the thermometer, 0 where not asked for."""
        asked = {} if self._asked is None else self._asked.read_air()
        return int(asked.get(RAIN_SENSOR, 0)), float(asked.get(AIR_THERMOMETER, 0.0))

    @property
    def steps_alone(self) -> bool:
        """Whether a kernel can make the steps of this world: no patches, wind or roll-over, but traffic."""
        w, grip = self.world, self.world.wheel_grip
        is_looked_at = grip.patches is not None or grip.zones or w.gusts is not None
        return not (is_looked_at or w.conditions.roll_over or w.traffic is None)

    def truth(self) -> WorldTruth:
        """Returns the ground truth of the present tick."""
        w, e = self.world, self.world.events
        return WorldTruth(  # by position, as names take as long as all the rest
            w.tick, w.table, w.states, w.mu, w.commands, w.lights.by_id, e.contacts, e.invasions,
            e.background, e.put_back, e.moved_on, e.rolled, e.notices,
        )  # fmt: skip

    def relocate(self, pose: Pose, v: float) -> None:
        """Put the ego at `pose` with speed v along it; its height follows from the road."""
        self.world.put(EGO, pose, v)
        self.world.settle()

    def change(self, outside: Outside) -> None:
        """All of it is as told from the next step on.

        Drivers of the background keep the caution that they began with.
        """
        weather, range_model = outside.weather, outside.range_model
        mu_ref = self._setup.mu_ref if outside.mu_ref is None else outside.mu_ref
        changed = replace(
            self._setup,
            weather=weather,
            range_model=range_model,
            grip=outside.grip,
            mu_ref=mu_ref,
            patches=self._setup.patches if outside.patches is None else outside.patches,
        )
        road = road_of(changed)
        if changed.patches != self._setup.patches:
            self.world.wheel_grip.lay_patches(patches_of(self.map, changed, road))
        self.world.lay(road)
        if outside.wind is not None:
            self.world.blow(*outside.wind)
        self.world.lights.hold(outside.lights)
        names = self.world.table.names
        self._unseen = None
        if outside.unseen:
            self._unseen = np.array([name in outside.unseen for name in names], dtype=np.bool_)
        self._brake_lamps = [(names.index(name), lit) for name, lit in outside.brake_lamps]
        self.sensing.change(outside)
        self._setup, self._outside = changed, outside
        if self._asked is not None:
            self._last_asked = self._asked  # which the frame of the moment may still read
            self._asked = self._make_asked()

    def branch(self, name: str) -> None:
        """Draws noise and choices of drivers from streams of this name from the next step on."""
        seed = self._seed = stream_key(self._seed, "branch", name)
        self.world.change_streams(seed)
        self._localisation = stream(seed, "ego", "localisation")
        self.sensing = sensing_of(self.map, self.world.table, self._setup, seed, self.poison)
        if self._outside is not None:
            self.sensing.change(self._outside)
        if self._asked is not None:
            self._asked = self._make_asked()

    def _make_asked(self) -> AskedSensors:
        """Returns the additional sensors that the set-up asks for."""
        return AskedSensors(self.map, self.world.table, self._setup, seed=self._seed)

    def close(self) -> None:
        """Drops the world of the run."""
        self._world = None

    def _frame(self) -> SensorFrame:
        """Reads all sensors at the current tick and returns their frame."""
        w, asked = self.world, self._asked
        states = w.states
        if self._unseen is not None:
            states = states._replace(present=states.present & ~self._unseen)
        lights, braking = w.lights.by_id, UNLIT
        if self._sees_lamps:
            braking = w.braking()
            for row, lit in self._brake_lamps:
                braking[row] = lit
        seen = self.sensing.read(w.tick, states, lights, braking)
        extra = {} if asked is None else asked.read(w.tick, states, seen.images, lights, braking)
        return SensorFrame(
            w.tick, self._estimate(), seen.images, seen.segments, seen.radar,
            MappingProxyType(lights), w.events.contacts, w.events.invasions, Supervision.NONE, extra,
            seen.radar_objects, seen.radar_tracks,
        )  # fmt: skip

    def _estimate(self) -> EgoEstimate:
        """Returns the ego's estimated state: true but for Gaussian noise on x and y."""
        w, sigma = self.world, self._noise
        (
            x, y, z, roll, pitch, yaw, speed, yaw_rate, ax, ay, front_left, front_right, rear_left,
            rear_right,
        ) = feel_motion(w.arena, EGO)  # fmt: skip
        pose = Pose(x, y, z, roll, pitch, yaw)
        if sigma > 0.0:
            dx, dy = self._localisation.normal(0.0, sigma, 2).tolist()
            pose = replace(pose, x=pose.x + dx, y=pose.y + dy)
        wheel_speeds = (front_left, front_right, rear_left, rear_right)
        gear = shown_gear(speed, bool(w.commands[EGO, REVERSE]))
        return EgoEstimate(pose, speed, yaw_rate, ax, ay, wheel_speeds, gear)
