"""Kernels before clients wait: loaded from the disk, or compiled when this machine has none yet.

At a first start two processes compile: this one what a tick needs, a child what takes longest in it
and then the sensors. The server is ready when ticks are; a client that listens to a sensor before these are
compiled waits for them. The child then compiles the weather and radio effects of sensors, for which
nothing waits, and ends. A later start compiles in a child what is missing of them.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
from collections.abc import Callable
from contextlib import suppress
from multiprocessing.connection import Connection
from typing import Any

import numpy as np

from skidpad.core.geometry import Pose
from skidpad.core.kernels.jit import is_kept, kernel_cache
from skidpad.core.setup import DT
from skidpad.physics.contact import CONTACT_LAW, Contacts, resolve_contacts
from skidpad.physics.fleet import Fleet
from skidpad.physics.segments import static_segments
from skidpad.physics.vehicle import step_vehicles
from skidpad.sensors.physical_radar.radar import find_detections
from skidpad.sensors.pictures.degradation import degrade
from skidpad.sensors.pictures.film import grade, replace_levels
from skidpad.sensors.pictures.fringes import split_colours
from skidpad.sensors.pictures.lens import show_drops
from skidpad.sensors.pictures.lens_distortion import resample
from skidpad.sensors.pictures.motion_blur import smear
from skidpad.sensors.pictures.spray import veil_by_spray
from skidpad.sensors.ranging.lidar_returns import find_returns
from skidpad.sensors.raster import rays
from skidpad.simulation.carla_server.actors.catalogue import Family
from skidpad.simulation.carla_server.actors.effects import load_acting
from skidpad.simulation.carla_server.actors.registry import Attachment
from skidpad.simulation.carla_server.episode import Wanted
from skidpad.simulation.carla_server.options import ServerOptions
from skidpad.simulation.carla_server.protocol.streams import StreamHub
from skidpad.simulation.carla_server.sensing.gbuffers import (
    ColourCamera,
    Texture,
    stream_of,
)
from skidpad.simulation.carla_server.sensing.producers import PRODUCERS
from skidpad.simulation.carla_server.served import Served
from skidpad.simulation.carla_server.weather import PACKED
from skidpad.simulation.world import step
from skidpad.simulation.world.rows import Rows, bodies_of

CONTEXT = multiprocessing.get_context("spawn")
LIMIT = 600.0  # s that the child may take
EFFECTS = (
    find_detections, find_returns, show_drops, veil_by_spray, degrade, grade, replace_levels,
    split_colours, resample, smear,
)  # fmt: skip
LENS = {"lens_circle_multiplier": "3.0"}
OPTICS = {
    "sensor.camera.rgb": LENS
    | {"gamma": "2.0", "chromatic_aberration_intensity": "0.5", "motion_blur_intensity": "1.0"},
    "sensor.camera.dvs": {"temp": "5000.0"},
    "sensor.camera.optical_flow": LENS,
}  # by which a client's cameras run their kernels, with pixels of four and of eight bytes
STORM = {
    "precipitation": 100.0,
    "precipitation_deposits": 100.0,
    "wetness": 100.0,
    "fog_density": 30.0,
    "sun_altitude_deg": -20.0,
}  # in which every effect acts
BEHIND = Pose(-15.0, 0.0)  # of a lead, in whose spray a car drives
FAST = 20.0  # m/s of both
SMALL_MAP = "straight"
SMALL = {"image_size_x": "64", "image_size_y": "48"}  # px
Say = Callable[[str], object]


class ProducingHub(StreamHub):
    """Produces all streams, though no client listens."""

    def has_listeners(self, stream: int) -> bool:
        """Returns True for every stream that exists."""
        return self.exists(stream)


def start_compiling(options: ServerOptions, say: Say) -> Helper | None:
    """Returns a helper that compiles beside this process, after saying so; None when all is kept.

    To be called before anything is made of a map, for that compiles too. Effects that are not kept are
    compiled by a child for which nothing waits.
    """
    if is_kept(step.advance_undriven) and is_kept(rays.cast):
        if not all(map(is_kept, EFFECTS)):
            CONTEXT.Process(target=compile_effects, args=(options,), daemon=True).start()
        return None
    say(f"first start: compiling, which is kept in {kernel_cache()}")
    return Helper(options, say)


def warm_up(options: ServerOptions, helper: Helper | None) -> None:
    """Makes ticks ready and, unless a helper makes them so, sensors; returns when they are."""
    if helper is None:
        a_tick(options, sensors=True)
    else:
        a_tick(options, sensors=False, before_step=helper.hear)
        helper.tell()


def a_tick(
    options: ServerOptions, sensors: bool, before_step: Callable[[], object] = lambda: None
) -> None:
    """Runs a tick of a world that is thrown away, with a car and, if asked, every sensor on it.

    before_step: called before the parts of a step are needed.
    """
    served = Served(options, ProducingHub())
    episode = served.episode
    name = next(id for id, b in served.stock.catalogue.items() if b.family is Family.VEHICLE)
    # compiled while the helper compiles parts of a step, for which this process then waits
    episode.moving.feel_grip()
    episode.moving.signs()
    episode.moving.map.project(0.0, 0.0, 0.0)
    before_step()
    car = episode.spawn(Wanted(name, {}), episode.map.spawn_points[0])
    for kind in PRODUCERS if sensors else ():
        actor = episode.attach(Wanted(kind, SMALL), Pose(0.0, 0.0, 2.0), car.id, Attachment.RIGID)
        sensor = episode.sensors.of(actor.id)
        if sensor is not None and isinstance(sensor.equipment, ColourCamera):
            sensor.equipment.gbuffers = True
            stream_of(sensor, Texture.AMBIENT_OCCLUSION, served.hub)
    served.tick()


def compile_effects(options: ServerOptions) -> None:
    """Compiles the weather and radio effects of sensors, when nothing else wants the processor.

    It runs ticks of a world that is thrown away: a car in the spray of another one, at night, in rain
    and fog, with a sensor per blueprint that has effects, and all of them on.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the server's
    if hasattr(os, "nice"):  # not on Windows
        os.nice(19)
    run_effects(options)


def run_effects(options: ServerOptions) -> None:
    """Runs the ticks by which `compile_effects` compiles, on a small map, whatever the server's is."""
    on_small = ServerOptions(map=SMALL_MAP, scenery=options.scenery, bodywork=options.bodywork)
    served = Served(on_small, ProducingHub())
    episode = served.episode
    values = episode.sky.values | STORM
    episode.sky.apply([*(values[name] for name in PACKED), 0.0])
    name = next(id for id, b in served.stock.catalogue.items() if b.family is Family.VEHICLE)
    start = episode.map.spawn_points[len(episode.map.spawn_points) // 2]
    lead, car = (episode.spawn(Wanted(name, {}), place) for place in (start, start @ BEHIND))
    for one in (lead, car):
        vx, vy = FAST * np.cos(start.yaw), FAST * np.sin(start.yaw)
        episode.vehicles.set_velocity(one.id, (float(vx), float(vy), 0.0))
    mount = Pose(2.4, 0.0, 0.5)
    for kind, names in load_acting().additions.items():
        known = served.stock.blueprint(kind).attributes
        strongest = {name: known[name].recommended[-1] for name in names}
        episode.attach(Wanted(kind, SMALL | strongest), mount, car.id, Attachment.RIGID)
    for kind, given in OPTICS.items():
        episode.attach(Wanted(kind, SMALL | given), mount, car.id, Attachment.RIGID)
    for _ in range(3):
        served.tick()


class Helper:
    """The child that compiles; whatever becomes of it, the server can do without."""

    def __init__(self, options: ServerOptions, say: Say) -> None:
        self._say = say
        self._pipe, there = CONTEXT.Pipe()
        self._process = CONTEXT.Process(target=_help, args=(there, options), daemon=True)
        self._process.start()
        there.close()

    def hear(self) -> None:
        """Waits until the next part is on the disk, LIMIT s at most: of a step, then the sensors."""
        with suppress(EOFError, OSError):
            if self._pipe.poll(LIMIT):
                self._pipe.recv()

    def tell(self) -> None:
        """Tells the child that the rest of a tick is on the disk, and says so."""
        with suppress(OSError):
            self._pipe.send(None)
        self._say("ticks are compiled; sensors are being compiled beside the first of them")

    def finish(self) -> None:
        """Waits until the sensors are compiled, LIMIT s at most, and not for their effects."""
        self.hear()


def _help(pipe: Connection, options: ServerOptions) -> None:
    """Compiles the parts of a tick, on demand a tick with sensors, and effects; reports the first two."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the server's
    compile_parts()
    pipe.send(None)
    try:
        pipe.recv()
    except EOFError:  # the server is gone
        return
    a_tick(options, sensors=True)
    with suppress(OSError):
        pipe.send(None)
    compile_effects(options)


def vehicle_arguments() -> tuple[Any, ...]:
    """Returns what `step_vehicles` is called with for no vehicles."""
    rows = Rows.of([], 0)
    fleet = Fleet([], DT, states=rows.states)
    active = np.zeros(0, dtype=np.bool_)
    return (
        rows.states, fleet.wheels, fleet.params, rows.commands, fleet.feel, rows.grade, rows.bank,
        active, np.zeros((0, 2)), DT, 1,
    )  # fmt: skip


def contact_arguments() -> tuple[Any, ...]:
    """Returns what `resolve_contacts` is called with for no bodies and no obstacles."""
    nothing = static_segments(np.zeros((0, 4)), np.zeros(0), np.zeros(0))
    return Rows.of([], 0).states, bodies_of([]), nothing, CONTACT_LAW, DT, Contacts.room()


def compile_parts() -> None:
    """Compiles the kernels of vehicle motion and of contacts by running them on no actors.

    Machine code goes to the disk by the types of the arguments, so these are those of a step.
    """
    resolve_contacts(*contact_arguments())
    step_vehicles(*vehicle_arguments())
