"""Replaying a recording: its vehicles and walkers appear again and go where they went.

An actor that still lives under the recorded id and blueprint is moved; others are spawned. Traffic
lights, weather and sensors are not recorded, so they are not replayed.
"""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any

from skidpad.core.geometry import Pose, wrap_angle
from skidpad.simulation.carla_server import wire
from skidpad.simulation.carla_server.actors import Actor
from skidpad.simulation.carla_server.catalogue import Family
from skidpad.simulation.carla_server.rpc import CallError
from skidpad.simulation.carla_server.spawning import spawn
from skidpad.simulation.carla_server.wire import Vector

if TYPE_CHECKING:
    from skidpad.simulation.carla_server.world import World

FORMAT = 2  # of recordings that can be replayed
PLAYED = (Family.VEHICLE, Family.WALKER)
HERO = "hero"  # role that set_replayer_ignore_hero means
BEHIND, ABOVE = 8.0, 4.0  # m, of the spectator from the actor that it follows


@dataclass(frozen=True, slots=True)
class Recording:
    """What a file holds, by recorded ids; times in s from its first tick."""

    map: str
    times: list[float]
    poses: list[dict[int, Pose]]  # one per tick
    kinds: dict[int, tuple[str, dict[str, str]]]  # blueprint and attributes

    @property
    def total(self) -> float:
        """Its length in s."""
        return self.times[-1]

    def at(self, t: float) -> dict[int, tuple[Pose, Vector]]:
        """Poses and velocities in m/s between the ticks around t."""
        k = min(max(bisect_right(self.times, t) - 1, 0), len(self.times) - 1)
        if k + 1 == len(self.times):  # velocities at the end are those that led there
            k, t = max(k - 1, 0), self.total
        after = self.poses[min(k + 1, len(self.times) - 1)]
        span = self.times[k + 1] - self.times[k] if len(self.times) > 1 else 1.0
        share = min(max((t - self.times[k]) / span, 0.0), 1.0)
        there = after if share == 1.0 else self.poses[k]
        before = self.poses[k]
        return {
            id: _between(before.get(id, p), after.get(id, p), share, span)
            for id, p in there.items()
        }


def _between(a: Pose, b: Pose, share: float, span: float) -> tuple[Pose, Vector]:
    dx, dy, dz = b.x - a.x, b.y - a.y, b.z - a.z
    pose = replace(
        a,
        x=a.x + share * dx,
        y=a.y + share * dy,
        z=a.z + share * dz,
        yaw=a.yaw + share * wrap_angle(b.yaw - a.yaw),
    )
    return pose, (dx / span, dy / span, dz / span)


def recording(name: str, head: dict[str, Any], ticks: list[list[Any]]) -> Recording:
    """What a file's lines say; CallError when it is of another format or broken."""
    if head.get("format") != FORMAT or not ticks:
        raise CallError(f"{name} holds no ticks that can be replayed")
    kinds: dict[int, tuple[str, dict[str, str]]] = {}
    poses = []
    for _, _, places, _, born in ticks:
        for id, blueprint, attributes in born:
            given = {wire.text(k, "attribute"): wire.text(v, k) for k, v in attributes.items()}
            kinds[wire.integer(id, "actor id")] = wire.text(blueprint, "blueprint"), given
        poses.append({id: wire.pose([xyz, turn], "pose") for id, xyz, turn in places})
    start = float(ticks[0][1])
    times = [float(t[1]) - start for t in ticks]
    if any(b <= a for a, b in pairwise(times)):
        raise CallError(f"{name}: times do not grow")
    return Recording(str(head.get("map")), times, poses, kinds)


@dataclass(slots=True)
class Replayer:
    """Moves actors while it replays."""

    time_factor: float = 1.0
    ignore_hero: bool = False
    ignore_spectator: bool = False
    _source: Recording | None = None
    _now: float = 0.0
    _end: float = 0.0
    _follow: int = 0  # recorded id
    _actors: dict[int, int] = field(default_factory=dict)  # actor ids by recorded ids
    _refused: set[int] = field(default_factory=set)

    def start(
        self, world: World, source: Recording, begin: float, duration: float, follow: int
    ) -> tuple[float, float]:
        """Begin; the times in s from and to which it replays. A negative begin counts from the end."""
        self.release(world)
        if source.map != world.map.name:
            world.load(source.map, reset_settings=False)
        begin = max(source.total + begin, 0.0) if begin < 0.0 else min(begin, source.total)
        self._source, self._now, self._follow = source, begin, follow
        self._end = min(begin + duration, source.total) if duration > 0.0 else source.total
        self._place(world)
        return self._now, self._end

    def tick(self, world: World, dt: float) -> None:
        """Move everybody on; at the end physics takes over."""
        if self._source is None:
            return
        self._now = min(self._now + dt * self.time_factor, self._end)
        self._place(world)
        if self._now >= self._end:
            self.release(world)

    def stop(self, world: World, keep_actors: bool) -> None:
        """End now; unless actors are kept, as the recording ends."""
        if self._source is not None and not keep_actors:
            self._now = self._source.total
            self._place(world)
        self.release(world)

    def release(self, world: World) -> None:
        """Give the actors back to physics."""
        for id in self._actors.values():
            _simulate(world, id, True)
        self._source = None
        self._actors, self._refused = {}, set()

    def _place(self, world: World) -> None:
        assert self._source is not None
        places = self._source.at(self._now)
        for recorded in [r for r in self._actors if r not in places]:
            id = self._actors.pop(recorded)
            if id in world.actors.alive:
                world.destroy(id)
        for recorded, (pose, velocity) in places.items():
            actor = self._actor(world, recorded, pose)
            if actor is not None:
                _move(world, actor, pose, velocity)
        followed = self._actors.get(self._follow)
        if followed is not None and not self.ignore_spectator:
            pose = world.pose(world.actors.get(followed))
            world.spectator.pose = pose.moved(forward=-BEHIND, up=ABOVE)

    def _actor(self, world: World, recorded: int, pose: Pose) -> Actor | None:
        """The actor that plays a recorded one; None for those left out."""
        if recorded in self._refused:
            return None
        if recorded not in self._actors:
            found = self._cast(world, recorded, pose)
            if found is None:
                self._refused.add(recorded)
                return None
            self._actors[recorded] = found.id
            _simulate(world, found.id, False)
        return world.actors.alive.get(self._actors[recorded])

    def _cast(self, world: World, id: int, pose: Pose) -> Actor | None:
        """The living actor of that id and blueprint, or a new one."""
        assert self._source is not None
        blueprint, attributes = self._source.kinds.get(id, ("", {}))
        offered = world.catalogue.get(blueprint)
        if offered is None or offered.family not in PLAYED:
            return None
        if self.ignore_hero and attributes.get("role_name") == HERO:
            return None
        living = world.actors.alive.get(id)
        if living is not None and living.blueprint.id == blueprint:
            return living
        given = [[name, 0, value] for name, value in attributes.items()]
        try:
            return spawn(world, [0, blueprint, given], pose)
        except CallError:  # something stands there
            return None


def _simulate(world: World, id: int, on: bool) -> None:
    if id in world.vehicles.slots:
        world.vehicles.of(id).simulated = on
    elif id in world.walkers.members:
        world.walkers.simulated[id] = on


def _move(world: World, actor: Actor, pose: Pose, velocity: Vector) -> None:
    actor.pose, actor.velocity = pose, velocity
    if actor.family is Family.VEHICLE:
        world.vehicles.teleport(actor.id, pose)
        world.vehicles.set_velocity(actor.id, velocity)
