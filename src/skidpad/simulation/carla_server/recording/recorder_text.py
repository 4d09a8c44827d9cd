"""What CARLA's `show_recorder_...` calls print of a recording, in CARLA's own words.

Programs parse these texts: ScenarioRunner's metrics take the map from the second line, frames from
`Frame N at T seconds`, places in cm. Wording and order: CARLA's public source, CarlaRecorderQuery.cpp
(0.9.16). Packets that this server does not write (bones, doors, wheels, street lamps, physics) are
not printed.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from math import dist
from time import gmtime, strftime
from typing import Any

from skidpad.simulation.carla_server.recording.frames import HERO
from skidpad.simulation.carla_server.recording.packets import (
    Added,
    Kind,
    LogFrame,
    LogHead,
    Packet,
)

LETTERS: dict[int, str] = {Kind.VEHICLE: "v", Kind.WALKER: "w", Kind.TRAFFIC_LIGHT: "t"}
ANY, OTHER, OF_HERO = "a", "o", "h"
LAMPS = {  # VehicleLightState's flags in the order in which CARLA names them
    0x1: "Position",
    0x2: "LowBeam",
    0x4: "HighBeam",
    0x8: "Brake",
    0x10: "RightBlinker",
    0x20: "LeftBlinker",
    0x40: "Reverse",
    0x100: "Interior",
    0x80: "Fog",
    0x200: "Special1",
    0x400: "Special2",
}
WEATHER = (
    "Cloudiness", "Precipitation", "PrecipitationDeposits", "WindIntensity", "SunAzimuthAngle",
    "SunAltitudeAngle", "FogDensity", "FogDistance", "FogFalloff", "Wetness", "ScatteringIntensity",
    "MieScatteringScale", "RayleighScatteringScale", "DustStorm",
)  # fmt: skip


def describe_recording(head: LogHead, frames: Iterable[LogFrame], show_all: bool) -> str:
    """Returns the text of `show_recorder_file_info`: events, with `show_all` every frame."""
    lines, last = _head_lines(head), None
    for last in frames:
        events = list(_event_lines(last))
        state = list(_state_lines(last)) if show_all else []
        weather = list(_weather_lines(last))
        if events or weather or show_all:
            lines += [f"Frame {last.number} at {last.elapsed:g} seconds"]
            lines += [*events, *state, *weather]
    return "\n".join(lines) + "\n" + _tail(last)


def list_collisions(head: LogHead, frames: Iterable[LogFrame], first: str, second: str) -> str:
    """Returns the text of `show_recorder_collisions`: each contact when it begins.

    first, second: kinds of the two sides: o other, v vehicle, w walker, t traffic light, h hero, a any.
    """
    lines = [*_head_lines(head), _row("Time", "Types", "Id", "Actor 1", "Id", "Actor 2")]
    born: dict[int, Added] = {}
    before: set[tuple[int, int]] = set()
    last = None
    for last in frames:
        born |= {actor.id: actor for actor in last.added}
        now = set()
        for _, a, b, *_ in last.rows(Packet.COLLISION):
            if not (_is_of(a, first, born) and _is_of(b, second, born)):
                continue
            now.add((a, b))
            if (a, b) not in before:
                names = [born[id].blueprint if id in born else "" for id in (a, b)]
                types = f"{_letter(a, born)} {_letter(b, born)}"
                time = f"{last.elapsed:.0f}"
                lines.append(_row(time, types, str(a), names[0], str(b), names[1]))
        before = now
    return "\n".join(lines) + "\n" + _tail(last)


def list_blocked(head: LogHead, frames: Iterable[LogFrame], seconds: float, cm: float) -> str:
    """Returns the text of `show_recorder_actors_blocked`: actors that stood for so long, longest first.

    seconds: shortest time worth telling; cm: an actor that moves less from its place stands.
    """
    names: dict[int, str] = {}
    places: dict[int, tuple[list[float], float]] = {}  # where it last moved to, and when
    found: list[tuple[float, float, int]] = []
    last = None
    for last in frames:
        names |= {actor.id: actor.blueprint for actor in last.added}
        for id, xyz, _ in last.rows(Packet.POSITION):
            place, since = places.setdefault(id, (xyz, last.elapsed))
            if dist(place, xyz) >= cm:
                stood = last.elapsed - since
                found += [(stood, since, id)] if stood >= seconds else []
                places[id] = xyz, last.elapsed
    end = 0.0 if last is None else last.elapsed
    found += [(end - s, s, id) for id, (_, s) in places.items() if end - s >= seconds]
    lines = [*_head_lines(head), f"{'Time':>8} {'Id':>6} {'Actor':<35} {'Duration':>10}"]
    for duration, since, id in sorted(found, key=lambda row: -row[0]):
        lines.append(f"{since:8.0f} {id:6} {names.get(id, ''):<35} {duration:10.0f}")
    return "\n".join(lines) + "\n" + _tail(last)


def _head_lines(head: LogHead) -> list[str]:
    """Returns the lines with version, map and date of a recording, and an empty one."""
    try:
        date = strftime("%x %X", gmtime(head.date))
    except (OverflowError, OSError, ValueError):
        date = "unknown"
    return [f"Version: {head.version}", f"Map: {head.map:.80}", f"Date: {date}", ""]


def _tail(last: LogFrame | None) -> str:
    """Returns the last lines: the number of frames and the duration in s, as the last frame says."""
    number, elapsed = (0, 0.0) if last is None else (last.number, last.elapsed)
    return f"\nFrames: {number}\nDuration: {elapsed:g} seconds\n"


def _event_lines(frame: LogFrame) -> Iterator[str]:
    """Yields lines of actors that come and go, of their parents and of contacts."""
    for actor in frame.added:
        yield f" Create {actor.id}: {actor.blueprint} ({actor.kind}) at ({_vector(actor.place)})"
        yield from (f"  {name} = {value}" for _, name, value in actor.attributes)
    for (id,) in frame.rows(Packet.EVENT_DEL):
        yield f" Destroy {id}"
    for id, parent in frame.rows(Packet.EVENT_PARENT):
        yield f" Parenting {id} with {parent} (parent)"
    for number, a, b, hero, other_hero in frame.rows(Packet.COLLISION):
        sides = f"{a}{_hero_mark(hero)} with {b}{_hero_mark(other_hero)}"
        yield f" Collision id {number} between {sides}"


def _hero_mark(hero: bool) -> str:
    """Returns " (hero) " for a hero, else empty text."""
    return " (hero) " if hero else ""


def _state_lines(frame: LogFrame) -> Iterator[str]:
    """Yields the lines of everything that is in a frame beside events and weather."""
    for packet, title, line in (
        (Packet.POSITION, "Positions", _position_line),
        (Packet.TRAFFIC_LIGHT, "State traffic lights", _light_line),
        (Packet.VEHICLE, "Vehicle animations", _vehicle_line),
        (Packet.WALKER, "Walker animations", _walker_line),
        (Packet.VEHICLE_LIGHT, "Vehicle light animations", _lamp_line),
        (Packet.KINEMATICS, "Dynamic actors", _velocity_line),
        (Packet.BOUNDING_BOX, "Actor bounding boxes", _box_line),
        (Packet.TRIGGER_VOLUME, "Actor trigger volumes", _box_line),
    ):
        if packet in frame.records:
            yield f" {title}: {len(frame.records[packet])}"
            yield from (f"  Id: {row[0]} {line(*row[1:])}" for row in frame.rows(packet))
    if frame.platform_time is not None:
        yield f" Current platform time: {frame.platform_time:g}"
    times = frame.rows(Packet.TRAFFIC_LIGHT_TIME)
    if times:
        yield f" Traffic Light time events: {len(times)}"
    for id, (green, yellow, red) in times:
        yield f"  Id: {id} green_time: {green:g} yellow_time: {yellow:g} red_time: {red:g}"


def _position_line(place: Any, turn: Any) -> str:
    """Returns the text of a place in cm and a turn in deg."""
    return f"Location: ({_vector(place)}) Rotation: ({_vector(turn)})"


def _light_line(frozen: bool, elapsed: float, state: int) -> str:
    """Returns the text of a traffic light's state."""
    return f"state: {state} frozen: {int(frozen)} elapsedTime: {elapsed:g}"


def _vehicle_line(steer: float, throttle: float, brake: float, hand_brake: bool, gear: int) -> str:
    """Returns the text of a vehicle's control."""
    pedals = f"Steering: {steer:g} Throttle: {throttle:g} Brake: {brake:g}"
    return f"{pedals} Handbrake: {int(hand_brake)} Gear: {gear}"


def _walker_line(speed: float) -> str:
    """Returns the text of a walker's speed in cm/s."""
    return f"speed: {speed:g}"


def _lamp_line(flags: int) -> str:
    """Returns the names of the lamps that are on."""
    return " ".join(name for flag, name in LAMPS.items() if flags & flag) or "None"


def _velocity_line(velocity: Any, turn: Any) -> str:
    """Returns the text of a velocity in m/s and a turning rate in deg/s."""
    return f"linear_velocity: ({_vector(velocity)}) angular_velocity: ({_vector(turn)})"


def _box_line(origin: Any, extent: Any) -> str:
    """Returns the text of a box in cm."""
    return f"origin: ({_vector(origin)}) extension: ({_vector(extent)})"


def _weather_lines(frame: LogFrame) -> Iterator[str]:
    """Yields the lines of a change of the weather; last, for ScenarioRunner's parser does not know them."""
    rows = frame.rows(Packet.WEATHER)
    if rows:
        yield f" Weathers: {len(rows)}"
    for (values,) in rows:
        named = zip(WEATHER, values, strict=True)
        yield "  " + " ".join(f"{name}: {value:g}" for name, value in named)


def _vector(values: Any) -> str:
    """Returns the numbers as text, joined by commas."""
    return ", ".join(f"{v:g}" for v in values)


def _letter(id: int, born: dict[int, Added]) -> str:
    """Returns the letter of an actor's kind; OTHER for the scenery and what is unknown."""
    return LETTERS.get(born[id].kind, OTHER) if id in born else OTHER


def _is_of(id: int, wanted: str, born: dict[int, Added]) -> bool:
    """Returns whether an actor is of the wanted kind: a letter, the hero or any."""
    if wanted == OF_HERO:
        return id in born and born[id].attribute_values().get("role_name") == HERO
    return wanted in (ANY, _letter(id, born))


def _row(time: str, types: str, id_1: str, name_1: str, id_2: str, name_2: str) -> str:
    """Returns a row of the collision table with its columns aligned."""
    return f"{time:>8} {types:>6} {id_1:>6} {name_1:<35} {id_2:>6} {name_2:<35}"
