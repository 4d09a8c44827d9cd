"""Kernels before clients wait: loaded from the disk, or compiled when this machine has none yet.

At a first start two processes compile: this one what a tick needs, a child what takes longest in it
and then the sensors. The server is ready when ticks are; a client that listens to a sensor before the child
has ended waits for it.
"""

from __future__ import annotations

import multiprocessing
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
from skidpad.sensors.raster import rays
from skidpad.simulation.carla_server.actors.catalogue import Family
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
from skidpad.simulation.world import step
from skidpad.simulation.world.rows import Rows, bodies_of

CONTEXT = multiprocessing.get_context("spawn")
LIMIT = 600.0  # s that the child may take
Say = Callable[[str], object]


class ProducingHub(StreamHub):
    """Produces all streams, though no client listens."""

    def has_listeners(self, stream: int) -> bool:
        """Returns True for every stream that exists."""
        return self.exists(stream)


def start_compiling(options: ServerOptions, say: Say) -> Helper | None:
    """Returns a helper that compiles beside this process, after saying so; None when all is kept.

    To be called before anything is made of a map, for that compiles too.
    """
    if is_kept(step.advance_undriven) and is_kept(rays.cast):
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
    small = {"image_size_x": "64", "image_size_y": "48"}
    for kind in PRODUCERS if sensors else ():
        actor = episode.attach(Wanted(kind, small), Pose(0.0, 0.0, 2.0), car.id, Attachment.RIGID)
        sensor = episode.sensors.of(actor.id)
        if sensor is not None and isinstance(sensor.equipment, ColourCamera):
            sensor.equipment.gbuffers = True
            stream_of(sensor, Texture.AMBIENT_OCCLUSION, served.hub)
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
        """Waits until the parts of a step are on the disk, LIMIT s at most."""
        with suppress(EOFError, OSError):
            if self._pipe.poll(LIMIT):
                self._pipe.recv()

    def tell(self) -> None:
        """Tells the child that the rest of a tick is on the disk, and says so."""
        with suppress(OSError):
            self._pipe.send(None)
        self._say("ticks are compiled; sensors are being compiled beside the first of them")

    def finish(self) -> None:
        """Waits until the sensors are compiled, LIMIT s at most."""
        self._process.join(LIMIT)


def _help(pipe: Connection, options: ServerOptions) -> None:
    """Compiles the parts of a tick in a helper process, reports that, and then runs one tick on demand."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the server's
    compile_parts()
    pipe.send(None)
    try:
        pipe.recv()
    except EOFError:  # the server is gone
        return
    a_tick(options, sensors=True)


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
