"""The actors of a run on the server: spawned, measured, and in the order of their rows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from skidpad.core.errors import BackendError, ConfigError
from skidpad.core.geometry import Pose
from skidpad.core.setup import ActorSetup
from skidpad.core.states import ActorTable
from skidpad.core.vocabulary import ActorKind, Control
from skidpad.roads.queries import RoadMap
from skidpad.simulation.carla import blueprints
from skidpad.simulation.carla.axes import from_vector, to_transform
from skidpad.simulation.world.actors import place_of

LIFT = 0.5  # m above the road at spawning
WALKER_LIFT = 1.2  # m; a walker's origin is its middle
GUESS = (4.5, 1.9, 1.6)  # m, size of a vehicle that is not there yet
PAINT = (160, 160, 160)


@dataclass(slots=True)
class ActorRow:
    """One row. `offset` leads from CARLA's origin of the actor to the footprint's centre."""

    name: str
    type: str  # CARLA's id
    actor: Any  # None: not in the world yet, or not any more
    offset: Pose
    size: tuple[float, float, float]  # m: length, width, height
    kind: ActorKind
    rgb: tuple[int, int, int]
    factor: float = 1.0  # desired speed over the limit
    autopilot: bool = False
    rested: Pose | None = None  # where it was when it left the world

    @property
    def is_vehicle(self) -> bool:
        """Whether it has wheels and a control."""
        return self.type.startswith("vehicle.")

    def origin(self, pose: Pose) -> Pose:
        """Returns the pose of CARLA's origin when the footprint's centre shall be at `pose`."""
        o = self.offset
        return pose.moved(forward=-o.x, left=-o.y, up=-o.z)

    def footprint(self, origin: Pose) -> Pose:
        """Returns the pose of the footprint's centre for a pose of CARLA's origin."""
        o = self.offset
        if o.x == o.y == 0.0:
            return replace(origin, z=origin.z + o.z)
        return replace(
            origin @ Pose(o.x, o.y, o.z), roll=origin.roll, pitch=origin.pitch, yaw=origin.yaw
        )


def spawn_setup(carla: Any, world: Any, map: RoadMap, setup: ActorSetup) -> ActorRow:
    """Spawns an actor of the set-up and returns its row; BackendError when something stands in its place.

    ConfigError for an unknown type, or where a type without wheels is to drive by autopilot.
    """
    blueprint = blueprints.find(world.get_blueprint_library(), setup.type)
    if blueprint.has_attribute("role_name"):
        blueprint.set_attribute("role_name", "hero" if setup.name == "ego" else setup.name)
    if setup.rgb is not None and blueprint.has_attribute("color"):
        blueprint.set_attribute("color", ",".join(str(v) for v in setup.rgb))
    pose = place_of(map, setup.place)
    actor = try_spawn(carla, world, blueprint, pose)
    if actor is None:
        raise BackendError(
            f"CARLA refused to spawn {setup.name} ({blueprint.id}) at "
            f"({pose.x:.1f}, {pose.y:.1f}, {pose.z:.1f}): the place is taken"
        )
    player = make_row(setup.name, actor)
    player.autopilot = setup.driver is Control.AUTOPILOT and player.is_vehicle
    if setup.driver is Control.AUTOPILOT and not player.is_vehicle:
        raise ConfigError(f"{setup.name}: a {setup.type} has no autopilot")
    return player


def try_spawn(carla: Any, world: Any, blueprint: Any, pose: Pose) -> Any:
    """Spawns an actor a little above `pose` and returns it; None when the place is taken."""
    lift = WALKER_LIFT if blueprint.id.startswith("walker.") else LIFT
    if blueprint.id.startswith("static."):
        lift = 0.0
    return world.try_spawn_actor(blueprint, to_transform(carla, pose.moved(up=lift)))


def make_row(name: str, actor: Any) -> ActorRow:
    """Returns a row for a spawned actor: its size and origin from its bounding box (D-012)."""
    box = actor.bounding_box
    centre, half = box.location, box.extent
    text = actor.attributes.get("color")
    rgb = tuple(int(v) for v in text.split(",")) if text else PAINT
    return ActorRow(
        name=name,
        type=actor.type_id,
        actor=actor,
        offset=Pose(centre.x, from_vector(centre)[1] + 0.0, centre.z - half.z),
        size=(2.0 * half.x, 2.0 * half.y, 2.0 * half.z),
        kind=blueprints.kind_of(actor),
        rgb=(rgb[0], rgb[1], rgb[2]),
    )


def make_row_in_waiting(name: str, blueprint: Any) -> ActorRow:
    """Returns a row for a vehicle that enters later, of a guessed size (A-209)."""
    return ActorRow(name, blueprint.id, None, Pose(0.0, 0.0), GUESS, ActorKind.CAR, PAINT)


def table_of(players: Sequence[ActorRow]) -> ActorTable:
    """Returns the table of what does not change about the actors: names, types, sizes."""
    sizes = np.array([p.size for p in players])
    return ActorTable(
        names=tuple(p.name for p in players),
        types=tuple(p.type for p in players),
        kind=np.array([p.kind for p in players], dtype=np.uint8),
        length=sizes[:, 0].copy(),
        width=sizes[:, 1].copy(),
        height=sizes[:, 2].copy(),
        rgb=np.array([p.rgb for p in players], dtype=np.uint8),
    )
