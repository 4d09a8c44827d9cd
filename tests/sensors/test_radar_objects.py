"""Detections of objects and their tracks: by what was put there, and by a second route."""

from dataclasses import replace
from math import degrees, hypot, log10, pi, sin

import numba
import numpy as np
import pytest

from skidpad.campaign.driving.run_setup import stage_of
from skidpad.core.states import VehicleCommand
from skidpad.core.vocabulary import RadarOutput
from skidpad.roads.roadside import Box, Roadside
from skidpad.sensors.physical_radar import tracks as tracking
from skidpad.sensors.physical_radar.radar import PhysicalRadar
from skidpad.simulation.embedded.engine import EmbeddedBackend
from support.runs import adas_run
from support.sensors.cars import RADAR, world
from support.sensors.driven_radar import measured

DT = 0.05


def radar_of(table, output, roadside=None):
    return PhysicalRadar(RADAR, roadside or Roadside(), table, 1, output=output)


def readings(*others, output=RadarOutput.DETECTIONS, ticks=20, speeds=(), moves=False, turn=0.0):
    """Readings of all ticks, arrays copied; the ego drives at 20 m/s where things move."""
    table, states = world(*others)
    states.vx[1:] = speeds or 0.0
    if moves:
        states.vx[0], states.yaw_rate[0] = 20.0, turn
    radar, found = radar_of(table, output), []
    for k in range(ticks):
        read = radar.read(k, states)
        found.append(tuple(None if part is None else np.column_stack(part).copy() for part in read))
        if moves:
            states.x[:] += states.vx * DT
            states.y[:] += states.vy * DT
            states.yaw[0] += turn * DT
            speed = hypot(states.vx[0], states.vy[0])
            states.vx[0], states.vy[0] = (
                speed * np.cos(states.yaw[0]),
                speed * np.sin(states.yaw[0]),
            )
    return found


def test_one_car_is_one_row_and_two_lanes_are_two():
    one = readings((30.0, 3.0, 0.0, 0.0))  # its rear and its right side are seen
    cells = readings((30.0, 3.0, 0.0, 0.0), output=RadarOutput.POINTS)
    assert np.mean([len(points) for points, *_ in cells]) > 1.2
    assert [len(points) for points, *_ in one].count(1) >= 18
    two = readings((40.0, 0.0, 0.0, 0.0), (40.0, 3.5, 0.0, 0.0))
    assert [len(points) for points, *_ in two].count(2) >= 17
    fast = readings((40.0, 0.0, 0.0, 0.0), (40.5, 1.0, 0.0, 0.0), speeds=(0.0, 5.0))
    assert [len(points) for points, *_ in fast].count(2) >= 15


def test_an_object_begins_at_its_nearest_cell_and_keeps_their_power():
    for (points, objects, _), (cells, *_) in zip(
        readings((30.0, 3.0, 0.0, 0.0)),
        readings((30.0, 3.0, 0.0, 0.0), output=RadarOutput.POINTS),
        strict=True,
    ):
        if len(points) == 1:
            assert points[0, 0] == pytest.approx(cells[:, 0].min())
            assert cells[:, 3].min() - 1e-6 <= points[0, 3] <= cells[:, 3].max() + 1e-6
            assert objects[0, 0] > 20.0


def test_the_section_is_that_of_the_table():
    rows = [objects[0, 1] for _, objects, _ in readings((42.0 + 2.25, 0.0, 0.0, 0.0), ticks=200)]
    face = 10.0 * log10(1.8 * 1.5 / (2.0 * 1.6))  # of the table's vehicle
    high = 12.0 * ((90.0 - degrees(0.25 / 40.0) - 79.65) / 36.73) ** 2  # dB off the lobe's middle
    # between the middles of cells: 1/3 of a bin in range, half a beam
    apart = 20.0 * log10(sin(pi / 3.0) / (pi / 3.0 * (1.0 - 1.0 / 9.0))) - 10.0 * log10(2.0)
    mean = 10.0 * log10(np.mean(10.0 ** (np.array(rows) / 10.0)))
    assert mean == pytest.approx(13.90 + face - high + apart, abs=0.8)  # 200 draws: 0.3


def test_a_track_finds_place_and_speed_and_keeps_its_number():
    found = readings(
        (42.0, 0.0, 0.0, 0.0), output=RadarOutput.TRACKS, ticks=60, speeds=(15.0,), moves=True
    )
    counts = [len(points) for points, *_ in found]
    assert counts[:2] == [0, 0]  # three hits confirm
    assert counts[5:].count(1) >= 50
    points, _, tracks = found[-1]
    assert tracks[0, 0] == 1
    assert tracks[0, 3] == pytest.approx(15.0, abs=0.3)
    assert tracks[0, 4] == pytest.approx(0.0, abs=0.5)
    ahead = 42.0 - 2.25 - 2.0 - 5.0 * 59 * DT
    assert tracks[0, 1] == pytest.approx(ahead, abs=0.4)
    assert points[0, 3] == pytest.approx(-5.0, abs=0.2)


def test_what_stands_stands_while_the_car_turns():
    found = readings(
        (60.0, 4.0, 0.0, 0.0), output=RadarOutput.TRACKS, ticks=30, moves=True, turn=0.15
    )
    _, _, tracks = found[-1]
    assert len(tracks) == 1
    assert np.hypot(tracks[0, 3], tracks[0, 4]) < 1.5


def test_what_is_gone_is_dropped_after_five_misses():
    table, states = world((40.0, 0.0, 0.0, 0.0))
    radar, counts = radar_of(table, RadarOutput.TRACKS), []
    for k in range(20):
        states.present[1] = k < 8
        counts.append(len(radar.read(k, states).points.range))
    assert counts[7:12] == [1] * 5  # seen last at 7; it goes on for four ticks
    assert counts[12:] == [0] * 8


@numba.njit
def _correct(state, spread, looks, values):
    tracking._correct(state, spread, looks, values)


def test_one_correction_by_three_values_is_that_of_all_at_once():
    rng = np.random.default_rng(3)
    half = rng.normal(size=(4, 4))
    state, spread = rng.normal(size=4), half @ half.T + np.eye(4)
    looks, values = rng.normal(size=(3, 4)), np.abs(rng.normal(size=(3, 2))) + 0.1
    gain = spread @ looks.T @ np.linalg.inv(looks @ spread @ looks.T + np.diag(values[:, 1]))
    expected = state + gain @ (values[:, 0] - looks @ state)
    wide = spread - gain @ looks @ spread
    _correct(state, spread, looks, values)
    assert state == pytest.approx(expected)
    assert spread == pytest.approx(wide)


def test_prediction_is_that_of_matrices():
    @numba.njit
    def predict(tracks):
        tracking.predict_tracks(tracks, (20.0, 1.0, 0.4), 0.05)

    tracks, rng = tracking.make_tracks(), np.random.default_rng(4)
    half = rng.normal(size=(4, 4))
    tracks.number[0] = 1
    tracks.state[0], tracks.spread[0] = rng.normal(size=4), half @ half.T
    state, spread = tracks.state[0].copy(), tracks.spread[0].copy()
    turn = np.array([[np.cos(0.02), np.sin(0.02)], [-np.sin(0.02), np.cos(0.02)]])
    f = np.kron(np.array([[1.0, 0.05], [0.0, 1.0]]), turn)
    push = np.kron(np.array([[0.5 * 0.05**2], [0.05]]), np.eye(2)) * tracking.ACCELERATION
    predict(tracks)
    moved = f @ state - np.concatenate([turn @ [20.0 * 0.05, 1.0 * 0.05], [0.0, 0.0]])
    assert tracks.state[0] == pytest.approx(moved)
    assert tracks.spread[0] == pytest.approx(f @ spread @ f.T + push @ push.T)


@pytest.mark.parametrize("output", list(RadarOutput))
def test_frames_carry_what_the_setting_asks_for(output):
    backend, frame = measured(radar_output=output.value, radar_multipath=True)
    for _ in range(5):
        frame = backend.step(VehicleCommand(throttle=0.3))
    n = len(frame.radar.range)
    assert (frame.radar_objects is None) == (output is RadarOutput.POINTS)
    assert (frame.radar_tracks is None) == (output is not RadarOutput.TRACKS)
    if frame.radar_objects is not None:
        assert len(frame.radar_objects.section) == n > 0
    if frame.radar_tracks is not None:
        assert len(set(frame.radar_tracks.number.tolist())) == n
    backend.close()


def test_a_geometric_radar_has_no_list():
    ready = adas_run(2, "clear-noon", seed=3)
    backend = EmbeddedBackend()
    frame = backend.reset(stage_of(ready).setup, ready.seed)
    assert frame.radar_objects is None
    assert frame.radar_tracks is None
    backend.close()


def test_the_same_seed_gives_the_same_tracks():
    box = Roadside(boxes=(Box(1, 50.0, 6.0, 0.0, 0.2, 12.0, 8.0, 6.0),))
    table, states = world((40.0, 0.0, 0.0, 0.0), (60.0, 3.0, 0.0, 0.2))
    made = []
    for _ in range(2):
        radar = radar_of(replace(table), RadarOutput.TRACKS, box)
        rows = [np.column_stack(radar.read(k, states).points).tobytes() for k in range(10)]
        made.append(b"".join(rows))
    assert made[0] == made[1]
