"""The server in a process of its own."""

import sys
from pathlib import Path

import pytest

from skidpad.simulation.carla_server.process import ServerProcess

READY_AT_ITS_ID = """#!/bin/sh
echo "ready: CARLA 0.9.16 on 127.0.0.1:$$"
exec sleep 60
"""


def test_the_process_id_is_the_servers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    program = tmp_path / "server"
    program.write_text(READY_AT_ITS_ID)
    program.chmod(0o700)
    monkeypatch.setattr(sys, "executable", str(program))
    with ServerProcess() as server:
        assert server.alive
        assert server.pid == server.port
    assert not server.alive
