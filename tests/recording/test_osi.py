"""A run as an OSI trace, read back by the standard's own reader."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from skidpad.cli.main import app
from skidpad.core.vocabulary import LightState
from skidpad.recording.run.log import RunLog
from skidpad.recording.run.log_files import read_log

pytest.importorskip("osi3", reason="needs the extra osi")

from support.osi_rules import broken_rules, read_rules

COLOURS = {2: LightState.RED, 3: LightState.YELLOW, 4: LightState.GREEN}  # Classification.Color
HEAVY = 7  # EnvironmentalConditions.Precipitation: 34 to 149 mm/h


def skidpad(*words: object):
    return CliRunner().invoke(app, [str(word) for word in words])


@pytest.fixture(scope="module")
def driven(tmp_path_factory) -> tuple[Path, RunLog]:
    """Ten seconds of rain in town, among others and through changes of lights."""
    out = tmp_path_factory.mktemp("osi") / "out"
    done = skidpad(
        "adas", "--out", out, "--configs", "2", "--weather", "rain-noon", "--sensors", "objects",
        "--map", "town", "--traffic", "random", "--vehicles", "6", "--duration", "10", "--workers", "1",
    )  # fmt: skip
    assert done.exit_code == 0, done.output
    (run,) = (out / "runs").iterdir()
    return run, read_log(run)


@pytest.fixture(scope="module")
def trace(driven, tmp_path_factory):
    from osi3trace.osi_trace import OSITrace

    file = tmp_path_factory.mktemp("trace") / "run.osi"
    done = skidpad("export", driven[0], "--osi", file, "--out", file.parent / "scenario")
    assert done.exit_code == 0, done.output
    assert f"{len(driven[1])} messages" in done.output
    return list(OSITrace(str(file), "GroundTruth"))


def test_there_is_a_message_for_each_moment(driven, trace):
    _, log = driven
    seconds = [m.timestamp.seconds + 1e-9 * m.timestamp.nanos for m in trace]
    assert seconds == pytest.approx(log.t.tolist(), abs=1e-9)
    first = trace[0]
    assert (first.version.version_major, first.version.version_minor) == (3, 8)
    assert first.host_vehicle_id.value == 0
    assert first.proj_string.startswith("+proj=tmerc")
    assert first.map_reference == "town.xodr"
    assert first.environmental_conditions.precipitation == HEAVY


def test_the_road_is_in_the_first_message_and_actors_tilt_with_it(trace):
    assert len(trace[0].lane) > 20
    assert len(trace[0].lane_boundary) > 40
    assert not trace[1].lane
    tilts = [o.base.orientation for m in trace for o in m.moving_object]
    assert all(abs(t.roll) < 0.2 and abs(t.pitch) < 0.2 for t in tilts)


def test_an_address_for_datagrams_is_checked_before_anything_is_written(driven, tmp_path):
    done = skidpad("export", driven[0], "--osi-udp", "nowhere:1", "--out", tmp_path / "s")
    assert done.exit_code != 0
    assert not (tmp_path / "s").exists()


def test_actors_are_boxes_in_motion_where_the_log_has_them(driven, trace):
    _, log = driven
    a, table = log.actors, log.table
    for k in (0, 57, len(log) - 1):
        found = {o.id.value: o for o in trace[k].moving_object}
        assert sorted(found) == np.flatnonzero(log.present[k]).tolist()
        for i, o in found.items():
            b = o.base
            at = (b.position.x, b.position.y, b.position.z)
            assert at == pytest.approx(
                (a.x[k, i], a.y[k, i], a.z[k, i] + table.height[i] / 2), abs=1e-4
            )
            size = (b.dimension.length, b.dimension.width, b.dimension.height)
            assert size == pytest.approx((table.length[i], table.width[i], table.height[i]))
            assert (b.velocity.x, b.velocity.y) == pytest.approx((a.vx[k, i], a.vy[k, i]))
            assert -np.pi < b.orientation.yaw <= np.pi
            assert np.cos(b.orientation.yaw - a.yaw[k, i]) == pytest.approx(1.0)
            assert o.type == o.TYPE_VEHICLE
            assert o.HasField("vehicle_attributes")  # ASAM's rules: set for every vehicle
            assert o.source_reference[0].identifier == [table.names[i]]


def test_accelerations_are_those_of_the_velocities(driven, trace):
    """In the world's axes: what speeds gain from message to message."""
    v = np.array(
        [[m.moving_object[0].base.velocity.x, m.moving_object[0].base.velocity.y] for m in trace]
    )
    a = np.array(
        [
            [m.moving_object[0].base.acceleration.x, m.moving_object[0].base.acceleration.y]
            for m in trace
        ]
    )
    gained, told = v[60] - v[20], a[21:61].sum(axis=0) * driven[1].header.dt
    assert np.hypot(*gained) > 1.0
    assert told == pytest.approx(gained, abs=0.1 * np.hypot(*gained))


def test_every_light_has_three_bulbs_of_which_one_is_lit(driven, trace):
    _, log = driven
    for k in (0, 100, len(log) - 1):
        states = {}
        for change in log.lights:
            if change.tick <= log.tick[k]:
                states[change.signal] = change.state
        bulbs: dict[int, list] = {}
        for bulb in trace[k].traffic_light:
            (name,) = bulb.source_reference[0].identifier
            bulbs.setdefault(int(name.removeprefix("signal_id:")), []).append(bulb)
        assert set(bulbs) == set(states)
        assert len(states) >= 4
        for signal, three in bulbs.items():
            assert [COLOURS[b.classification.color] for b in three] == list(COLOURS.values())
            lit = [b for b in three if b.classification.mode == b.classification.MODE_CONSTANT]
            assert [COLOURS[b.classification.color] for b in lit] == [states[signal]]
            assert three[0].base.position.z > three[2].base.position.z > 1.0
    ids = [o.id.value for o in (*trace[0].moving_object, *trace[0].traffic_light)]
    assert len(set(ids)) == len(ids)


def test_another_name_or_a_folder_that_is_not_there_is_one_sentence(driven, tmp_path):
    done = skidpad("export", driven[0], "--osi", tmp_path / "run.bin", "--out", tmp_path / "s")
    assert done.exception is not None
    assert "ends in .osi" in str(done.exception) or "ends in .osi" in done.output
    assert not (tmp_path / "s").exists()


def test_a_drive_in_town_breaks_none_of_asams_rules_for_osi(trace):
    rules = read_rules()
    assert sum(len(lines) for fields in rules.values() for lines in fields.values()) > 150
    said = Counter(what for m in trace for what in broken_rules(rules, m))
    assert not said, said.most_common(5)


def pair_with_no_lane(m):
    pairs = next(k.classification.lane_pairing for k in m.lane if k.classification.lane_pairing)
    pairs[0].antecessor_lane_id.value = 10**9


@pytest.mark.parametrize(
    ("spoil", "says"),
    [
        (lambda m: m.moving_object[0].ClearField("id"), "MovingObject.id: is_set"),
        (lambda m: m.moving_object.add().CopyFrom(m.moving_object[0]), "id: is_globally_unique"),
        (
            lambda m: setattr(m.moving_object[0].base.dimension, "length", -1.0),
            "Dimension3d.length",
        ),
        (lambda m: setattr(m.timestamp, "nanos", 10**9), "Timestamp.nanos"),
        (pair_with_no_lane, "refers_to: Lane"),
        (lambda m: m.moving_object[0].ClearField("vehicle_attributes"), "check_if this.type"),
    ],
)
def test_what_breaks_a_rule_of_asams_is_found(trace, spoil, says):
    message = type(trace[0])()
    message.CopyFrom(trace[0])
    spoil(message)
    assert says in " ".join(broken_rules(read_rules(), message))
