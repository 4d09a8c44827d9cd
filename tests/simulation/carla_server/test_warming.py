"""A first start: what is compiled by whom, and that clients do not notice."""

from __future__ import annotations

import gc

import numba
import pytest
from numba.core.registry import CPUDispatcher

from skidpad.core.geometry import Pose
from skidpad.core.kernels.jit import is_kept
from skidpad.simulation.carla_server import warming
from skidpad.simulation.carla_server.actors.registry import Attachment
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


def compiled() -> dict[str, int]:
    """How many versions of each kernel this process has."""
    kernels = [one for one in gc.get_objects() if isinstance(one, CPUDispatcher)]
    return {f"{k.py_func.__module__}.{k.py_func.__name__}": len(k.signatures) for k in kernels}


@pytest.mark.parametrize(
    "weather", [{"precipitation": 80.0, "wetness": 90.0, "sun_altitude_deg": 45.0}, {}]
)
def test_effects_of_sensors_are_compiled_before_a_client_uses_them(
    weather: dict[str, float],
) -> None:
    options = ServerOptions(map="straight")
    warming.a_tick(options, sensors=True)
    warming.run_effects(options)
    before = compiled()
    served = Served(options, ProducingHub())
    episode = served.episode
    values = episode.sky.values | weather
    episode.sky.apply([*values.values(), 0.0])
    car = episode.spawn(Wanted("vehicle.audi.tt", {}), episode.map.spawn_points[3])
    for kind, attributes in (
        ("sensor.other.radar", {"radar_model": "physical", "radar_output": "detections"}),
        ("sensor.other.radar", {"radar_model": "physical", "range_model": "physical"}),
        ("sensor.lidar.ray_cast", {"lidar_model": "physical", "range_model": "physical"}),
        ("sensor.camera.rgb", {"camera_effect": "true", "camera_drops": "true"}),
        ("sensor.camera.rgb", {"camera_haze": "true", "camera_spray": "true"}),
        ("sensor.camera.depth", {"range_model": "physical"}),
    ):
        episode.attach(Wanted(kind, attributes), Pose(0.0, 0.0, 2.0), car.id, Attachment.RIGID)
    for _ in range(3):
        served.tick()
    assert compiled() == before


def test_effects_that_are_missing_are_compiled_at_a_later_start(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    started: list[object] = []

    class Process:
        def __init__(self, target: object, args: object, daemon: bool) -> None:
            assert daemon
            self.target = target

        def start(self) -> None:
            started.append(self.target)

    missing = warming.EFFECTS[0]
    monkeypatch.setattr(warming, "is_kept", lambda kernel: kernel is not missing)
    monkeypatch.setattr(warming.CONTEXT, "Process", Process)
    assert warming.start_compiling(ServerOptions(map="straight"), pytest.fail) is None
    assert started == [warming.compile_effects]


def test_a_client_waits_for_sensors_and_not_for_their_effects(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    here, there = warming.CONTEXT.Pipe()
    done: list[str] = []
    monkeypatch.setattr(warming.signal, "signal", lambda *args: None)
    monkeypatch.setattr(warming, "compile_parts", lambda: done.append("parts"))
    monkeypatch.setattr(warming, "a_tick", lambda options, sensors: done.append("sensors"))

    def effects(options: ServerOptions) -> None:
        assert here.poll()
        here.recv()
        assert here.poll(), "the server is told before the effects"
        done.append("effects")

    monkeypatch.setattr(warming, "compile_effects", effects)
    here.send(None)
    warming._help(there, ServerOptions(map="straight"))
    assert done == ["parts", "sensors", "effects"]


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
