"""Programs of the system are found, or their tests are skipped with a reason."""

import subprocess

import pytest

from support.programs import find_program, needs_program, require_program


def test_a_hidden_program_skips_its_test_and_says_which(monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setenv("SKIDPAD_ONLY_PATH", "1")
    for name in ("mosquitto", "mosquitto_passwd", "initdb", "chromium"):
        assert find_program(name) is None
    with pytest.raises(pytest.skip.Exception, match="mosquitto is not installed: no program mosq"):
        require_program("mosquitto_passwd", "mosquitto")
    program = tmp_path / "mosquitto"
    program.write_text("#!/bin/sh\n")
    program.chmod(0o755)
    assert find_program("none-of-this-name", "mosquitto") == str(program)


def call_unseen():
    subprocess.run(["mosquitto_passwd", "-h"], check=True)


def test_what_calls_a_program_is_among_those_that_are_tried_without_it(request):
    unseen = pytest.Function.from_parent(request.node.parent, name="x", callobj=call_unseen)
    assert needs_program(unseen)
    names = {item.name for item in request.session.items if needs_program(item)}
    whole = {item.name for item in request.session.items}
    login = "test_the_fleet_logs_in_where_only_it_may_read_what_vehicles_send"
    assert (login in names) == (login in whole)
