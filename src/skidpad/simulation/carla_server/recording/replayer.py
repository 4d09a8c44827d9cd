"""Replaying a recording: its vehicles and walkers appear again and go where they went.

An actor that still lives under the recorded id and blueprint is moved; others are spawned. Traffic
lights, weather and sensors are not recorded, so they are not replayed.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Container
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any

from skidpad.core.geometry import Pose, wrap_angle
from skidpad.simulation.carla_server.actors.catalogue import Family
from skidpad.simulation.carla_server.actors.registry import Actor
from skidpad.simulation.carla_server.episode import Episode, Wanted
from skidpad.simulation.carla_server.protocol import wire
from skidpad.simulation.carla_server.protocol.rpc import CallError
from skidpad.simulation.carla_server.protocol.wire import Vector

FORMAT = 2  # of recordings that can be replayed
PLAYED = (Family.VEHICLE, Family.WALKER)
HERO = "hero"  # role that set_replayer_ignore_hero means
BEHIND, ABOVE = 8.0, 4.0  # m, of the spectator from the actor that it follows


@dataclass(frozen=True, slots=True)
class CarlaRecording:
    """What a file holds, by recorded ids; times in s from its first tick."""

    map: str
    times: list[float]
    poses: list[dict[int, Pose]]  # one per tick
    kinds: dict[int, tuple[str, dict[str, str]]]  # blueprint and attributes

    @property
    def total(self) -> float:
        """Returns the length of the recording in s."""
        return self.times[-1]

    def at(self, t: float) -> dict[int, tuple[Pose, Vector]]:
        """Returns poses and velocities in m/s by recorded id, interpolated at t in s."""
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
    """Returns the pose at the share 0..1 from a to b, and the velocity in m/s over the span in s."""
    dx, dy, dz = b.x - a.x, b.y - a.y, b.z - a.z
    pose = replace(
        a,
        x=a.x + share * dx,
        y=a.y + share * dy,
        z=a.z + share * dz,
        yaw=a.yaw + share * wrap_angle(b.yaw - a.yaw),
    )
    return pose, (dx / span, dy / span, dz / span)


def recording(name: str, head: dict[str, Any], ticks: list[list[Any]]) -> CarlaRecording:
    """Returns what a file's lines say; CallError when it is of another format or its times do not grow.

    Other errors, WireError and LookupError among them, for broken lines.
    """
    if head.get("format") != FORMAT or not ticks:
        raise CallError(f"{name} holds no ticks that can be replayed")
    kinds: dict[int, tuple[str, dict[str, str]]] = {}
    poses = []
    for _, _, places, _, born, *_ in ticks:
        for id, blueprint, attributes in born:
            given = {wire.text(k, "attribute"): wire.text(v, k) for k, v in attributes.items()}
            kinds[wire.integer(id, "actor id")] = wire.text(blueprint, "blueprint"), given
        poses.append({id: wire.pose([xyz, turn], "pose") for id, xyz, turn in places})
    start = float(ticks[0][1])
    times = [float(t[1]) - start for t in ticks]
    if any(b <= a for a, b in pairwise(times)):
        raise CallError(f"{name}: times do not grow")
    return CarlaRecording(str(head.get("map")), times, poses, kinds)


class Replayer:
    """Moves actors while it replays."""

    def __init__(self) -> None:
        self.time_factor = 1.0
        self.ignore_hero = False
        self.ignore_spectator = False
        self._run: _Run | None = None

    def start(
        self, episode: Episode, source: CarlaRecording, begin: float, duration: float, follow: int
    ) -> tuple[float, float]:
        """Starts a replay, ending another, and returns the times in s from and to which it goes.

        begin: s, a negative one counts from the end; duration: s, 0 or less: to the end.
        episode: on the recording's map. follow: recorded id of the actor that the spectator follows.
        """
        self.release()
        begin = max(source.total + begin, 0.0) if begin < 0.0 else min(begin, source.total)
        end = min(begin + duration, source.total) if duration > 0.0 else source.total
        self._run = _Run(episode, source, begin, end, follow)
        self._place(self._run)
        return begin, end

    def tick(self, dt: float) -> None:
        """Moves the replay on by dt s times the factor.

        At its end physics takes over. Nothing without one.
        """
        run = self._run
        if run is None:
            return
        run.now = min(run.now + dt * self.time_factor, run.end)
        self._place(run)
        if run.now >= run.end:
            self.release()

    def stop(self, keep_actors: bool) -> None:
        """Ends the replay now; unless actors are kept, they are set as at the recording's end."""
        if self._run is not None and not keep_actors:
            self._run.now = self._run.source.total
            self._place(self._run)
        self.release()

    def release(self) -> None:
        """Ends the replay, if one runs, and hands its actors back to physics."""
        if self._run is not None:
            self._run.free()
        self._run = None

    def _place(self, run: _Run) -> None:
        """Sets every recorded actor at its pose of the moment, removes the others and moves the spectator."""
        places = run.source.at(run.now)
        run.drop(keep=places.keys())
        for recorded, (pose, velocity) in places.items():
            actor = run.actor(recorded, pose, self.ignore_hero)
            if actor is not None:
                _move(run.episode, actor, pose, velocity)
        if not self.ignore_spectator:
            run.watch()


@dataclass(slots=True)
class _Run:
    """One replay on one episode."""

    episode: Episode
    source: CarlaRecording
    now: float  # s
    end: float
    follow: int
    actors: dict[int, int] = field(default_factory=dict)  # actor ids by recorded ids
    refused: set[int] = field(default_factory=set)

    def drop(self, keep: Container[int]) -> None:
        """Destroys the replay's actors that are no longer in the recording."""
        for recorded in [r for r in self.actors if r not in keep]:
            id = self.actors.pop(recorded)
            if id in self.episode.actors.alive:
                self.episode.destroy(id)

    def free(self) -> None:
        """Hands the actors of the recording back to physics."""
        for id in self.actors.values():
            actor = self.episode.actors.alive.get(id)
            if actor is not None:
                self.episode.simulate(actor, True)

    def watch(self) -> None:
        """Puts the spectator behind the actor that it follows, if that lives."""
        actors = self.episode.actors
        followed = actors.alive.get(self.actors.get(self.follow, 0))
        if followed is not None:
            self.episode.spectator.pose = actors.pose(followed).moved(forward=-BEHIND, up=ABOVE)

    def actor(self, recorded: int, pose: Pose, ignore_hero: bool) -> Actor | None:
        """Returns the actor that plays a recorded one, found or spawned at first; None for those left out."""
        if recorded in self.refused:
            return None
        if recorded not in self.actors:
            found = self._cast(recorded, pose, ignore_hero)
            if found is None:
                self.refused.add(recorded)
                return None
            self.actors[recorded] = found.id
            self.episode.simulate(found, False)
        return self.episode.actors.alive.get(self.actors[recorded])

    def _cast(self, id: int, pose: Pose, ignore_hero: bool) -> Actor | None:
        """Returns the living actor of that id and blueprint, or a new one; None where neither is possible."""
        blueprint, attributes = self.source.kinds.get(id, ("", {}))
        offered = self.episode.stock.catalogue.get(blueprint)
        if offered is None or offered.family not in PLAYED:
            return None
        if ignore_hero and attributes.get("role_name") == HERO:
            return None
        living = self.episode.actors.alive.get(id)
        if living is not None and living.blueprint.id == blueprint:
            return living
        try:
            return self.episode.spawn(Wanted(blueprint, attributes), pose)
        except CallError:  # something stands there
            return None


def _move(episode: Episode, actor: Actor, pose: Pose, velocity: Vector) -> None:
    """Sets pose and velocity in m/s of an actor; the velocity only of vehicles and bodies."""
    episode.place(actor, pose)
    if actor.id in episode.vehicles:
        episode.vehicles.set_velocity(actor.id, velocity)
    elif actor.body is not None:
        episode.moving.set_velocity(actor.body, velocity[0], velocity[1])
