"""Recorded motion as OpenSCENARIO XML: entities, their trajectories, and when they come and go.

1.2 is for esmini and everyone else, 1.0 for CARLA ScenarioRunner, which can take nobody out of a
running world: there who is away waits beside the road.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from itertools import pairwise
from math import cos, hypot, radians, sin
from pathlib import Path
from typing import Any, NamedTuple
from xml.etree import ElementTree

import numpy as np
from scenariogeneration import xosc

from skidpad.core.vocabulary import SemanticClass, class_of
from skidpad.recording.files import write_bytes
from skidpad.scenarios.export.tracks import Track
from skidpad.scenarios.export.version import OscVersion
from skidpad.scenarios.reading.entities import GHOST
from skidpad.scenarios.reading.environment import CELSIUS, HEAVY, Environment, Fall, Wetness

NOON, MIDNIGHT = 12, 0  # h; where the sun stands is said beside it
LIGHT = 100_000.0  # lx of a sun in the zenith
CLEAR = 100_000.0  # m, where a file says nothing of the sight
_DRY = xosc.PrecipitationType.dry
_OKTAS = ("zero", "one", "two", "three", "four", "five", "six", "seven", "eight")
HEIGHTS = {SemanticClass.TRUCK: 3.5, SemanticClass.BUS: 3.2, SemanticClass.PEDESTRIAN: 1.75}
EARLY = 0.005  # s that triggers fire before their time, so that rounding delays none
LINGER = 0.05  # s that who vanishes is still there
SIDE_STEP = 0.3  # m; who waits moves by it, as near vertices would be merged


@dataclass(frozen=True, slots=True)
class _Kind:
    """How a class of objects appears in the file."""

    category: Any
    blueprint: str  # CARLA's name for something like it


_KINDS = {
    SemanticClass.CAR: _Kind(xosc.VehicleCategory.car, "vehicle.tesla.model3"),
    SemanticClass.TRUCK: _Kind(xosc.VehicleCategory.truck, "vehicle.carlamotors.carlacola"),
    SemanticClass.BUS: _Kind(xosc.VehicleCategory.bus, "vehicle.mitsubishi.fusorosa"),
    SemanticClass.MOTORCYCLE: _Kind(xosc.VehicleCategory.motorbike, "vehicle.yamaha.yzf"),
    SemanticClass.BICYCLE: _Kind(xosc.VehicleCategory.bicycle, "vehicle.bh.crossbike"),
    SemanticClass.RIDER: _Kind(xosc.VehicleCategory.bicycle, "vehicle.bh.crossbike"),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Sheet:
    """What a file says besides motion. parking: where the row of absent actors begins."""

    title: str
    date: datetime
    road_file: str
    t_end: float  # s
    parking: tuple[float, float, float] = (0.0, 0.0, 0.0)  # x, y in m, heading in rad
    version: OscVersion = OscVersion.V1_2
    sparse: bool = False  # leave out every vertex that says nothing new
    environment: Environment | None = None  # weather, time and road; None: not said

    @property
    def old(self) -> bool:
        """Returns whether the file is written as version 1.0."""
        return self.version is OscVersion.V1_0

    def parking_place(self, k: int) -> tuple[float, float, float]:
        """Returns a parking place of its own for entity k: x, y in m, heading in rad."""
        x, y, h = self.parking
        return x + 8.0 * k * cos(h), y + 8.0 * k * sin(h), h


def write_scenario(path: Path, entities: Sequence[Track], sheet: Sheet) -> None:
    """Writes the scenario to a file."""
    write_element(path, _scenario(entities, sheet))


def write_element(path: Path, element: ElementTree.Element) -> None:
    """Writes an element as an XML file."""
    ElementTree.indent(element, " ")
    write_bytes(path, ElementTree.tostring(element, encoding="utf-8", xml_declaration=True))


def _scenario(entities: Sequence[Track], sheet: Sheet) -> ElementTree.Element:
    """Returns the XML root of the OpenSCENARIO file with one manoeuvre group for each track."""
    xosc.VersionBase().setVersion(minor=sheet.version.minor)  # of the whole library
    objects, init = xosc.Entities(), xosc.Init()
    act = xosc.Act("Act", _after(0.0, sheet))
    if sheet.environment is not None:
        init.add_global_action(environment_action(sheet.environment, old=sheet.old))
    for k, track in enumerate(entities):
        objects.add_scenario_object(track.name, _entity(track, sheet))
        _initial(init, track, sheet, k)
        act.add_maneuver_group(_motion(track, sheet, k))
    storyboard = xosc.StoryBoard(init, _after(sheet.t_end, sheet, "stop"))
    story = xosc.Story("Story")
    story.add_act(act)
    storyboard.add_story(story)
    scenario = xosc.Scenario(
        sheet.title,
        "Skidpad",
        xosc.ParameterDeclarations(),
        objects,
        storyboard,
        xosc.RoadNetwork(sheet.road_file),
        xosc.Catalog(),
        osc_minor_version=sheet.version.minor,
        creation_date=sheet.date,
    )
    root: ElementTree.Element = scenario.get_element()
    return root


def _entity(track: Track, sheet: Sheet) -> Any:
    """Returns the scenariogeneration object of a track: pedestrian, obstacle or vehicle, by its label."""
    length, width, cx, cy = track.box
    label = class_of(track.label)
    height = track.height or HEIGHTS.get(label, 1.5)
    box = xosc.BoundingBox(width, length, height, cx, cy, height / 2.0)
    if label is SemanticClass.PEDESTRIAN and not track.is_ego:
        entity: Any = xosc.Pedestrian(
            "walker.pedestrian.0001", 75.0, xosc.PedestrianCategory.pedestrian, box,
            "walker.pedestrian.0001",
        )  # fmt: skip
    elif label is SemanticClass.DYNAMIC:
        entity = xosc.MiscObject(
            "static.prop.box01", 50.0, xosc.MiscObjectCategory.obstacle, box, "static.prop.box01"
        )
    else:
        kind = _KINDS.get(label, _KINDS[SemanticClass.CAR])
        mass = {} if sheet.old else {"mass": 1500.0}
        entity = xosc.Vehicle(
            kind.blueprint, kind.category, box,
            xosc.Axle(0.5, 0.6, 0.9 * width, 0.6 * length, 0.3),
            xosc.Axle(0.0, 0.6, 0.9 * width, 0.0, 0.3),
            70.0, 12.0, 12.0, **mass,
        )  # fmt: skip
    entity.add_property("color", _rgb(track.colour) if sheet.old else track.colour)
    if track.channel:
        entity.add_property("channel", track.channel)
    entity.add_property("type", "ego_vehicle" if track.is_ego else "simulation")
    if track.ghost:
        entity.add_property(GHOST, "true")
    return entity


def _rgb(colour: str) -> str:
    """Returns a colour as CARLA's blueprints want it: red, green and blue from 0 to 255."""
    return ",".join(str(int(colour[k : k + 2], 16)) for k in (1, 3, 5))


def _initial(init: Any, track: Track, sheet: Sheet, k: int) -> None:
    """Adds place and speed at the start; what is not there yet is taken out of the world.

    In version 1.0 it waits beside the road instead. k: number of the entity.
    """
    late = track.t[0] > 1e-6
    first, speed = _vertices(track)[0], track.v[0]
    if late and sheet.old:
        first, speed = _waiting(0.0, sheet, k), 0.0
    init.add_init_action(track.name, xosc.TeleportAction(_position(first)))
    step = xosc.TransitionDynamics(xosc.DynamicsShapes.step, xosc.DynamicsDimension.time, 0)
    init.add_init_action(track.name, xosc.AbsoluteSpeedAction(speed, step))
    if late and not sheet.old:
        init.add_global_action(xosc.DeleteEntityAction(track.name))


def _vertices(track: Track) -> list[Vertex]:
    """Returns the track's vertices in s, m and rad, rounded; absent heights count as 0."""
    heights = track.z or [0.0] * len(track.t)
    rows = zip(track.t, track.x, track.y, heights, track.heading, strict=True)
    return [
        Vertex(round(t, 3), round(x, 3), round(y, 3), round(z, 3), round(h, 4))
        for t, x, y, z, h in rows
    ]


def _waiting(t: float, sheet: Sheet, k: int, further: float = 0.0) -> Vertex:
    """Returns a vertex at time t in s on the parking place of entity k, `further` m along its heading."""
    x, y, h = sheet.parking_place(k)
    x, y = x + further * cos(h), y + further * sin(h)
    return Vertex(round(t, 3), round(x, 3), round(y, 3), 0.0, round(h, 4))


def _motion(track: Track, sheet: Sheet, k: int) -> Any:
    """Returns the manoeuvre group of one entity: appear, follow trajectories, vanish, appear again."""
    manoeuvre = xosc.Maneuver(f"{track.name}_manoeuvre")
    stretches = [_vertices(track)[a:b] for a, b in track.stretches()]
    if sheet.old:
        _lead(manoeuvre, track.name, _with_waits(stretches, sheet, k), sheet, "moves")
    else:
        for n, rows in enumerate(stretches):
            _stay(manoeuvre, track.name, rows, sheet, "" if n == 0 else f"_{n + 1}")
    group = xosc.ManeuverGroup(f"{track.name}_group")
    group.add_actor(track.name)
    group.add_maneuver(manoeuvre)
    return group


def _with_waits(stretches: Sequence[Sequence[Vertex]], sheet: Sheet, k: int) -> list[Vertex]:
    """Returns all stretches as one, with waits beside the road before, between and after them."""
    rows: list[Vertex] = []
    for stretch in stretches:
        begin = stretch[0].t
        away = rows[-1].t + 0.001 if rows else 0.0
        if begin > away + 0.001:
            rows += [_waiting(away, sheet, k), _waiting(begin - 0.001, sheet, k, SIDE_STEP)]
        rows += stretch
    away = rows[-1].t + 0.001
    if sheet.t_end > away:
        rows += [_waiting(away, sheet, k), _waiting(sheet.t_end, sheet, k, SIDE_STEP)]
    return rows


def _stay(manoeuvre: Any, name: str, rows: Sequence[Vertex], sheet: Sheet, suffix: str) -> None:
    """Adds the events of one stretch of being there."""
    if rows[0].t > 1e-6:
        add = xosc.AddEntityAction(name, _position(rows[0]))
        manoeuvre.add_event(_event(f"{name}_appears{suffix}", add, rows[0].t, sheet))
    _lead(manoeuvre, name, rows, sheet, f"moves{suffix}")
    if rows[-1].t < sheet.t_end - 1e-6:
        gone = xosc.DeleteEntityAction(name)
        manoeuvre.add_event(_event(f"{name}_vanishes{suffix}", gone, rows[-1].t + LINGER, sheet))


def _lead(manoeuvre: Any, name: str, rows: Sequence[Vertex], sheet: Sheet, word: str) -> None:
    """Adds the trajectories of a stretch, one event each; the last vertex is held for a second."""
    held = [*rows, rows[-1]._replace(t=round(rows[-1].t + 1.0, 3))]  # no controller takes over
    for n, piece in enumerate(pieces(held, sheet.sparse)):
        label = f"{name}_{word}" if n == 0 else f"{name}_{word}_p{n + 1}"
        trajectory = xosc.Trajectory(f"{label}_trajectory", False)
        trajectory.add_shape(xosc.Polyline([v.t for v in piece], [_position(v) for v in piece]))
        follow = xosc.FollowTrajectoryAction(
            trajectory, xosc.FollowingMode.position, xosc.ReferenceContext.absolute, 1, 0
        )
        begin = 0.0 if n == 0 and sheet.old else piece[0].t
        manoeuvre.add_event(_event(label, follow, begin, sheet, takes_over=n > 0))


def _event(name: str, action: Any, t: float, sheet: Sheet, *, takes_over: bool = False) -> Any:
    """Returns an event that starts its one action at time t in s; with `takes_over` it overrides others."""
    priority = xosc.Priority.override if takes_over else xosc.Priority.parallel
    event = xosc.Event(name, xosc.Priority.overwrite if sheet.old else priority)
    event.add_action(f"{name}_action", action)
    event.add_trigger(_after(t, sheet))
    return event


def _position(v: Vertex) -> Any:
    """Returns the world position of a vertex, with pitch and roll 0."""
    return xosc.WorldPosition(v.x, v.y, v.z, v.h, 0, 0)


def _after(t: float, sheet: Sheet, point: str = "start") -> Any:
    """Returns a trigger at simulation time t s; OpenSCENARIO 1.0 knows no `greaterOrEqual`.

    point: "start" or "stop".
    """
    rule = xosc.Rule.greaterThan if sheet.old else xosc.Rule.greaterOrEqual
    value = round(t - EARLY, 3) if t > 0.0 or sheet.old else 0.0
    condition = xosc.SimulationTimeCondition(value, rule)
    return xosc.ValueTrigger(point, 0, xosc.ConditionEdge.none, condition, point)


# Weather, time of day and road of a run as an <EnvironmentAction>.


def environment_action(environment: Environment, *, old: bool) -> Any:
    """Returns the <EnvironmentAction> of an environment.

    old: by the vocabulary of 1.0, where clouds are words and rain is a share.
    """
    elevation = environment.sun_elevation_deg or 0.0
    sun = xosc.Sun(
        1.0 if old else LIGHT if elevation > 0.0 else 0.0,
        round(radians(environment.sun_azimuth_deg or 0.0), 4),
        round(radians(elevation), 4),
    )
    rain = environment.fall_mm_h / HEAVY if old else environment.fall_mm_h
    kind = {
        Fall.RAIN: xosc.PrecipitationType.rain,
        Fall.SNOW: xosc.PrecipitationType.snow,
        Fall.DRY: _DRY,
    }[environment.fall]
    weather = xosc.Weather(
        _clouds(environment.clouds or 0.0, old=old),
        sun=sun,
        fog=xosc.Fog(round(environment.visual_range or CLEAR, 1)),
        precipitation=xosc.Precipitation(kind, round(rain, 4)),
        **_temperature(environment, old=old),
    )
    wet = environment.wetness or Wetness.DRY
    wetness = {} if old else {"wetness": getattr(xosc.Wetness, wet.value)}
    scale = 1.0 if environment.friction_scale is None else environment.friction_scale
    hour = NOON if elevation > 0.0 else MIDNIGHT
    return xosc.EnvironmentAction(
        xosc.Environment(
            environment.name or "weather",
            xosc.TimeOfDay(False, 2000, 3, 20, hour, 0, 0),
            weather,
            xosc.RoadCondition(scale, **wetness),
        )
    )


def _clouds(share: float, *, old: bool) -> Any:
    """Returns the enumeration value for a cloud cover of 0..1: oktas, or a cloud state for old versions."""
    if not old:
        return getattr(xosc.FractionalCloudCover, f"{_OKTAS[round(8.0 * share)]}Oktas")
    words = xosc.CloudState
    return words.free if share < 0.3 else words.cloudy if share < 0.8 else words.overcast


def _temperature(environment: Environment, *, old: bool) -> dict[str, float]:
    """Returns {"temperature": kelvin}; empty for old versions or where the temperature is unknown."""
    if old or environment.temperature_c is None:
        return {}
    return {"temperature": round(environment.temperature_c + CELSIUS, 2)}


# Recorded motion in pieces that every player follows alike.

NEAR = 0.105  # m, 5 mm more than the radius of esmini's filter
SHIFT_MAX = 0.001  # m, that leaving a vertex out may cost
TURN_MAX = 0.002  # rad
HELD_MAX = 1.0  # s between vertices of what moves


class Vertex(NamedTuple):
    """A place and when it is reached: s, m, rad."""

    t: float
    x: float
    y: float
    z: float
    h: float


def pieces(vertices: Sequence[Vertex], sparse: bool = False) -> list[list[Vertex]]:
    """Returns the motion as trajectories that follow each other; where one ends the next begins.

    Vertices that say no more than their neighbours are left out where they are near; sparse:
    everywhere. Times must rise.
    """
    kept = thin_vertices(vertices, sparse)
    found = [kept[:1]]
    closed = False  # a near vertex ends a piece
    for before, vertex in pairwise(kept):
        if closed:
            found.append([before])
        found[-1].append(vertex)
        closed = _distance(before, vertex) < NEAR
    return found


def thin_vertices(vertices: Sequence[Vertex], sparse: bool = False) -> list[Vertex]:
    """Returns the vertices without those that the motion is as even without.

    Only near ones are left out; sparse: any.
    """
    table = np.array(vertices)
    kept, i, last = [0], 0, len(vertices) - 1
    while i < last:
        j = i + 1
        if sparse or _distance(vertices[i], vertices[j]) < NEAR:
            while j < last and _even(table[i : j + 2]):
                j += 1
        kept.append(j)
        i = j
    return [vertices[k] for k in kept]


def _even(rows: np.ndarray) -> bool:
    """Returns whether those between the first and the last one lie on the straight way in time.

    rows: (n, 5) of t, x, y, z, h; within SHIFT_MAX and TURN_MAX.
    """
    first, last = rows[0], rows[-1]
    way = float(np.hypot(last[1] - first[1], last[2] - first[2]))
    if way >= NEAR and last[0] - first[0] > HELD_MAX:
        return False
    share = ((rows[1:-1, 0] - first[0]) / (last[0] - first[0]))[:, None]
    off = np.abs(rows[1:-1, 1:] - first[1:] - share * (last[1:] - first[1:])).max(axis=0)
    return bool((off[:3] <= SHIFT_MAX).all() and off[3] <= TURN_MAX)


def _distance(a: Vertex, b: Vertex) -> float:
    """Returns the horizontal distance in m between two vertices."""
    return hypot(b.x - a.x, b.y - a.y)
