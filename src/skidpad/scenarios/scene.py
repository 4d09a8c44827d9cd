"""What conditions and actions see while a scenario is played: time, actors, states of its elements."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from math import hypot, sqrt
from typing import Any, Protocol

from skidpad.core.courses import ActorMode
from skidpad.core.geometry import Pose
from skidpad.core.setup import ActorCommand
from skidpad.core.states import VehicleCommand, WorldTruth
from skidpad.core.vocabulary import LightState
from skidpad.recording.run.lamps import LampChange
from skidpad.recording.run.tilts import Tilted
from skidpad.scenarios.elements import Happening, Move, Path, State
from skidpad.scenarios.movement.measures import Point, between, corners
from skidpad.scenarios.movement.motion import Guide
from skidpad.scenarios.movement.network import Network, Place
from skidpad.scenarios.movement.steering import LaneSteering
from skidpad.scenarios.movement.tracking import Track, track_demand
from skidpad.scenarios.reading.entities import Entity
from skidpad.scenarios.reading.environment import Clock, Environment
from skidpad.simulation.scripted import ActorDriver, Motion

STANDING = 0.05, 1e-3  # m/s, of what drives on tyres, and of what is where the file says
JUST = 1e-9  # s, what has begun to last
PHYSICAL = ActorMode.PHYSICAL  # asked in every step


class Running(Protocol):
    """An action that is under way."""

    def step(self, scene: Scene) -> bool:
        """Goes on for one step; True when it is done."""
        ...


class Done:
    """An action that takes no time."""

    def step(self, scene: Scene) -> bool:
        """Returns True at once: it is over."""
        del scene
        return True


DONE = Done()


class Controlling(Protocol):
    """A controller of an actor: it says an acceleration along the lane, or pedals and steer."""

    @property
    def drives(self) -> bool:
        """Tells whether it gives pedals and steer."""
        ...

    def acceleration(self, scene: Scene, actor: str) -> float:
        """Returns the acceleration that it asks for, m/s^2."""
        ...

    def command(self, scene: Scene, actor: str) -> VehicleCommand:
        """Returns pedals and steer for the coming step."""
        ...


@dataclass
class Actor:
    """One entity while the scenario is played.

    pose: of the reference point that the file means; motion: of the box's centre, which moves
    through the tyres.
    """

    entity: Entity
    row: int
    mode: ActorMode | None  # None: somebody else moves it, the stack under test
    motion: Motion
    guide: Guide
    driver: ActorDriver | None  # None: a body without wheels, always ideal
    pose: Pose
    track: Track | None = None
    longitudinal: Running | None = None  # the newest action of its kind replaces the one before
    lateral: Running | None = None
    leading: Running | None = None  # the action whose track it is led along
    v_after_track: float | None = None  # m/s, once this step has reached the end of the track
    led_since: float = 0.0  # s
    lane_steering: LaneSteering | None = None  # it steers to its lane instead of being put there
    present: bool = True
    seen: bool = False  # in a tick before
    handed: bool = True  # somebody else's controller is active, where mode is None
    word: ActorCommand | None = None  # appear or vanish, said once
    goes_on: bool = False  # put somewhere in this step, in which it moves on already
    visible: bool = True  # to sensors
    assigned: Any = None  # a `registry.ControllerOf` that an action has given it
    towed_by: Actor | None = None  # the vehicle whose hitch draws it
    controller: Controlling | None = None  # active, of an actor other than the ego
    controls: tuple[bool, bool] = (False, False)  # the controller's domains: lateral, longitudinal
    piloted: VehicleCommand | None = None  # pedals and steer by its controller, in this step
    worked: dict[str, Any] = field(default_factory=dict)  # inputs that the file works, by name
    a: float = 0.0  # m/s^2 of the speed
    acceleration: Point = (0.0, 0.0)  # m/s^2 in the world
    travelled: float = 0.0  # m
    stood: float = 0.0  # s
    off_since: float | None = None  # s, when it left the road, if somebody asks
    out_since: float | None = None  # s, when it passed the end of a road, likewise
    at_end: float = 0.0  # s at the end of a road

    @property
    def name(self) -> str:
        """Returns the name of the actor's entity."""
        return self.entity.name

    @property
    def v(self) -> float:
        """Returns the speed over ground in m/s, never negative."""
        return hypot(self.motion.vx, self.motion.vy)

    @property
    def v_signed(self) -> float:
        """Returns the speed over ground in m/s, negative backwards."""
        return self.v if self.motion.speed >= 0.0 else -self.v

    @property
    def driven_by_file(self) -> bool:
        """Returns whether the scenario decides where the actor goes."""
        return self.mode is not None or not self.handed

    @property
    def placed_by_file(self) -> bool:
        """Tells whether it is moved exactly as the scenario says, without physics."""
        moved = self.driver is None or self.mode is not PHYSICAL
        return self.driven_by_file and self.piloted is None and moved

    @property
    def v_told(self) -> float:
        """Returns the speed that the file asks of it, m/s, negative backwards; else its own.

        Its own counts where the file does not drive it.
        """
        return self.guide.v if self.driven_by_file else self.motion.speed

    def let_go(self, action: Running, network: Network) -> None:
        """Ends an action of it that has been stopped: what it did has no more rate, a lane is followed again.

        Any other action is ignored.
        """
        if action is self.longitudinal:
            self.longitudinal, self.guide.a = None, 0.0
        if action is self.lateral:
            self.lateral = None
            self.guide.offset_rate = self.guide.offset_bend = 0.0
        if action is self.leading:
            self.leave_track(network)

    def leave_track(self, network: Network) -> None:
        """Ends that the actor is led along a trajectory."""
        if self.track is not None:
            self.follow_road(network, self.guide.v)

    def lead(self, action: Running, track: Track, t: float) -> None:
        """Lets an action lead it along a track; what moved it aside is over, with times its speed action too.

        t: s, since when.
        """
        self.v_after_track = None
        self.leading, self.track, self.led_since, self.lateral = action, track, t, None
        self.lane_steering = None
        if track.timed:
            self.longitudinal = None

    def pace_by(self, action: Running, scene: Scene) -> None:
        """Lets an action decide its speed; it ends a track with times that began in an earlier step."""
        self.longitudinal = action
        if self.track is not None and self.track.timed and self.led_since < scene.t:
            self.leave_track(scene.network)

    def leap(self, way: float) -> None:
        """Puts it `way` m further along its lane or trajectory at the end of this step, at its own speed."""
        if self.track is not None:
            self.track.skip(way)
        else:
            self.guide.leap += way

    def place(self, network: Network) -> Place:
        """Returns where it is, with its lane: the one that it keeps to, else the one under it."""
        guide = self.guide
        if self.driven_by_file and self.track is None and guide.base is not None:
            return guide.place(self.pose)
        return network.place_of(self.pose)

    def catch_up(self, network: Network) -> None:
        """Brings the lane's point abreast of an actor that was not moved along it."""
        if not self.driven_by_file:
            self.guide.base = self.place(network).lane
        elif self.mode is not ActorMode.IDEAL and self.driver is not None:
            self.guide.advance(self.motion)

    def nearness(self, other: Actor) -> float:
        """Returns the distance of reference points, m, beyond which two bodies do not touch."""
        return self.entity.box.length + other.entity.box.length + 2.0

    def outline(self) -> list[Point]:
        """Returns the corners of the body on the ground."""
        return corners(self.pose, self.entity.box)

    def centre(self, pose: Pose) -> Pose:
        """Returns where the box's centre is when the reference point is at `pose`."""
        return pose.moved(forward=self.entity.box.forward, left=self.entity.box.left)

    def command(self, t: float, dt: float) -> ActorCommand | None:
        """Returns the command to the backend for the step from t to t + dt s, and moves on in it.

        None where it is not there or the file does not move it. A word to appear or vanish comes once.
        """
        if self.word is not None:
            word, self.word = self.word, None
            if word.place is not None and self.placed_by_file:
                word = replace(word, speed=self.guide.v)  # which this step may have set since
            if self.goes_on and self.placed_by_file:
                word = replace(self._place_command(t + dt, dt), present=True)
            self.goes_on = False
            return word
        if not self.present or not self.driven_by_file:
            return None
        if self.driver is None or (self.mode is not PHYSICAL and self.piloted is None):
            return self._place_command(t + dt, dt)
        if self.track is not None:
            demand = track_demand(self.track, self.motion, t, dt, self.centre)
            command = self.driver.command(self.motion, demand)
        else:
            command = self.guide.command(self.motion, self.driver)
        return ActorCommand(self.name, None, None, self.overridden(command))

    def overridden(self, command: VehicleCommand) -> VehicleCommand:
        """Returns what a driver does, with the inputs that the file works itself."""
        return replace(command, **self.worked) if self.worked else command

    def _place_command(self, t: float, dt: float) -> ActorCommand:
        """Returns the command that places the actor where it is at t s, and sets its pose to that.

        dt: s of the step, for an actor on its lane.
        """
        if self.track is not None:
            pose, v, _ = self.track.at(t)
            v = v if self.track.timed or self.track.steered else self.guide.v
        else:
            pose, v = self._pose_on_road(dt), self.guide.v_now
        self.pose = pose
        return ActorCommand(self.name, place=self.centre(pose), speed=v)

    def _pose_on_road(self, dt: float) -> Pose:
        """Moves on by dt s along the lane and returns the pose there, where it is put or steers to."""
        steering = self.lane_steering
        if steering is None:
            return self.guide.ideal(dt)
        pose = steering.step(self.guide, self.pose, dt)
        if steering.settled and self.lateral is None:
            self.lane_steering = None
        return pose

    def put(self, network: Network, place: Place, v: float) -> None:
        """Puts it somewhere else, and into the world, from now on; it keeps its roads and no track."""
        self.lane_steering = None
        roads = self.guide.roads
        self.guide = Guide(network, place, v)
        self.guide.roads = roads
        self.track = None
        self.present = True
        self.pose = place.pose
        self.word = ActorCommand(self.name, place=self.centre(place.pose), speed=v, present=True)

    def follow_road(self, network: Network, v: float) -> None:
        """Makes it drive from here along the lane at speed v: the default controller; ends its track."""
        roads = self.guide.roads
        self.guide = Guide(network, network.place_of(self.pose), v)
        self.guide.roads = roads
        self.track = None

    def observe(self, motion: Motion, z: float, dt: float) -> None:
        """Takes over a tick's motion of the box's centre; nothing has lasted in the first one.

        z: of the ground, m, for an actor that the file does not place. dt: s since the tick before.
        """
        placed, before, self.motion = self.placed_by_file, self.motion, motion
        vx, vy, old_vx, old_vy = motion.vx, motion.vy, before.vx, before.vy
        # as kernels do it, to the bit
        v, now = sqrt(old_vx * old_vx + old_vy * old_vy), sqrt(vx * vx + vy * vy)
        box = self.entity.box
        if placed:
            was = self.pose
            at = Pose(motion.x, motion.y, was.z, was.roll, was.pitch, motion.yaw)
        else:
            at = Pose(motion.x, motion.y, z, 0.0, 0.0, motion.yaw)
        if box.forward or box.left:
            at = at.moved(forward=-box.forward, left=-box.left)
        self.pose = at
        if self.seen and dt > 0.0:
            self.a, self.acceleration = (now - v) / dt, ((vx - old_vx) / dt, (vy - old_vy) / dt)
        else:
            self.a, self.acceleration, dt, self.seen = 0.0, (0.0, 0.0), 0.0, True
        self.travelled += now * dt
        self.stood = self.stood + dt if max(v, now) < STANDING[placed] else 0.0
        if self.guide.at_end:
            self.at_end = self.at_end + dt if self.at_end else JUST
        else:
            self.at_end = 0.0


class Flow(Protocol):
    """Traffic that comes or goes until somebody stops it."""

    name: str
    stopped: bool


@dataclass
class Scene:
    """The moment: truth of the world and of the storyboard."""

    network: Network
    dt: float
    actors: Mapping[str, Actor]
    parameters: dict[str, str] = field(default_factory=dict)
    variables: dict[str, str] = field(default_factory=dict)
    signals: dict[str, str] = field(default_factory=dict)  # states that the file has set
    lights: Mapping[int, LightState] = field(default_factory=dict)  # of the road, by signal id
    t: float = 0.0
    truth: WorldTruth | None = None  # of this tick, for sensors of actors
    states: dict[Path, State] = field(default_factory=dict)
    moves: list[tuple[Path, Move]] = field(default_factory=list)  # all, in their order
    contacts: set[str] = field(default_factory=set)  # names that touch the ego in this tick
    ego: str = ""
    notices: list[str] = field(default_factory=list)  # what could not be done, for the log
    environments: list[Environment] = field(default_factory=list)  # of events, in their order
    clock: Clock | None = None  # time of day, where the file has said one
    story: list[Happening] = field(default_factory=list)
    lamps: list[LampChange] = field(default_factory=list)  # that the file switches, in their order
    tilts: list[Tilted] = field(default_factory=list)  # by trajectories, up to now
    seed: int = 0  # of what is drawn
    flows: list[Flow] = field(default_factory=list)  # of traffic actions
    cruising: dict[str, float] = field(default_factory=dict)  # m/s that traffic's vehicles want

    def moved(self, path: Path, move: Move) -> None:
        """Notes that an element of the storyboard goes through a transition."""
        self.moves.append((path, move))
        self.story.append(Happening(self.t, path, move.value))

    def observe(self, truth: WorldTruth) -> None:
        """Takes over time, lights, contacts and each actor's motion of a tick."""
        self.t, self.lights, self.truth = truth.tick * self.dt, truth.lights, truth
        s = truth.states
        x, y, z, yaw = s.x.tolist(), s.y.tolist(), s.z.tolist(), s.yaw.tolist()
        vx, vy = s.vx.tolist(), s.vy.tolist()
        dt = self.dt
        for actor in self.actors.values():
            i = actor.row
            actor.observe(Motion(x[i], y[i], yaw[i], vx[i], vy[i]), z[i], dt)
            pose = actor.pose
            if pose.pitch or pose.roll:
                self.tilts.append(Tilted(self.t, actor.name, pose.pitch, pose.roll))
        contacts, names = truth.contacts, truth.table.names
        self.contacts = {c.static or names[c.actor] for c in contacts} if contacts else set()

    def between(self, a: str, b: str) -> Point:
        """Returns where b lies as seen from a: m forward, m left."""
        to = self.actors[b].pose
        return between(self.actors[a].pose, to.x, to.y)

    def tell_time(self, environment: Environment) -> None:
        """Sets the clock, where an environment says a time of day."""
        if environment.moment is not None:
            self.clock = Clock(environment.moment, self.t, environment.clock_runs)

    def notice(self, text: str) -> None:
        """Adds once to the notices what could not be done."""
        if text not in self.notices:
            self.notices.append(text)
