"""Hazard records to OpenSCENARIO and OpenDRIVE (C-150 to C-156, decision C-14).

1.2 holds the worlds of all channels, for esmini and everyone else; 1.0 holds one channel's world
for CARLA ScenarioRunner, since two egos at one place cannot be spawned there. Channels carry no
lanes, so the road is a generic one that covers every position.
"""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime, timedelta
from enum import Enum
from math import atan2, ceil, cos, hypot, sin
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from scenariogeneration import xodr, xosc

from skidpad.core.errors import ConfigError, InputError
from skidpad.core.names import path_part
from skidpad.core.vocabulary import SemanticClass
from skidpad.recording.files import write_bytes
from skidpad.recording.hazards import HazardRecord
from skidpad.scenarios.tracks import Track, tracks

LANE_WIDTH = 3.5  # m
ROAD_MARGIN = 20.0  # m beyond the outermost position
ROAD_SIZE_MAX = 20_000.0  # m; positions further apart are no single scene
HEIGHTS = {SemanticClass.TRUCK: 3.5, SemanticClass.BUS: 3.2, SemanticClass.PEDESTRIAN: 1.75}
EGO_COLOURS = ("#FF0000", "#0000FF", "#009900", "#990099")  # C-155: LAV red, TFuse blue
OBJECT_COLOURS = ("#FFFFFF", "#FFFF00", "#99FF99", "#FF99FF")  # LAV white, TFuse yellow
EPOCH = datetime(1970, 1, 1)  # noqa: DTZ001  # the library writes naive times


class OscVersion(str, Enum):
    """Which profile of OpenSCENARIO XML is written."""

    V1_2 = "1.2"
    V1_0 = "1.0"

    @property
    def minor(self) -> int:
        """Minor revision for the file header."""
        return int(self.value.split(".")[1])


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


def export_hazard(
    record: HazardRecord,
    folder: Path,
    version: OscVersion = OscVersion.V1_2,
    world: str | None = None,
) -> tuple[Path, Path]:
    """Write ID-TYPE.xosc and .xodr into `folder`, ID-TYPE_1.0 for version 1.0.

    world: the one channel of a 1.0 file.
    """
    channels = _channels(record, version, world)
    entities = [track for track in tracks(record, channels) if track.t]
    if not any(track.is_ego for track in entities):
        raise InputError(f"hazard {record.id}: no world with an ego to export")
    old = version is OscVersion.V1_0
    stem = path_part(f"{record.id}-{record.type.value}{'_1.0' if old else ''}")
    t_end = max(track.t[-1] for track in entities)
    road_file, scenario_file = folder / f"{stem}.xodr", folder / f"{stem}.xosc"
    road, parking = _road(entities, stem)
    root = _scenario(record, entities, road_file.name, version, t_end, parking)
    for path, element in ((road_file, road), (scenario_file, root)):
        ElementTree.indent(element, " ")
        text = ElementTree.tostring(element, encoding="utf-8", xml_declaration=True)
        write_bytes(path, text)
    return scenario_file, road_file


def _channels(record: HazardRecord, version: OscVersion, world: str | None) -> tuple[str, ...]:
    if world is not None and world not in record.channels:
        raise ConfigError(
            f"unknown channel {world!r} in hazard {record.id}; choose one of: "
            + ", ".join(record.channels)
        )
    if version is OscVersion.V1_0:
        return (world or record.driving or record.channels[0],)
    return record.channels if world is None else (world,)


def _road(
    entities: list[Track], name: str
) -> tuple[ElementTree.Element, tuple[float, float, float]]:
    """A straight road under every position; a place beside it and its heading."""
    ego = entities[0]
    dx, dy = ego.x[-1] - ego.x[0], ego.y[-1] - ego.y[0]
    h = atan2(dy, dx) if hypot(dx, dy) > 5.0 else ego.heading[0]
    c, s = cos(h), sin(h)
    ox, oy = ego.x[0], ego.y[0]
    along = [(x - ox) * c + (y - oy) * s for e in entities for x, y in zip(e.x, e.y, strict=True)]
    left = [(y - oy) * c - (x - ox) * s for e in entities for x, y in zip(e.x, e.y, strict=True)]
    start, length = min(along) - ROAD_MARGIN, max(along) - min(along) + 2.0 * ROAD_MARGIN
    half = max(abs(v) for v in left) + LANE_WIDTH
    if max(length, half) > ROAD_SIZE_MAX:
        raise InputError(f"{name}: its positions spread over more than {ROAD_SIZE_MAX:g} m")
    lanes = min(max(1, ceil(half / LANE_WIDTH)), 8)
    road = xodr.create_road(
        [xodr.Line(length)],
        id=0,
        left_lanes=lanes,
        right_lanes=lanes,
        lane_width=max(LANE_WIDTH, half / lanes),
    )
    road.planview.set_start_point(ox + start * c, oy + start * s, h)
    road.add_elevation(0, 0, 0, 0, 0)
    road.add_superelevation(0, 0, 0, 0, 0)
    odr = xodr.OpenDrive(name, "1", "7")
    odr.add_road(road)
    odr.adjust_roads_and_lanes()
    root: ElementTree.Element = odr.get_element()
    root.find("header").set("date", "1970-01-01T00:00:00")  # type: ignore[union-attr]
    side = half + 30.0
    return root, (ox + start * c - side * s, oy + start * s + side * c, h)


def _scenario(
    record: HazardRecord,
    entities: list[Track],
    road_file: str,
    version: OscVersion,
    t_end: float,
    parking: tuple[float, float, float],
) -> ElementTree.Element:
    xosc.VersionBase().setVersion(minor=version.minor)  # a class variable of the whole library
    objects, init = xosc.Entities(), xosc.Init()
    act = xosc.Act("Act", _after(0.0, version))
    for k, track in enumerate(entities):
        objects.add_scenario_object(track.name, _entity(track, record, version))
        late = track.t[0] > 1e-6
        parked = _parked(parking, k) if late and version is OscVersion.V1_0 else None
        _initial(init, track, parked, late and version is not OscVersion.V1_0)
        act.add_maneuver_group(_motion(track, version, t_end, parked, _parked(parking, k)))
    storyboard = xosc.StoryBoard(init, _stop(t_end, version))
    story = xosc.Story("Story")
    story.add_act(act)
    storyboard.add_story(story)
    scenario = xosc.Scenario(
        f"Hazard {record.id}: {record.type.value}",
        "Skidpad",
        xosc.ParameterDeclarations(),
        objects,
        storyboard,
        xosc.RoadNetwork(road_file),
        xosc.Catalog(),
        osc_minor_version=version.minor,
        creation_date=EPOCH + timedelta(seconds=record.t_start),
    )
    root: ElementTree.Element = scenario.get_element()
    return root


def _entity(track: Track, record: HazardRecord, version: OscVersion) -> Any:
    length, width, cx, cy = track.box
    label = SemanticClass(track.label) if track.label >= 0 else SemanticClass.CAR
    height = HEIGHTS.get(label, 1.5)
    box = xosc.BoundingBox(width, length, height, cx, cy, height / 2.0)
    if label is SemanticClass.PEDESTRIAN and not track.is_ego:
        entity: Any = xosc.Pedestrian(
            "walker.pedestrian.0001", 75.0, xosc.PedestrianCategory.pedestrian, box,
            "walker.pedestrian.0001",
        )  # fmt: skip
    else:
        kind = _KINDS.get(label, _KINDS[SemanticClass.CAR])
        mass = {} if version is OscVersion.V1_0 else {"mass": 1500.0}
        entity = xosc.Vehicle(
            kind.blueprint, kind.category, box,
            xosc.Axle(0.5, 0.6, 0.9 * width, 0.6 * length, 0.3),
            xosc.Axle(0.0, 0.6, 0.9 * width, 0.0, 0.3),
            70.0, 12.0, 12.0, **mass,
        )  # fmt: skip
    colours = EGO_COLOURS if track.is_ego else OBJECT_COLOURS
    colour = colours[record.channels.index(track.channel) % len(colours)]
    entity.add_property("color", _rgb(colour) if version is OscVersion.V1_0 else colour)
    entity.add_property("channel", track.channel)
    entity.add_property("type", "ego_vehicle" if track.is_ego else "simulation")
    return entity


def _rgb(colour: str) -> str:
    """As CARLA's blueprints want it: red, green and blue from 0 to 255."""
    return ",".join(str(int(colour[k : k + 2], 16)) for k in (1, 3, 5))


def _initial(
    init: Any, track: Track, parked: tuple[float, float, float] | None, absent: bool
) -> None:
    """Place and speed at the start; what is not there yet is taken out of the world."""
    place = parked or (track.x[0], track.y[0], track.heading[0])
    speed = 0.0 if parked else track.v[0]
    init.add_init_action(track.name, xosc.TeleportAction(_position(*place)))
    step = xosc.TransitionDynamics(xosc.DynamicsShapes.step, xosc.DynamicsDimension.time, 0)
    init.add_init_action(track.name, xosc.AbsoluteSpeedAction(speed, step))
    if absent:
        init.add_global_action(xosc.DeleteEntityAction(track.name))


def _motion(
    track: Track,
    version: OscVersion,
    t_end: float,
    parked: tuple[float, float, float] | None,
    parking: tuple[float, float, float],
) -> Any:
    """The manoeuvre group of one entity: appear, follow the trajectory, vanish."""
    rows = list(zip(track.t, track.x, track.y, track.heading, strict=True))
    late, early = track.t[0] > 1e-6, track.t[-1] < t_end - 1e-6
    old = version is OscVersion.V1_0
    if old and parked:
        rows = [(0.0, *parked), (track.t[0] - 0.001, *parked), *rows]
    if old and early:
        rows += [(track.t[-1] + 0.001, *parking), (t_end, *parking)]
    last = rows[-1]
    rows.append((last[0] + 1.0, *last[1:]))  # so that no controller takes over at the end
    manoeuvre = xosc.Maneuver(f"{track.name}_manoeuvre")
    begin = track.t[0] if late and not old else 0.0
    if late and not old:
        manoeuvre.add_event(
            _event(
                f"{track.name}_appears",
                xosc.AddEntityAction(
                    track.name, _position(track.x[0], track.y[0], track.heading[0])
                ),
                begin,
                version,
            )
        )
    follow = _event(f"{track.name}_moves", _follow(track.name, rows), begin, version)
    manoeuvre.add_event(follow)
    if early and not old:
        manoeuvre.add_event(
            _event(
                f"{track.name}_vanishes",
                xosc.DeleteEntityAction(track.name),
                track.t[-1] + 0.05,
                version,
            )
        )
    group = xosc.ManeuverGroup(f"{track.name}_group")
    group.add_actor(track.name)
    group.add_maneuver(manoeuvre)
    return group


def _follow(name: str, rows: list[tuple[float, float, float, float]]) -> Any:
    trajectory = xosc.Trajectory(f"{name}_trajectory", False)
    trajectory.add_shape(
        xosc.Polyline([round(r[0], 3) for r in rows], [_position(r[1], r[2], r[3]) for r in rows])
    )
    return xosc.FollowTrajectoryAction(
        trajectory, xosc.FollowingMode.position, xosc.ReferenceContext.absolute, 1, 0
    )


def _event(name: str, action: Any, t: float, version: OscVersion) -> Any:
    old = version is OscVersion.V1_0
    event = xosc.Event(name, xosc.Priority.overwrite if old else xosc.Priority.parallel)
    event.add_action(f"{name}_action", action)
    event.add_trigger(_after(t, version))
    return event


def _position(x: float, y: float, h: float) -> Any:
    return xosc.WorldPosition(round(x, 3), round(y, 3), 0, round(h, 4), 0, 0)


def _parked(parking: tuple[float, float, float], k: int) -> tuple[float, float, float]:
    """A parking place of its own for entity k, in a row beside the road."""
    x, y, h = parking
    return x + 8.0 * k * cos(h), y + 8.0 * k * sin(h), h


def _after(t: float, version: OscVersion) -> Any:
    return _time_trigger("start", t, version, "start")


def _stop(t: float, version: OscVersion) -> Any:
    return _time_trigger("stop", t, version, "stop")


def _time_trigger(name: str, t: float, version: OscVersion, point: str) -> Any:
    """At simulation time `t`; OpenSCENARIO 1.0 knows no `greaterOrEqual`."""
    if version is OscVersion.V1_0:
        condition = xosc.SimulationTimeCondition(round(t - 0.1, 3), xosc.Rule.greaterThan)
    else:
        condition = xosc.SimulationTimeCondition(round(t, 3), xosc.Rule.greaterOrEqual)
    return xosc.ValueTrigger(name, 0, xosc.ConditionEdge.none, condition, point)
