"""What CARLA's `show_recorder_...` calls print of a recording, in CARLA's own words.

Programs parse these texts: ScenarioRunner's metrics take the map from the second line, frames from
`Frame N at T seconds`, places in cm. Wording and order: CARLA's public source, CarlaRecorderQuery.cpp
(0.9.16). A recording of ours has actors, poses, contacts and vehicles' controls; what CARLA records
besides (lights, weather, animations of walkers, physics) is not in it and not printed.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import dist
from typing import Any

from skidpad.simulation.carla_server.recording.replayer import HERO

Head = dict[str, Any]
Tick = list[Any]  # frame, s of the episode, poses, contacts, new actors, controls
CM = 100.0  # per metre
VERSION = 1
NO_ACTOR = 2**32 - 1  # the other side of a contact with the scenery
KINDS = (("vehicle.", 1, "v"), ("walker.", 2, "w"), ("traffic.traffic_light", 3, "t"))
ANY, OTHER, OF_HERO = "a", "o", "h"


def describe_recording(head: Head, ticks: list[Tick], start: float, show_all: bool) -> str:
    """Returns the text of `show_recorder_file_info`. start: s of the episode at the recording's begin."""
    lines, known = _head_lines(head), dict[int, dict[str, Any]]()
    for number, tick in enumerate(ticks, start=1):
        events = list(_event_lines(tick, known))
        state = list(_state_lines(tick)) if show_all else []
        if events or show_all:
            lines += [f"Frame {number} at {tick[1] - start:g} seconds", *events, *state]
    return "\n".join(lines) + "\n" + _tail(ticks, start)


def list_collisions(head: Head, ticks: list[Tick], start: float, first: str, second: str) -> str:
    """Returns the text of `show_recorder_collisions`: each contact when it begins.

    first, second: kinds of the two sides: o other, v vehicle, w walker, t traffic light, h hero, a any.
    """
    lines = [*_head_lines(head), _row("Time", "Types", "Id", "Actor 1", "Id", "Actor 2")]
    born: dict[int, tuple[str, dict[str, str]]] = {}
    before: set[tuple[int, int]] = set()
    for tick in ticks:
        born |= {id: (blueprint, attributes) for id, blueprint, attributes in tick[4]}
        now = set()
        for a, b in tick[3]:
            if not (_is_of(a, first, born) and _is_of(b, second, born)):
                continue
            now.add((a, b))
            if (a, b) not in before:
                names = [born[id][0] if id in born else "" for id in (a, b)]
                types = f"{_kind(a, born)[1]} {_kind(b, born)[1]}"
                ids = [str(NO_ACTOR if id == 0 else id) for id in (a, b)]
                time = f"{tick[1] - start:.0f}"
                lines.append(_row(time, types, ids[0], names[0], ids[1], names[1]))
        before = now
    return "\n".join(lines) + "\n" + _tail(ticks, start)


def list_blocked(head: Head, ticks: list[Tick], start: float, seconds: float, cm: float) -> str:
    """Returns the text of `show_recorder_actors_blocked`: actors that stood for so long, longest first.

    seconds: shortest time worth telling; cm: an actor that moves less from its place stands.
    """
    names: dict[int, str] = {}
    places: dict[int, tuple[tuple[float, ...], float]] = {}  # where it last moved to, and when
    found: list[tuple[float, float, int]] = []
    for tick in ticks:
        names |= {id: blueprint for id, blueprint, _ in tick[4]}
        t = tick[1] - start
        for id, xyz, _ in tick[2]:
            place, since = places.setdefault(id, (tuple(xyz), t))
            if dist(place, xyz) * CM >= cm:
                found += [(t - since, since, id)] if t - since >= seconds else []
                places[id] = tuple(xyz), t
    end = ticks[-1][1] - start if ticks else 0.0
    found += [(end - s, s, id) for id, (_, s) in places.items() if end - s >= seconds]
    lines = [*_head_lines(head), f"{'Time':>8} {'Id':>6} {'Actor':<35} {'Duration':>10}"]
    for duration, since, id in sorted(found, key=lambda row: -row[0]):
        lines.append(f"{since:8.0f} {id:6} {names.get(id, ''):<35} {duration:10.0f}")
    return "\n".join(lines) + "\n" + _tail(ticks, start)


def _head_lines(head: Head) -> list[str]:
    """Returns the lines with version, map and date of a recording, and an empty one."""
    date = str(head.get("date", "unknown"))
    return [f"Version: {VERSION}", f"Map: {head.get('map')!s:.80}", f"Date: {date:.40}", ""]


def _tail(ticks: list[Tick], start: float) -> str:
    """Returns the last lines: the number of frames and the duration in s since `start`."""
    duration = ticks[-1][1] - start if ticks else 0.0
    return f"\nFrames: {len(ticks)}\nDuration: {duration:g} seconds\n"


def _event_lines(tick: Tick, known: dict[int, dict[str, Any]]) -> Iterator[str]:
    """Yields lines of actors that come and go, and of contacts.

    known: attributes by id of the actors that are there, kept up to date here.
    """
    there = {id: xyz for id, xyz, _ in tick[2]}
    for id, blueprint, attributes in tick[4]:
        known[id] = attributes
        kind = next((n for start, n, _ in KINDS if blueprint.startswith(start)), 0)
        yield f" Create {id}: {blueprint} ({kind}) at ({_vector(there.get(id, (0, 0, 0)), CM)})"
        yield from (f"  {name} = {value}" for name, value in attributes.items())
    for id in [id for id in known if id not in there]:
        del known[id]
        yield f" Destroy {id}"
    for number, (a, b) in enumerate(tick[3]):
        sides = [f"{NO_ACTOR if id == 0 else id}{_hero_mark(known.get(id))}" for id in (a, b)]
        yield f" Collision id {number} between {sides[0]} with {sides[1]}"


def _hero_mark(attributes: dict[str, Any] | None) -> str:
    """Returns " (hero) " for attributes with the hero's role name, else empty text."""
    return " (hero) " if attributes and attributes.get("role_name") == HERO else ""


def _state_lines(tick: Tick) -> Iterator[str]:
    """Yields the lines of a tick's positions in cm, rotations in deg and vehicle controls."""
    yield f" Positions: {len(tick[2])}"
    for id, xyz, (pitch, yaw, roll) in tick[2]:
        yield f"  Id: {id} Location: ({_vector(xyz, CM)}) Rotation ({_vector((roll, pitch, yaw))})"
    controls = tick[5] if len(tick) > 5 else []
    yield f" Vehicle animations: {len(controls)}"
    for id, steer, throttle, brake, handbrake, gear in controls:
        yield (
            f"  Id: {id} Steering: {steer:g} Throttle: {throttle:g} Brake {brake:g} "
            f"Handbrake: {int(handbrake)} Gear: {gear}"
        )


def _vector(values: Any, scale: float = 1.0) -> str:
    """Returns the scaled numbers as text, joined by commas."""
    return ", ".join(f"{scale * v:g}" for v in values)


def _kind(id: int, born: dict[int, tuple[str, dict[str, str]]]) -> tuple[int, str]:
    """Returns CARLA's number and letter for the kind of an actor; (0, OTHER) for an unknown one."""
    blueprint = born[id][0] if id in born else ""
    found = ((n, letter) for start, n, letter in KINDS if blueprint.startswith(start))
    return next(found, (0, OTHER))


def _is_of(id: int, wanted: str, born: dict[int, tuple[str, dict[str, str]]]) -> bool:
    """Returns whether an actor is of the wanted kind: a letter, the hero or any."""
    if wanted == OF_HERO:
        return id in born and born[id][1].get("role_name") == HERO
    return wanted in (ANY, _kind(id, born)[1])


def _row(time: str, types: str, id_1: str, name_1: str, id_2: str, name_2: str) -> str:
    """Returns a row of the collision table with its columns aligned."""
    return f"{time:>8} {types:>6} {id_1:>6} {name_1:<35} {id_2:>6} {name_2:<35}"
