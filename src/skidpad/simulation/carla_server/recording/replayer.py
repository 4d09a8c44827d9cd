"""Replaying a recording: its vehicles, walkers and props appear again and go where they went.

An actor that still lives under the recorded id and blueprint is moved; others are spawned. Traffic
lights that stand where recorded ones stood, vehicles' controls and lamps, and the weather follow the
recording; sensors do not. What CARLA does: public source, CarlaReplayer.cpp and CarlaReplayerHelper.cpp.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Container, Iterable
from dataclasses import dataclass, field, replace
from itertools import pairwise
from math import dist
from typing import Any

import numpy as np

from skidpad.core.geometry import Pose, wrap_angle
from skidpad.core.vocabulary import LightState
from skidpad.simulation.carla_server.actors.catalogue import Family
from skidpad.simulation.carla_server.actors.registry import Actor
from skidpad.simulation.carla_server.episode import Episode, Wanted
from skidpad.simulation.carla_server.protocol import wire
from skidpad.simulation.carla_server.protocol.rpc import CallError
from skidpad.simulation.carla_server.protocol.wire import Vector
from skidpad.simulation.carla_server.recording.frames import CM, HERO
from skidpad.simulation.carla_server.recording.packets import (
    Added,
    Kind,
    LogFrame,
    LogHead,
    Packet,
)
from skidpad.simulation.carla_server.vehicles.control import Control
from skidpad.simulation.world.interventions import set_velocity
from skidpad.simulation.world.lights import Light

PLAYED = (Family.VEHICLE, Family.WALKER, Family.PROP)
SAME_PLACE = 1.0  # cm between a recorded traffic light and the one that plays it
BEHIND, ABOVE = 8.0, 4.0  # m, of the spectator from the actor that it follows


@dataclass(frozen=True, slots=True)
class CarlaRecording:
    """What a file holds, by recorded ids; times in s from its first frame."""

    map: str
    times: list[float]
    frames: list[LogFrame]
    weathers: list[list[float] | None]  # at each frame; None before the first
    kinds: dict[int, Added]

    @property
    def total(self) -> float:
        """Returns the length of the recording in s."""
        return self.times[-1]

    def index(self, t: float) -> int:
        """Returns the index of the frame that is shown at t in s."""
        return min(max(bisect_right(self.times, t) - 1, 0), len(self.times) - 1)

    def at(self, t: float) -> dict[int, tuple[Pose, Vector]]:
        """Returns poses and velocities in m/s by recorded id, interpolated at t in s."""
        k = self.index(t)
        if k + 1 == len(self.times):  # velocities at the end are those that led there
            k, t = max(k - 1, 0), self.total
        before, after = self._poses(k), self._poses(min(k + 1, len(self.times) - 1))
        span = self.times[k + 1] - self.times[k] if len(self.times) > 1 else 1.0
        share = min(max((t - self.times[k]) / span, 0.0), 1.0)
        there = after if share == 1.0 else before
        return {
            id: _between(before.get(id, p), after.get(id, p), share, span)
            for id, p in there.items()
        }

    def _poses(self, k: int) -> dict[int, Pose]:
        """Returns the poses of frame k by recorded id."""
        return {
            id: wire.pose([[v / CM for v in place], [pitch, yaw, roll]], "pose")
            for id, place, (roll, pitch, yaw) in self.frames[k].rows(Packet.POSITION)
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


def recording(name: str, head: LogHead, frames: Iterable[LogFrame]) -> CarlaRecording:
    """Returns what can be replayed of a file; CallError for times that do not grow or absurd numbers."""
    read = list(frames)
    if not read:
        raise CallError(f"{name} holds no frames that can be replayed")
    for frame in read:
        _require_sensible(name, frame)
    times = [frame.elapsed - read[0].elapsed for frame in read]
    if not all(b > a for a, b in pairwise(times)):
        raise CallError(f"{name} cannot be replayed: its times do not grow")
    kinds = {actor.id: actor for frame in read for actor in frame.added}
    return CarlaRecording(head.map, times, read, _weathers(read), kinds)


def _weathers(frames: list[LogFrame]) -> list[list[float] | None]:
    """Returns the weather at each frame."""
    found: list[list[float] | None] = []
    for frame in frames:
        rows = frame.rows(Packet.WEATHER)
        found.append(list(rows[-1][0]) if rows else found[-1] if found else None)
    return found


def _require_sensible(name: str, frame: LogFrame) -> None:
    """Raises CallError for a number of a frame that is not finite, or too large for any place or time."""
    numbers: list[tuple[str, Any]] = [("its time", frame.elapsed)]
    for packet in (Packet.POSITION, Packet.WEATHER, Packet.VEHICLE, Packet.TRAFFIC_LIGHT):
        records = frame.records.get(packet)
        if records is not None:
            names = records.dtype.names or ()
            numbers += [(f"{packet.name} {each}", records[each]) for each in names]
    for what, values in numbers:
        wrong = np.ravel(values)[~(np.abs(np.ravel(values)) < wire.FLOAT_MAX)]
        if wrong.size:
            raise CallError(
                f"{name} cannot be replayed: in frame {frame.number} {what} is {wrong[0]:g}; "
                f"allowed is -{wire.FLOAT_MAX:g} to {wire.FLOAT_MAX:g}"
            )


class Replayer:
    """Moves actors while it replays."""

    def __init__(self) -> None:
        self.time_factor = 1.0
        self.ignore_hero = False
        self.ignore_spectator = True
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
        lights = _match_lights(episode, source)
        run = _Run(episode, source, begin, end, follow, lights)
        self._place(run)
        self._run = run
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
        """Sets everything as recorded at this moment, removes actors that are gone, moves the spectator."""
        places = run.source.at(run.now)
        run.drop(keep=places.keys())
        for recorded, (pose, velocity) in places.items():
            actor = run.actor(recorded, pose, self.ignore_hero)
            if actor is not None:
                _move(run.episode, actor, pose, velocity)
            elif not self.ignore_spectator and run.is_spectator(recorded):
                run.episode.spectator.pose = pose
        run.show()
        run.watch()


@dataclass(slots=True)
class _Run:
    """One replay on one episode."""

    episode: Episode
    source: CarlaRecording
    now: float  # s
    end: float
    follow: int
    lights: dict[int, Light]  # by recorded ids
    actors: dict[int, int] = field(default_factory=dict)  # actor ids by recorded ids
    refused: set[int] = field(default_factory=set)
    weather: list[float] | None = None  # as last set
    frozen: dict[int, bool] = field(init=False)  # by groups of lights, before the replay

    def __post_init__(self) -> None:
        groups = self.episode.moving.lights.groups
        self.frozen = {light.group: groups[light.group].frozen for light in self.lights.values()}

    def is_spectator(self, recorded: int) -> bool:
        """Returns whether a recorded actor is the free camera."""
        actor = self.source.kinds.get(recorded)
        return actor is not None and actor.blueprint == Family.SPECTATOR.value

    def show(self) -> None:
        """Sets traffic lights, controls, lamps and weather as recorded."""
        k = self.source.index(self.now)
        frame, episode = self.source.frames[k], self.episode
        episode.moving.lights.restore(
            (self.lights[id], LightState(state), elapsed, frozen)
            for id, frozen, elapsed, state in frame.rows(Packet.TRAFFIC_LIGHT)
            if id in self.lights and 0 <= state < len(LightState)
        )
        vehicles = episode.vehicles
        for id, *told in frame.rows(Packet.VEHICLE):
            if self.actors.get(id, 0) in vehicles:
                vehicles.of(self.actors[id]).control = _control(*told)
        for id, flags in frame.rows(Packet.VEHICLE_LIGHT):
            if self.actors.get(id, 0) in vehicles:
                vehicles.of(self.actors[id]).lights = flags
        weather = self.source.weathers[k]
        if weather is not None and weather is not self.weather:
            episode.sky.apply(weather)
            self.weather = weather

    def drop(self, keep: Container[int]) -> None:
        """Destroys the replay's actors that are no longer in the recording."""
        for recorded in [r for r in self.actors if r not in keep]:
            id = self.actors.pop(recorded)
            if id in self.episode.actors.alive:
                self.episode.destroy(id)

    def free(self) -> None:
        """Hands actors back to physics, vehicles without a control; groups of lights are frozen as before."""
        for group, frozen in self.frozen.items():
            self.episode.moving.lights.groups[group].frozen = frozen
        for id in self.actors.values():
            actor = self.episode.actors.alive.get(id)
            if actor is not None:
                self.episode.simulate(actor, True)
            if id in self.episode.vehicles:
                self.episode.vehicles.of(id).control = Control()

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
        recorded = self.source.kinds.get(id)
        if recorded is None:
            return None
        blueprint, attributes = recorded.blueprint, recorded.attribute_values()
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
        except (CallError, wire.WireError):  # something stands there, or foreign attributes
            return None


def _move(episode: Episode, actor: Actor, pose: Pose, velocity: Vector) -> None:
    """Sets pose and velocity in m/s of an actor; the velocity only of vehicles and bodies."""
    episode.place(actor, pose)
    if actor.id in episode.vehicles:
        episode.vehicles.set_velocity(actor.id, velocity)
    elif actor.body is not None:
        set_velocity(episode.moving, actor.body, velocity[0], velocity[1])


def _control(steer: float, throttle: float, brake: float, hand_brake: bool, gear: int) -> Control:
    """Returns the control of a recorded vehicle, clamped to its ranges."""
    return Control(
        throttle=min(max(throttle, 0.0), 1.0),
        steer=wire.iso_steer(min(max(steer, -1.0), 1.0)),
        brake=min(max(brake, 0.0), 1.0),
        hand_brake=hand_brake,
        reverse=gear < 0,
        gear=gear,
    )


def _match_lights(episode: Episode, source: CarlaRecording) -> dict[int, Light]:
    """Returns the episode's traffic lights by the ids of recorded ones that stood at the same place."""
    places = []
    for actor, post in episode.posts:
        place, _ = wire.transform(episode.actors.alive[actor].pose)
        places.append(([CM * v for v in place], post.light))
    found = {}
    for recorded in source.kinds.values():
        if recorded.kind == Kind.TRAFFIC_LIGHT:
            near = [light for place, light in places if dist(place, recorded.place) < SAME_PLACE]
            if near:
                found[recorded.id] = near[0]
    return found
