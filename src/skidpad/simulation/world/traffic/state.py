"""What drivers are, do and see: arrays of records, so that few arrays cross each kernel call."""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats, Ints32
from skidpad.simulation.world.placed import Places
from skidpad.simulation.world.traffic.care import Care
from skidpad.simulation.world.traffic.network import Network
from skidpad.simulation.world.traffic.occupancy import Occupancy
from skidpad.simulation.world.traffic.path import PATH


class Held(IntEnum):
    """What is close ahead of a driver, and would explain that it stands."""

    NOTHING = 0
    LEADER = 1
    MERGING = 2  # traffic of another branch
    LIGHT = 3
    ROAD_END = 4
    RIGHT_OF_WAY = 5  # of others that come
    ZEBRA = 6
    STOP_SIGN = 7  # until it has stopped
    EXIT_TAKEN = 8  # a queue leaves no room behind the junction
    AREA_TAKEN = 9  # another stands on the way through the junction


CHANGE_TIME = 5.0  # s for one lane; naturalistic mean 4 to 6 s (Toledo and Zohar 2007)

DRIVER = np.dtype(
    [
        ("active", "?"),
        ("at", "i4"),  # point of the path's first lane beside the vehicle
        ("turns", "i4"),  # lanes entered so far
        ("key", "u8"),  # of the driver's own draws
        ("s", "f8"),  # m along the path's first lane
        ("offset", "f8"),  # m left of it
        ("heading", "f8"),  # rad, of the lane there
        ("shift", "f8"),  # m, offset at which the present lane change began
        ("change", "f8"),  # s since it began
        ("cap", "f8"),  # m/s, limit that holds until the first sign; inf behind it
        ("v_desired", "f8"),  # m/s, that limits and bends ahead allow
        ("target", "f8"),  # m/s^2, acceleration asked for
        ("trim", "f8"),  # m/s^2, integral of the pedal control
        ("halted", "i4"),  # junction before which it has made its stop, -1: none
        ("waited", "f8"),  # s for others at a junction
        ("stood", "f8"),  # s before a line, kept until the junction behind it is passed
        ("stuck", "f8"),  # s stopped, off the lane or wrong-way without a cause ahead
        ("held", "i4"),  # Held: what is nearest of that for which it slows down or stands
        ("blocker", "i4"),  # row of the actor that is the cause, -1: none
    ],
    align=True,
)
TRAIT = np.dtype(
    [
        ("factor", "f8"),  # desired speed over the limit
        ("headway", "f8"),  # s, on fast roads
        ("headway_town", "f8"),  # s, on others
        ("is_exact", "?"),  # its steady gap is its headway, else longer the less it is held up
        ("a_max", "f8"),  # m/s^2
        ("a_curve", "f8"),  # m/s^2, lateral acceleration accepted in bends
        ("room", "f8"),  # m to the new follower with which a lane is entered
        ("imposed", "f8"),  # m/s^2 of braking that others may have to do for it
        ("eager", "f8"),  # factor on changes of lane without a reason
        ("wheelbase", "f8"),  # m
        ("steer_angle", "f8"),  # rad at the road wheels for steer 1
        ("understeer", "f8"),  # s^2/m, extra wheel angle per lateral acceleration
        ("carried", "f8"),  # share of the weight on the driven wheels
        ("a_drive", "f8"),  # m/s^2 at full throttle, low speed
        ("p_drive", "f8"),  # W/kg
        ("a_brake", "f8"),  # m/s^2 at full brake
        ("drag", "f8"),  # 1/m, air drag over mass
        ("engine_drag", "f8"),  # m/s^2 at closed throttle
        ("rolling", "f8"),  # m/s^2, rolling and engine drag
    ],
    align=True,
)


class Drivers(NamedTuple):
    """n drivers: what they do, what they are like, and where they go. Row 0 is the ego."""

    state: NDArray[np.void]  # (n,) DRIVER
    trait: NDArray[np.void]  # (n,) TRAIT
    path: Ints32  # (n, PATH) lanes to follow, the present one first
    aside: Ints32  # (4,) room for the lanes of another way


class Streets(NamedTuple):
    """What drivers know of the map, and who walks over its zebras."""

    net: Network
    entry: NDArray[np.void]  # (L,) ENTRY of `priority`
    conflict: NDArray[np.void]  # CONFLICT
    zebra: NDArray[np.void]  # ZEBRA
    zebras: Floats  # (Z, 5) x, y, heading, half length along it, half width
    walkers: NDArray[np.int64]  # rows of actors to whom drivers yield at zebras
    busy: NDArray[np.bool_]  # (Z,) somebody walks over the zebra


class View(NamedTuple):
    """Everything that drivers see in one tick."""

    streets: Streets
    occ: Occupancy
    placed: Places
    lights: NDArray[np.uint8]  # (K,) LightState by signal row
    tick: int
    dt: float
    free_choice: bool  # branches are drawn instead of taking the straightest
    care: Care  # what drivers know of weather


def drivers(n: int) -> Drivers:
    """Returns the state of n drivers, all inactive."""
    state = np.zeros(n, dtype=DRIVER)
    state["change"] = state["cap"] = np.inf
    state["halted"] = state["blocker"] = -1
    return Drivers(
        state,
        np.zeros(n, dtype=TRAIT),
        np.full((n, PATH), -1, dtype=np.int32),
        np.full(4, -1, dtype=np.int32),
    )
