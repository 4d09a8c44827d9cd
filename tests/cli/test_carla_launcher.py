"""A CarlaUE4.sh that starts our server, as programs that start CARLA do it."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from skidpad.cli.carla_launcher import NAME, find_refused, translate_options
from skidpad.cli.main import app
from support.carla_programs import environment

LIMIT = 600.0  # s


def launcher(folder: Path, *options: str) -> Path:
    done = CliRunner().invoke(app, ["carla-launcher", str(folder), "--", *options])
    assert done.exit_code == 0, done.output
    assert done.output.startswith("export CARLA_ROOT=")
    assert str(folder) in done.output
    return folder / NAME


@pytest.mark.parametrize(
    ("given", "ours"),
    [
        ("-RenderOffScreen -nosound -carla-rpc-port=2300 -graphicsadapter=0", "--port 2300"),
        ("-carla-port=2400 -quality-level=Epic", "--port 2400"),
        ("/Game/Carla/Maps/Town05 -windowed -ResX=640", "--map Town05"),
        ("Town01_Opt -benchmark -fps=20 --ros2", "--map Town01_Opt"),
        ("-opengl", ""),
    ],
)
def test_options_of_unreal(given, ours):
    assert translate_options(["--mu-ref", "0.9", "--unreal", *given.split()]) == [
        "--mu-ref",
        "0.9",
        *ours.split(),
    ]


def test_a_streaming_port_of_its_own_is_said():
    assert find_refused(["-carla-rpc-port=2000", "-carla-streaming-port=2001"]) == ""
    assert find_refused(["-carla-rpc-port=2000", "-carla-streaming-port=0"]) == ""
    assert "2101, not 3000" in find_refused(["-carla-rpc-port=2100", "-carla-streaming-port=3000"])


def test_a_file_of_others_stays(tmp_path):
    (tmp_path / NAME).write_text("#!/bin/sh\n")
    done = subprocess.run(
        [sys.executable, "-m", "skidpad", "carla-launcher", str(tmp_path)],
        capture_output=True, text=True, env=environment(), timeout=LIMIT, check=False,
    )  # fmt: skip
    assert done.returncode == 2
    assert "not ours" in done.stderr
    assert (tmp_path / NAME).read_text() == "#!/bin/sh\n"


def test_a_program_starts_it_as_carla(tmp_path):
    """By its path, with Unreal's options, and ends it by its process group."""
    pytest.importorskip("msgpack")
    script = launcher(tmp_path / "a folder", "--seed", "3")
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    started = subprocess.Popen(
        [str(script), "/Game/Carla/Maps/straight_Opt", "-RenderOffScreen", f"-carla-rpc-port={port}"],
        stdout=subprocess.PIPE, text=True, env=environment() | {"PYTHONUNBUFFERED": "1"},
        start_new_session=True,
    )  # fmt: skip
    try:
        assert started.stdout is not None
        said = [next(line for line in started.stdout if "ready" in line)]
        assert f":{port}, streams on {port + 1}, map straight_Opt" in said[0]
    finally:
        os.killpg(started.pid, 15)
        started.wait(LIMIT)
        started.stdout.close()
