"""Boxes of actors: how large a new one is, and whether there is room for it."""

from __future__ import annotations

import numpy as np

from skidpad.core.geometry import Pose
from skidpad.physics.overlap import Boxes, box_box, corners_room
from skidpad.simulation.carla_server.actors.catalogue import Family
from skidpad.simulation.carla_server.actors.registry import Actor
from skidpad.simulation.carla_server.protocol.wire import Vector
from skidpad.simulation.world.rows import Newcomer, Shape
from skidpad.simulation.world.world import World

TOLERANCE = 0.02  # m by which boxes may overlap when spawning
ROLLED_OVER = 0.2  # m: lower things pass under bumpers, and wheels roll over them (assumed)
CENTIMETRE = 0.01  # m, unit of a trigger's extent


def give_box(actor: Actor) -> None:
    """Sets centre and half extents of a new actor's box, by blueprint or, of a trigger, attributes.

    Vehicles and props stand on their origin, others have it in their middle.
    """
    length, width, height = actor.blueprint.size
    actor.half = (length / 2.0, width / 2.0, height / 2.0)
    if actor.family in (Family.VEHICLE, Family.PROP):
        actor.centre = (0.0, 0.0, height / 2.0)
    if actor.family is Family.TRIGGER:
        x, y, z = (CENTIMETRE * float(actor.attributes[f"extent_{axis}"]) for axis in "xyz")
        actor.half = (x, y, z)


def body_of(actor: Actor) -> Newcomer:
    """Returns the body of a walker or prop for the moving world, which nothing pushes."""
    length, width, height = (2.0 * v for v in actor.half)
    shape = Shape(actor.blueprint.kind, length, width, height, float("inf"))
    return Newcomer(shape, type=actor.blueprint.id)


def is_flat(actor: Actor) -> bool:
    """Returns whether the actor is a prop so low that vehicles roll over it."""
    return actor.family is Family.PROP and 2.0 * actor.half[2] < ROLLED_OVER


def is_taken(moving: World, feet: Pose, half: Vector) -> bool:
    """Returns whether a body stands where a box of half extents `half` shall stand, feet at `feet`.

    Overlaps of less than TOLERANCE do not count.
    """
    s, b = moving.states, moving.bodies
    own = [max(0.0, v - TOLERANCE) for v in half[:2]]
    boxes = Boxes(
        np.append(s.x, feet.x),
        np.append(s.y, feet.y),
        np.append(s.yaw, feet.yaw),
        np.append(b.half_length, own[0]),
        np.append(b.half_width, own[1]),
        corners_room(),
    )
    far = own[0] + own[1] + b.half_length + b.half_width
    near = (np.abs(s.x - feet.x) < far) & (np.abs(s.y - feet.y) < far)
    low, high = feet.z + TOLERANCE, feet.z + 2.0 * half[2] - TOLERANCE
    level = (s.z < high) & (s.z + b.height > low)
    return any(box_box(boxes, len(s.x), i)[0] for i in np.flatnonzero(near & level).tolist())
