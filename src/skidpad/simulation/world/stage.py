"""The world of a set-up: its actors enter, its traffic is engaged, the ego's events are noted."""

from __future__ import annotations

from skidpad.core.errors import ConfigError
from skidpad.core.setup import Setup, TrafficSetup
from skidpad.core.vocabulary import Bodywork, Control, Scenery
from skidpad.physics.grip import Road, road_of
from skidpad.roads.bundled import load_map
from skidpad.roads.queries import RoadMap
from skidpad.scenery.dressing import dress_map
from skidpad.simulation.world.actors import Role, cast_of, place_of
from skidpad.simulation.world.conditions import Conditions
from skidpad.simulation.world.interventions import set_collides
from skidpad.simulation.world.lights import Lights
from skidpad.simulation.world.patches import LaneFrictions, Patches
from skidpad.simulation.world.sheet_flow import SheetFlow
from skidpad.simulation.world.touch import EGO, ContactBook
from skidpad.simulation.world.traffic.care import care_of
from skidpad.simulation.world.traffic.manager import Traffic
from skidpad.simulation.world.world import World


def build_world(setup: Setup, seed: int) -> World:
    """Returns the world of a set-up at the beginning of a run: actors placed, traffic engaged.

    ConfigError or FileError for a set-up that cannot be.
    """
    map = dress_map(load_map(setup.map), setup.scenery)
    roles = cast_of(map, setup, seed)
    road = road_of(setup)
    grip = road.params()
    conditions = Conditions(
        seed=seed,
        dt=setup.dt,
        grip=grip,
        stability=setup.stability,
        anti_lock=setup.anti_lock,
        stability_control=setup.stability_control,
        roll_over=setup.roll_over,
        wind=setup.wind,
        wakes=setup.wakes,
    )
    world = World(map, Lights.build_pretimed(map, seed, setup.dt), conditions)
    traffic = setup.traffic or TrafficSetup(vehicles=0)
    drivers = Traffic(map, traffic, seed, care_of(setup, traffic.slow_in_weather))
    world.let_drive(drivers)
    world.wheel_grip.patches = patches_of(map, setup, road)
    drawn = setup.scenery is Scenery.FULL or setup.bodywork is Bodywork.SHAPED
    paints = seed if drawn else None
    ids = world.enter([role.newcomer(i, paints) for i, role in enumerate(roles)])
    world.lay(road)
    world.book = ContactBook(world.obstacles.names, setup.dt)
    for id, role in zip(ids, roles, strict=True):
        set_collides(world, id, role.actor.collides)
        if role.late:
            drivers.await_room(id, role.factor)
        elif role.reserve:
            drivers.keep_back(id, role.factor)
        else:
            row = world.row(id)
            world.put(row, place_of(map, role.actor.place), role.actor.speed)
            world.states.present[row] = role.actor.present
    world.settle()
    for id, role in zip(ids, roles, strict=True):
        if id != EGO and not (role.late or role.reserve) and role.actor.driver is Control.AUTOPILOT:
            _engage(world, drivers, id, role)
    world.feel_grip()
    return world


def patches_of(map: RoadMap, setup: Setup, road: Road) -> Patches | None:
    """Returns the patches and materials of a set-up on its map; None where there are none.

    road: without them. ConfigError for what does not fit the map.
    """
    lanes = lane_frictions(setup)
    if not (setup.patches or lanes or setup.sheet_flow):
        return None
    flow = SheetFlow(map) if setup.sheet_flow else None
    return Patches(map, setup.patches, road, lanes, flow)


def lane_frictions(setup: Setup) -> LaneFrictions:
    """Returns what the map's materials make of the friction that the set-up gives every lane.

    {} where the set-up does not ask; ConfigError where the map says none.
    """
    if setup.material_base is None:
        return {}
    from skidpad.roads.opendrive.materials import read_materials  # lxml comes with it

    found: LaneFrictions = {}
    for m in read_materials(setup.map):
        stretch = (m.s_from, m.s_to, m.friction / setup.material_base)
        found.setdefault((m.road, m.lane), []).append(stretch)
    if not found:
        raise ConfigError(f"lane_material: map {setup.map} says no <material friction>")
    return found


def _engage(world: World, traffic: Traffic, id: int, role: Role) -> None:
    """Gives a vehicle to the traffic's autopilot; raises ConfigError off the driving lanes."""
    i, actor = world.row(id), role.actor
    if i >= world.wheeled:
        raise ConfigError(f"{actor.name}: a {actor.type} has no autopilot")
    place = world.placed[i]
    if place["lane"] < 0:
        raise ConfigError(f"{actor.name} has an autopilot but stands on no driving lane")
    traffic.engage(i, int(place["lane"]), float(place["s"]), role.factor)
