"""The maps that are served: bundled ones, a folder of the user's, and OpenDRIVE text from clients."""

from __future__ import annotations

import logging
from dataclasses import dataclass
from pathlib import Path

from shapely.errors import ShapelyError

from skidpad.core.errors import ConfigError, SkidpadError
from skidpad.core.geometry import Pose
from skidpad.core.maths.geodesy import client_geolocation
from skidpad.core.vocabulary import Scenery
from skidpad.roads.bundled import bundled_maps, load_map, map_file
from skidpad.roads.lanes import LaneKind
from skidpad.roads.queries import RoadMap
from skidpad.roads.walkable import walk_mesh
from skidpad.scenery.dressing import dress_map
from skidpad.sensors.inertial import map_origin
from skidpad.simulation.carla_server.maps import navmesh
from skidpad.simulation.carla_server.protocol.rpc import CallError

log = logging.getLogger("skidpad.carla_server")
PREFIX = "Carla/Maps/"
LAYERED = "_Opt"  # CARLA offers most maps twice: those with layers end like this
OPENDRIVE_MAP = "OpenDriveMap"  # the name under which a client's own text is loaded
MAX_XODR = 24 * 1024 * 1024  # characters
SPACING = 25.0  # m between recommended spawn points along a lane
MARGIN = 6.0  # m from a lane's ends
KEPT_MESHES = 16  # navigation meshes, by content of the map: a large town takes seconds
_NAVIGATION: dict[str, tuple[str, bytes] | None] = {}
CLIENT_ORIGIN = (42.0, 2.0)  # deg, of maps that name none
LIFT = 0.3  # m above the road, so that no actor spawns inside it


@dataclass(frozen=True, slots=True)
class ServedMap:
    """Holds a map as it is served: roads, OpenDRIVE text, spawn points."""

    name: str
    roads: RoadMap
    xodr: str
    spawn_points: tuple[Pose, ...]

    def geolocation(self, x: float, y: float) -> tuple[float, float]:
        """Returns (latitude, longitude) in deg of a place in m, as clients of 0.9.16 compute it."""
        return client_geolocation(x, y, *(map_origin(self.roads.geo_reference) or CLIENT_ORIGIN))

    @property
    def full_name(self) -> str:
        """The name that clients see, with CARLA's folder in front."""
        return PREFIX + self.name

    @property
    def has_layers(self) -> bool:
        """Whether clients may unload layers of the map."""
        return self.name.endswith(LAYERED)

    def prepare(self) -> None:
        """Makes the navigation mesh now, so that a client's first call does not wait for seconds."""
        _ = self.navigation

    @property
    def navigation(self) -> tuple[str, bytes] | None:
        """Name and content of the navigation mesh; None for maps without pedestrians (K-9)."""
        key = self.roads.content_hash
        if key not in _NAVIGATION:
            if len(_NAVIGATION) >= KEPT_MESHES:
                _NAVIGATION.clear()
            _NAVIGATION[key] = _navigation(self.name, self.roads)
        return _NAVIGATION[key]


def _navigation(name: str, roads: RoadMap) -> tuple[str, bytes] | None:
    """Returns (file name, Recast bytes) of a map's walk mesh; None, with a log line, where it has none."""
    try:
        mesh = walk_mesh(roads)
    except ShapelyError as error:
        log.warning("map %s: no navigation mesh can be made: %s", name, error)
        mesh = None
    content = None if mesh is None else navmesh.pack_mesh(mesh)
    if content is None:
        log.info("map %s has no navigation mesh: AI walkers stay where they are", name)
        return None
    return navmesh.file_name(name, content), content


class MapStore:
    """Finds maps by name: built in, in a folder, or sent by a client."""

    def __init__(self, folder: Path | None = None, scenery: Scenery = Scenery.NONE) -> None:
        """scenery: what is generated beside the roads of all maps."""
        self.folder, self.scenery = folder, scenery
        self._text: str | None = None  # from copy_opendrive_to_file

    def names(self) -> list[str]:
        """Returns all names that can be loaded, bundled ones first, then each also with layers (LAYERED)."""
        plain = self._plain_names()
        return [*plain, *(n + LAYERED for n in plain if n + LAYERED not in plain)]

    def _plain_names(self) -> list[str]:
        """Returns the names of the bundled maps and of the folder's own, without layered variants."""
        own = sorted(p.stem for p in self.folder.glob("*.xodr")) if self.folder else []
        return [*bundled_maps(), *(n for n in own if n not in bundled_maps())]

    def keep_text(self, xodr: str) -> None:
        """Keeps OpenDRIVE text that a client wants to drive on, unread, as map OPENDRIVE_MAP.

        CallError for more than MAX_XODR characters.
        """
        if len(xodr) > MAX_XODR:
            raise CallError(f"OpenDRIVE text must be shorter than {MAX_XODR} characters")
        self._text = xodr

    def load(self, name: str) -> ServedMap:
        """Returns the map of that name with its scenery; CallError `map not found` for no such map.

        Folders before the name do not matter. OPENDRIVE_MAP is the text that a client sent: CallError
        where it is missing or faulty. FileError for a faulty file, ConfigError for a map that has no
        room for a spawn point.
        """
        short = name.rsplit("/", 1)[-1]
        if short == OPENDRIVE_MAP:
            if self._text is None:
                raise CallError("no OpenDRIVE text was sent")
            roads = dress_map(roads_from_text(self._text, short), self.scenery)
            return _make_served_map(short, roads, self._text)
        path = self._path(short)
        if path is None:
            raise CallError(f"map not found: {name}")
        roads = dress_map(load_map(path), self.scenery)
        return _make_served_map(short, roads, path.read_text(encoding="utf-8", errors="replace"))

    def _path(self, name: str) -> Path | None:
        """Returns the file of a map, the folder's own before a bundled one; None for an unknown name."""
        names = self._plain_names()
        if name not in names:
            name = name.removesuffix(LAYERED)
        if self.folder is not None and name in names:
            own = self.folder / f"{name}.xodr"
            if own.is_file():
                return own
        return map_file(name) if name in bundled_maps() else None


def roads_from_text(xodr: str, name: str) -> RoadMap:
    """Returns the baked map of OpenDRIVE text; CallError when it is none."""
    from skidpad.roads.opendrive.bake import bake

    try:
        return RoadMap(bake(xodr.encode(), name, name))
    except SkidpadError as error:
        raise CallError(str(error)) from error


def _make_served_map(name: str, roads: RoadMap, xodr: str) -> ServedMap:
    """Returns the served map with its spawn points; raises ConfigError where it has none."""
    points = tuple(spawn_points(roads))
    if not points:
        raise ConfigError(f"map {name}: no lane is long enough for a spawn point")
    return ServedMap(name, roads, xodr, points)


def spawn_points(roads: RoadMap) -> list[Pose]:
    """Returns poses on driving lanes outside junctions, SPACING m apart, LIFT m above the road."""
    found = []
    table = roads.lanes
    for lane in range(len(table.road)):
        if table.kind[lane] != LaneKind.DRIVING or table.junction[lane] >= 0:
            continue
        s, end = MARGIN, float(table.length[lane]) - MARGIN
        while s <= end:
            place = roads.at(lane, s)
            found.append(place.pose.moved(up=LIFT))
            s += SPACING
    return found
