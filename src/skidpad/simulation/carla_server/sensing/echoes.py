"""A radar with an equation, noise and clutter, with `radar_model` physical.

The model is that of runs (`sensors.physical_radar`), whose first actor carries the radar: here a row
before the others, which stands where the carrier does, and the carrier itself is not there. A radar without
a carrier stands over the ground below it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from skidpad.core.frames import RadarPoints
from skidpad.core.geometry import Pose
from skidpad.core.specs import RadarSpec
from skidpad.core.states import ActorStates, ActorTable
from skidpad.core.vocabulary import ActorKind, RadarModel, RangeModel
from skidpad.core.weather import Weather
from skidpad.sensors.physical_radar.cells import RANGES
from skidpad.sensors.physical_radar.radar import PhysicalRadar
from skidpad.sensors.physical_radar.setup import RANGE_STEP
from skidpad.simulation.carla_server.actors.registry import Actor
from skidpad.simulation.carla_server.protocol import wire
from skidpad.simulation.carla_server.sensing.additions import read_addition
from skidpad.simulation.carla_server.sensing.surroundings import Pictured, Surroundings
from skidpad.simulation.carla_server.vehicles.falling import ground_below

NEAREST, FARTHEST = 1.0, (RANGES - 1) * RANGE_STEP  # m of range for which there are cells


def make_echoes(actor: Actor, spec: RadarSpec, seed: int) -> Echoes | None:
    """Returns a physical radar, None for any other; WireError for unusable attributes."""
    made = Echoes(actor, spec, seed)
    if read_addition(actor, "radar_model") is not RadarModel.PHYSICAL:
        return None
    if not NEAREST <= spec.range <= FARTHEST:
        raise wire.WireError(
            f"{actor.blueprint.id}: range must be between {NEAREST:g} and {FARTHEST:g} m with "
            f"radar_model physical, got {spec.range:g}"
        )
    return made


class Echoes:
    """One physical radar; `measure` once per reading."""

    def __init__(self, actor: Actor, spec: RadarSpec, seed: int) -> None:
        """seed: of the server. WireError for attributes that cannot be used."""
        self._spec, self._seed = replace(spec, id=actor.attributes["noise_seed"]), seed
        self._feels_air = read_addition(actor, "range_model") is RangeModel.PHYSICAL
        self._multipath = read_addition(actor, "radar_multipath")
        self._interference = read_addition(actor, "radar_interference")
        self._output = read_addition(actor, "radar_output")
        self._scene: Pictured | None = None
        self._weather: Weather | None = None
        self._radar: PhysicalRadar | None = None

    def measure(self, around: Surroundings, actor: Actor, reading: int, dt: float) -> RadarPoints:
        """Returns the rows of a reading `dt` s after the last one, valid until the next."""
        scene, row = around.picture(), around.carrier_row(actor)
        if row >= 0:
            carrier = around.actors.alive[actor.parent]
            base = scene.states.pose(row)
            mount = replace(actor.mount, z=actor.mount.z + carrier.lift)
        else:
            base, mount = _over_ground(around, actor)
        radar = self._radar_in(scene, mount, around.weather if self._feels_air else None)
        radar.dt = dt
        return radar.measure(reading, _states_with(base, scene.states, row))

    def _radar_in(self, scene: Pictured, mount: Pose, weather: Weather | None) -> PhysicalRadar:
        """Returns the radar, which knows this scene, mounting and weather (None: it does not act)."""
        radar = self._radar
        if radar is None or self._scene is not scene:
            roadside, table = scene.roads.roadside, _table_with(scene.bodies)
            if radar is None:
                self._radar = radar = PhysicalRadar(
                    self._spec, roadside, table, self._seed, multipath=self._multipath,
                    output=self._output, interference=self._interference,
                )  # fmt: skip
            else:
                radar.surround(roadside, table)
            self._scene = scene
        if radar.spec.mount != mount or self._weather is not weather:
            radar.spec, self._weather = replace(radar.spec, mount=mount), weather
            radar.change(weather)
        return radar


def _over_ground(around: Surroundings, actor: Actor) -> tuple[Pose, Pose]:
    """Returns the place on the ground below a sensor, and its mounting there."""
    p = around.actors.pose(actor)
    ground = ground_below(around.map.roads, p.x, p.y, p.z)
    z = p.z if ground is None else min(ground, p.z)
    return Pose(p.x, p.y, z), Pose(0.0, 0.0, p.z - z, p.roll, p.pitch, p.yaw)


def _table_with(others: ActorTable) -> ActorTable:
    """Returns the actors with a row for the carrier before them."""
    return ActorTable(
        names=("carrier", *others.names),
        types=("carrier", *others.types),
        kind=np.insert(others.kind, 0, ActorKind.PROP),
        length=np.insert(others.length, 0, 1.0),
        width=np.insert(others.width, 0, 1.0),
        height=np.insert(others.height, 0, 1.0),
        rgb=np.insert(others.rgb, 0, 0, axis=0),
    )


def _states_with(base: Pose, others: ActorStates, carrier: int) -> ActorStates:
    """Returns the states with a row before them: at `base`, moving as row `carrier` does, -1: at rest.

    That row of the others is not present.
    """
    if carrier >= 0:
        states = ActorStates._make(np.insert(column, 0, column[carrier]) for column in others)
        states.present[carrier + 1] = False
    else:
        states = ActorStates._make(np.insert(column, 0, 0) for column in others)
    states.x[0], states.y[0], states.z[0] = base.x, base.y, base.z
    states.roll[0], states.pitch[0], states.yaw[0] = base.roll, base.pitch, base.yaw
    states.present[0] = True
    return states
