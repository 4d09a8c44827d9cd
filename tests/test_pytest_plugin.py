"""The plugin as another project uses it: in a pytest of its own."""

from __future__ import annotations

import os
import subprocess
import sys
from importlib.metadata import entry_points
from pathlib import Path

import pytest

USE = """
def test_car_moves(skidpad_carla):
    world = skidpad_carla.world
    settings = world.get_settings()
    settings.synchronous_mode, settings.fixed_delta_seconds = True, 0.05
    world.apply_settings(settings)
    point = world.get_map().get_spawn_points()[0]
    library = world.get_blueprint_library()
    car = world.spawn_actor(library.find("vehicle.tesla.model3"), point)
    gnss = world.spawn_actor(library.find("sensor.other.gnss"), point, attach_to=car)
    gnss.listen(lambda _: None)
    car.set_target_velocity(point.get_forward_vector() * 10.0)
    for _ in range(20):
        world.tick()
    assert car.get_location().distance(point.location) > 5.0
    assert world.get_map().name.endswith("straight")


def test_begins_afresh(skidpad_carla):
    assert not skidpad_carla.world.get_settings().synchronous_mode
    assert len(skidpad_carla.world.get_actors().filter("vehicle.*")) == 0
    assert skidpad_carla.tm_port != skidpad_carla.port
"""


def test_another_project_gets_client_world_and_port(tmp_path: Path) -> None:
    pytest.importorskip("carla")
    (tmp_path / "test_use.py").write_text(USE)
    (tmp_path / "pytest.ini").write_text("[pytest]\nskidpad_carla_options = --map straight\n")
    installed = "skidpad" in entry_points(group="pytest11").names
    plugin = [] if installed else ["-p", "skidpad.pytest_plugin"]
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", *plugin, str(tmp_path)],
        capture_output=True,
        text=True,
        timeout=900,
        check=False,
        cwd=tmp_path,
        env={**os.environ},
    )
    assert "2 passed" in done.stdout, done.stdout + done.stderr


def test_the_plugin_imports_nothing_heavy() -> None:
    code = (
        "import sys, skidpad.pytest_plugin as p; "
        "heavy = {'numpy', 'numba', 'carla', 'msgpack'} & set(sys.modules); print(heavy)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=300, check=True
    )
    assert done.stdout.strip() == "set()"
