"""Lanes, boundaries and signs of a map as OSI, by the rules that OSI 3 writes beside its fields."""

from __future__ import annotations

import socket
import struct
from math import atan, hypot, pi

import numpy as np
import pytest

pytest.importorskip("osi3", reason="needs the extra osi")

from skidpad.core.errors import ConfigError
from skidpad.recording.formats.osi_udp import PART, message_parts, read_address, send_osi
from skidpad.roads.bundled import load_map
from skidpad.roads.lanes import LaneKind, Marking, SignalKind
from skidpad.scenarios.export.osi_road import FIRST_LANE, STEP, Tilt, road_truth
from support.osi_rules import broken_rules, read_rules


@pytest.fixture(scope="module")
def town():
    map = load_map("town")
    return map, road_truth(map)


def test_every_reference_is_there_and_every_id_is_of_one_message(town):
    """`is_globally_unique` and `refers_to` of the ids in osi_common, osi_lane and osi_trafficsign."""
    map, truth = town
    lanes = {m.id.value for m in truth.lane}
    boundaries = {m.id.value for m in truth.lane_boundary}
    signs = {m.id.value for m in truth.traffic_sign}
    assert len(lanes) + len(boundaries) + len(signs) == len(lanes | boundaries | signs)
    assert len(lanes) == len(truth.lane) == len(map.lanes.road)
    used = set()
    for lane in truth.lane:
        kind = lane.classification
        for ids in (kind.left_adjacent_lane_id, kind.right_adjacent_lane_id):
            assert {i.value for i in ids} <= lanes
        pairs = [(p.antecessor_lane_id, p.successor_lane_id) for p in kind.lane_pairing]
        assert {i.value for p in pairs for i in p if i.value} <= lanes
        for ids in (kind.left_lane_boundary_id, kind.right_lane_boundary_id):
            assert ids, "a lane has a boundary on either side"
            used |= {i.value for i in ids}
    assert used == boundaries
    for sign in truth.traffic_sign:
        assert {i.value for i in sign.main_sign.classification.assigned_lane_id} <= lanes


@pytest.mark.parametrize("name", ["town", "motorway", "figure8"])
def test_a_road_breaks_none_of_asams_rules_for_osi(name):
    truth = road_truth(load_map(name))
    parts = [*truth.lane, *truth.lane_boundary, *truth.traffic_sign]
    assert len(parts) > 10
    said = [what for what in broken_rules(read_rules(), truth) if "GroundTruth." not in what]
    assert not said, said[:5]


def test_boundaries_lie_half_a_width_beside_the_middle_and_are_shared(town):
    map, truth = town
    by_id = {m.id.value: m for m in truth.lane_boundary}
    shared = 0
    for lane, message in enumerate(truth.lane):
        kind = message.classification
        first = int(map.lanes.first[lane])
        begin = kind.centerline[0]
        width = float(map.samples.width[first])
        right = by_id[kind.right_lane_boundary_id[0].value].boundary_line[0].position
        if len(kind.right_lane_boundary_id) == 1 and map.lanes.right[lane] < 0:
            assert hypot(right.x - begin.x, right.y - begin.y) == pytest.approx(width / 2, abs=0.02)
        if map.lanes.left[lane] >= 0:
            other = truth.lane[int(map.lanes.left[lane])].classification
            shared += kind.left_lane_boundary_id == other.right_lane_boundary_id
    assert shared > 0
    step = max(
        hypot(b.x - a.x, b.y - a.y)
        for m in truth.lane
        for a, b in zip(
            m.classification.centerline[:-1], m.classification.centerline[1:], strict=True
        )
    )
    assert step <= STEP * 1.01


def test_road_marks_are_those_of_the_map(town):
    map, truth = town
    kinds = {k: m.classification.type for k, m in enumerate(truth.lane_boundary)}
    names = {truth.lane_boundary[k].classification.Type.Name(v) for k, v in kinds.items()}
    marks = {Marking(int(v)) for v in np.unique(map.samples.marking_right)}
    assert ("TYPE_DASHED_LINE" in names) is bool(marks & {Marking.BROKEN, Marking.BROKEN_SOLID})
    assert "TYPE_SOLID_LINE" in names
    assert "TYPE_UNKNOWN" not in names
    driving = [m for m in truth.lane if m.classification.type == m.classification.TYPE_DRIVING]
    assert len(driving) == int(np.isin(map.lanes.kind, (LaneKind.DRIVING, LaneKind.RAMP)).sum())


def test_signs_carry_their_value_in_the_unit_of_the_sign(town):
    map, truth = town
    found = {s.source_reference[0].identifier[0]: s.main_sign for s in truth.traffic_sign}
    table, kinds = map.signals, (SignalKind.STOP, SignalKind.YIELD, SignalKind.SPEED_LIMIT)
    rows = [k for k in range(len(table.id)) if SignalKind(int(table.kind[k])) in kinds]
    assert len(found) == len({int(table.id[k]) for k in rows})
    for k in rows:
        sign = found[f"signal_id:{table.id[k]}"]
        lanes = {i.value for i in sign.classification.assigned_lane_id}
        assert FIRST_LANE + int(table.lane[k]) in lanes
        if table.kind[k] == SignalKind.SPEED_LIMIT:
            assert sign.classification.value.value == pytest.approx(3.6 * table.value[k])


def test_a_body_on_a_slope_pitches_and_turned_round_the_other_way():
    """On a grade of g uphill the nose is up, which is negative in ISO 8855; across it the body rolls."""
    map = load_map("figure8")
    s = map.samples
    k = int(np.abs(s.grade).argmax())
    grade = float(s.grade[k])
    assert abs(grade) > 0.01
    at = (float(s.x[k]), float(s.y[k]), float(s.z[k]))
    heading, tilt = float(s.heading[k]), Tilt(map)
    assert tilt.at(*at, heading)[1] == pytest.approx(-atan(grade), abs=2e-3)
    assert tilt.at(*at, heading + pi)[1] == pytest.approx(atan(grade), abs=2e-3)
    assert abs(tilt.at(*at, heading + pi / 2.0)[0]) == pytest.approx(abs(atan(grade)), abs=2e-3)
    assert tilt.at(1e6, 1e6, 0.0, 0.0) == (0.0, 0.0)


def read_parts(parts):
    """Puts a message together as esmini's receiver does."""
    whole = b""
    for k, part in enumerate(parts, start=1):
        counter, size = struct.unpack_from("<iI", part)
        assert abs(counter) == k
        assert size == len(part) - 8 <= PART
        whole += part[8:]
        if counter < 0:
            return whole
    raise AssertionError("no last part")


@pytest.mark.parametrize("size", [0, 1, PART, PART + 1, 3 * PART - 1])
def test_a_message_is_sent_in_parts_of_which_the_last_one_counts_negative(size):
    message = bytes(k % 251 for k in range(size))
    assert read_parts(message_parts(message)) == message


def test_messages_go_to_the_port_that_is_given_at_their_times():
    waits = []
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver:
        receiver.bind(("127.0.0.1", 0))
        receiver.settimeout(2.0)
        address = read_address(str(receiver.getsockname()[1]))
        assert address[0] == "127.0.0.1"
        assert send_osi(address, [(5.0, b"a"), (5.05, b"b")], waits.append) == 2
        assert [read_parts([receiver.recv(9000)]) for _ in range(2)] == [b"a", b"b"]
    assert waits[0] == 0.0
    assert 0.0 < waits[1] <= 0.05


@pytest.mark.parametrize(
    "text", ["", "host:1", "0", "70000", "127.0.0.1:", "127.0.0.1:x", "1.2.3:9"]
)
def test_an_address_that_is_none_is_one_sentence(text):
    with pytest.raises(ConfigError, match="--osi-udp takes PORT or ADDRESS:PORT"):
        read_address(text)
