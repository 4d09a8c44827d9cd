"""A world in which no actor is yet, and actors that tests let enter."""

import numpy as np

from skidpad.core.vocabulary import ActorKind, GripModel
from skidpad.core.weather import Weather
from skidpad.physics.grip import grip_params
from skidpad.physics.types import vehicle_type
from skidpad.roads.bundled import load_map
from skidpad.simulation.world.conditions import Conditions
from skidpad.simulation.world.lights import Lights
from skidpad.simulation.world.rows import Newcomer, Shape
from skidpad.simulation.world.world import World

MAP = load_map("figure8")
START = MAP.place(MAP.ego_start).pose
CAR = Newcomer(vehicle_type("mini_cooper_s"))
POST = Newcomer(Shape(ActorKind.PROP, 0.5, 0.5, 1.0, float("inf")))


def empty(**conditions):
    grip = grip_params(Weather(), GripModel.NONE, 0.9)
    return World(MAP, Lights(MAP), Conditions(grip=grip, road_noise=0.0, **conditions))


def motion(world, id):
    return np.array([column[world.row(id)] for column in world.states])
