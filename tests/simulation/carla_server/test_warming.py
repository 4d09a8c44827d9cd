"""A first start: what is compiled by whom, and that clients do not notice."""

from __future__ import annotations

import numba
import pytest

from skidpad.core.geometry import Pose
from skidpad.core.kernels.jit import is_kept
from skidpad.simulation.carla_server import warming
from skidpad.simulation.carla_server.episode import Wanted
from skidpad.simulation.carla_server.options import ServerOptions
from skidpad.simulation.carla_server.served import Served
from skidpad.simulation.carla_server.warming import (
    ProducingHub,
    contact_arguments,
    vehicle_arguments,
)
from skidpad.simulation.world import step


def types(*values):
    return [numba.typeof(v) for v in values]


def test_parts_are_compiled_for_the_types_of_a_step(served: Served) -> None:
    """Else the machine code of the child would be of no use to the server."""
    world = served.episode.moving
    states, bodies, segments, _law, dt, touching = contact_arguments()
    assert types(states, bodies, segments, touching) == types(
        world.states, world.bodies, world.obstacles.segments, world.touching
    )
    (
        states, wheels, params, commands, mu, grade, bank, active, wind, dt, substeps
    ) = vehicle_arguments()  # fmt: skip
    assert types(wheels, params, commands, mu, grade, bank, active) == types(
        world.fleet.wheels,
        world.fleet.params,
        world.rows.commands,
        world.on_wheels.feel,
        world.rows.grade,
        world.rows.bank,
        world.on_wheels.active,
    )
    assert types(wind, dt, substeps) == [numba.float64[:, ::1], numba.float64, numba.int64]


class Child:
    """Stands in for the helper."""

    def __init__(self, options: ServerOptions, say: object) -> None:
        self.heard: list[str] = []

    def hear(self) -> None:
        self.heard.append("parts")

    def tell(self) -> None:
        self.heard.append("tick")

    def finish(self) -> None:
        self.heard.append("sensors")


def test_a_first_start_is_told_and_shared(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(warming, "is_kept", lambda kernel: False)
    monkeypatch.setattr(warming, "Helper", Child)
    said: list[str] = []
    options = ServerOptions(map="straight")
    helper = warming.start_compiling(options, said.append)
    assert helper is not None
    warming.warm_up(options, helper)
    assert helper.heard == ["parts", "tick"]
    assert len(said) == 1
    assert "first start" in said[0]


def test_a_later_start_says_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(warming, "is_kept", lambda kernel: True)
    assert warming.start_compiling(ServerOptions(map="straight"), pytest.fail) is None


def test_sensors_wait_for_the_child_once() -> None:
    served = Served(ServerOptions(map="straight"), ProducingHub())
    calls: list[int] = []
    served.before_sensing = lambda: calls.append(1)
    served.tick()
    assert not calls  # nobody listens
    served.episode.spawn(Wanted("sensor.other.gnss", {}), Pose(0.0, 0.0))
    served.tick()
    served.tick()
    assert calls == [1]


def test_what_has_run_is_kept(served: Served) -> None:
    served.tick()
    assert is_kept(step.advance_undriven)
