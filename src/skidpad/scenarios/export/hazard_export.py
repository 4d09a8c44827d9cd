"""Hazard records to OpenSCENARIO and OpenDRIVE (C-150 to C-156, decision C-14).

1.2 holds the worlds of all channels, for esmini and everyone else; 1.0 holds one channel's world
for CARLA ScenarioRunner, since two egos at one place cannot be spawned there. Channels carry no
lanes, so the road is a generic one that covers every position.
"""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime, timedelta
from math import atan2, ceil, cos, hypot, sin
from pathlib import Path
from xml.etree import ElementTree

from scenariogeneration import xodr

from skidpad.core.errors import ConfigError, InputError
from skidpad.core.files.names import path_part
from skidpad.recording.hazards.records import HazardRecord
from skidpad.scenarios.export.tracks import Track, tracks
from skidpad.scenarios.export.version import OscVersion
from skidpad.scenarios.export.writer import Sheet, write_element, write_scenario

LANE_WIDTH = 3.5  # m
ROAD_MARGIN = 20.0  # m beyond the outermost position
ROAD_SIZE_MAX = 20_000.0  # m; positions further apart are no single scene
EGO_COLOURS = ("#FF0000", "#0000FF", "#009900", "#990099")  # C-155: LAV red, TFuse blue
OBJECT_COLOURS = ("#FFFFFF", "#FFFF00", "#99FF99", "#FF99FF")  # LAV white, TFuse yellow
EPOCH = datetime(1970, 1, 1)  # noqa: DTZ001  # the library writes naive times


def export_hazard(
    record: HazardRecord,
    folder: Path,
    version: OscVersion = OscVersion.V1_2,
    world: str | None = None,
) -> tuple[Path, Path]:
    """Writes ID-TYPE.xosc and .xodr into `folder`, ID-TYPE_1.0 for version 1.0; returns both paths.

    world: the one channel of a file; None: all, for version 1.0 the driving one. ConfigError for an
    unknown channel, InputError without an ego to export.
    """
    channels = _channels(record, version, world)
    entities = [track for track in tracks(record, channels) if track.t]
    if not any(track.is_ego for track in entities):
        raise InputError(f"hazard {record.id}: no world with an ego to export")
    old = version is OscVersion.V1_0
    stem = path_part(f"{record.id}-{record.type.value}{'_1.0' if old else ''}")
    t_end = max(track.t[-1] for track in entities)
    road_file, scenario_file = folder / f"{stem}.xodr", folder / f"{stem}.xosc"
    road, parking = road_under(entities, stem)
    sheet = Sheet(
        title=f"Hazard {record.id}: {record.type.value}",
        date=EPOCH + timedelta(seconds=record.t_start),
        road_file=road_file.name,
        t_end=t_end,
        parking=parking,
        version=version,
    )
    _paint(entities, record)
    write_element(road_file, road)
    write_scenario(scenario_file, entities, sheet)
    return scenario_file, road_file


def _paint(entities: Sequence[Track], record: HazardRecord) -> None:
    """Sets the colours by channel; what another channel than the first one saw is made a ghost."""
    first = entities[0].channel
    for track in entities:
        colours = EGO_COLOURS if track.is_ego else OBJECT_COLOURS
        track.colour = colours[record.channels.index(track.channel) % len(colours)]
        track.ghost = track.channel != first


def _channels(record: HazardRecord, version: OscVersion, world: str | None) -> tuple[str, ...]:
    """Returns the channels to write: all, or only `world`; version 1.0 takes one, by default the driving."""
    if world is not None and world not in record.channels:
        raise ConfigError(
            f"unknown channel {world!r} in hazard {record.id}; choose one of: "
            + ", ".join(record.channels)
        )
    if version is OscVersion.V1_0:
        return (world or record.driving or record.channels[0],)
    return record.channels if world is None else (world,)


def road_under(
    entities: Sequence[Track], name: str
) -> tuple[ElementTree.Element, tuple[float, float, float]]:
    """Returns a straight road under every position, and a place beside it with its heading.

    entities: the ego first. x, y in m and rad. InputError where they spread over ROAD_SIZE_MAX.
    """
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
