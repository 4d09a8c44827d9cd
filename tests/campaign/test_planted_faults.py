"""A fault of one bit in a kernel that the quick way calls is found by comparing both ways (T-10)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numba
import numpy as np
import pytest
from numba.extending import register_jitable

from skidpad.campaign.driving import quick
from skidpad.campaign.driving.run_setup import stage_of
from skidpad.campaign.runs.run import OpenRun
from skidpad.core.kernels.calls import call, find_address
from skidpad.core.run import RunSpec
from skidpad.core.vocabulary import Govern
from skidpad.envelope.govern_kernel import Told, find_limits, keep_inside
from skidpad.recording.run.log_files import log_hash
from skidpad.recording.run.ticks import copy_actors
from skidpad.scenarios.playing.table_kernel import play_tick
from skidpad.sensors.object_level.objects import sense
from skidpad.simulation.recovery import RecoverySettings, Supervisor, find_ego
from skidpad.simulation.standing import has_reason
from skidpad.simulation.world.feel import feel_motion
from skidpad.simulation.world.step import advance
from skidpad.stack.perception.lights import heed_light
from skidpad.stack.road import read_road
from skidpad.stack.think import think
from support.runs import adas_run, scenario_run

Faulty = Callable[..., Any]
LEAD = adas_run(4, duration=15.0)
GOVERNED = adas_run(4, "icy_100", duration=15.0, govern=Govern.ENVELOPE)
LIGHTS = adas_run(4, duration=32.0)
STORY = scenario_run("lead_slowdown")


@register_jitable
def flip(value, bit=0):
    """Returns a number of double precision with a bit, the last one by default, the other way round."""
    return np.int64(np.float64(value).view(np.int64) ^ (1 << bit)).view(np.float64)


@register_jitable
def flip_single(value):
    """Returns the same of single precision."""
    return np.int32(np.float32(value).view(np.int32) ^ 1).view(np.float32)


def move_wrong(address: int) -> Faulty:
    def faulty(arena, stages, tick, dt, substeps, wx, wy):
        found = call(address, advance, (arena, stages, tick, dt, substeps, wx, wy))
        arena.value.rows.states.x[0] = flip(arena.value.rows.states.x[0])
        return found

    return faulty


def feel_wrong(address: int) -> Faulty:
    def faulty(arena, i):
        found = call(address, feel_motion, (arena, i))
        return (flip(found[0]), *found[1:])

    return faulty


def sense_wrong(address: int) -> Faulty:
    def faulty(common, map, tick):
        found = call(address, sense, (common, map, tick))
        depth = common.value.one.runs[4]
        for k in range(found[0]):
            depth[k] = flip_single(depth[k])
        return found

    return faulty


def read_wrong(address: int) -> Faulty:
    def faulty(memory, parts, on_highway, ways, x, y, z, yaw, v, drives):
        found = call(address, read_road, (memory, parts, on_highway, ways, x, y, z, yaw, v, drives))
        return (found[0], flip(found[1]), *found[2:])

    return faulty


def think_wrong(address: int) -> Faulty:
    def faulty(
        a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t, u, v, w, x,
        px, py, pz, yaw, speed, drives, stop, bends, told,
    ):  # fmt: skip
        found = call(
            address, think,
            (
                a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t, u, v, w, x,
                px, py, pz, yaw, speed, drives, stop, bends, told,
            ),
        )  # fmt: skip
        return (*found[:5], flip(found[5]), *found[6:])

    return faulty


def find_wrong(address: int) -> Faulty:
    def faulty(map, states):
        found = call(address, find_ego, (map, states))
        return (found[0], flip(found[1]), found[2], found[3], found[4])

    return faulty


def explain_wrong(address: int) -> Faulty:
    def faulty(map, states, lanes, s, shown, reach):
        return not call(address, has_reason, (map, states, lanes, s, shown, reach))

    return faulty


def heed_wrong(address: int) -> Faulty:
    def faulty(memory, lines, shown, way, hsv_required, v, dt):
        found = call(address, heed_light, (memory, lines, shown, way, hsv_required, v, dt))
        return (found[0], found[1], flip(found[2]), found[3])

    return faulty


def copy_wrong(address: int) -> Faulty:
    def faulty(states, mu, columns, k):
        call(address, copy_actors, (states, mu, columns, k))
        x = columns.value.actors[0, k]
        x[-1] = flip_single(x[-1])

    return faulty


def limit_wrong(address: int) -> Faulty:
    def faulty(
        parts, distance, azimuth, altitude, velocity, ego, throttle, brake, steer, stage, is_cold
    ):
        found = call(
            address, find_limits,
            (
                parts, distance, azimuth, altitude, velocity, ego, throttle, brake, steer, stage,
                is_cold,
            ),
        )  # fmt: skip
        return Told(flip(found[0]), *found[1:])

    return faulty


def keep_wrong(address: int) -> Faulty:
    def faulty(parts, told, v, ay, throttle, brake, reverse):
        found = call(address, keep_inside, (parts, told, v, ay, throttle, brake, reverse))
        return found[0], flip(found[1])

    return faulty


def play_wrong(address: int) -> Faulty:
    def faulty(map, states, table, t, dt):
        goes_on = call(address, play_tick, (map, states, table, t, dt))
        pedals = table.value.pedals
        for k in range(len(pedals)):
            pedals[k, 0] = flip(pedals[k, 0], 40)  # what the last bit does is lost in the log
        return goes_on

    return faulty


FAULTS: dict[str, tuple[Any, Callable[[int], Faulty], RunSpec]] = {
    "advance": (advance, move_wrong, LEAD),
    "feel_motion": (feel_motion, feel_wrong, LEAD),
    "sense": (sense, sense_wrong, LEAD),
    "read_road": (read_road, read_wrong, LEAD),
    "think": (think, think_wrong, LEAD),
    "find_ego": (find_ego, find_wrong, LEAD),
    "has_reason": (has_reason, explain_wrong, LEAD),
    "heed_light": (heed_light, heed_wrong, LIGHTS),
    "copy_actors": (copy_actors, copy_wrong, LEAD),
    "find_limits": (find_limits, limit_wrong, GOVERNED),
    "keep_inside": (keep_inside, keep_wrong, GOVERNED),
    "play_tick": (play_tick, play_wrong, STORY),
}


def drive(spec: RunSpec, quickly: bool) -> tuple[str, tuple[object, ...], int]:
    """Drives a run; returns the hash of its log, what is remembered besides, and the quick ticks.

    That is what the supervisor remembers, and what the envelope, if any, said in each tick.

    On roads an ego below 5 m/s counts as stuck after a second.
    """
    stage, memory = stage_of(spec), ()
    if isinstance(stage.supervisor, Supervisor):
        settings = RecoverySettings(stuck_speed=5.0, stuck_time=1.0, release_speed=2.0)
        stage = replace(stage, supervisor=Supervisor(stage.map, settings, stage.setup.dt))
    opened = OpenRun(spec, stage=stage)
    while opened.drive(1000) if quickly else opened.step() is not None:
        pass
    opened.close()
    if isinstance(stage.supervisor, Supervisor):
        memory = tuple(v for k, v in vars(stage.supervisor).items() if k in ("_last", "standing"))
    run = opened.finish()
    if run.readings is not None:
        memory = *memory, run.readings.table.hash_rows().to_list()
    return log_hash(run.log), memory, run.quick_ticks


@pytest.mark.parametrize(
    "spec", [LEAD, LIGHTS, GOVERNED, STORY], ids=["roads", "lights", "governed", "story"]
)
def test_without_a_fault_both_ways_are_the_same(spec: RunSpec) -> None:
    one, other = drive(spec, False), drive(spec, True)
    assert one[:2] == other[:2]
    assert other[2] > 100


@pytest.mark.parametrize("name", FAULTS)
def test_a_planted_fault_of_one_bit_is_found(name: str, monkeypatch: Any) -> None:
    stage, plant, spec = FAULTS[name]
    planted = []

    def find_planted(kernel: Any, *arguments: object) -> int:
        address = find_address(kernel, *arguments)
        if kernel is not stage:
            return address
        faulty = numba.njit(nogil=True, error_model="numpy")(plant(address))
        planted.append(faulty)  # it keeps the machine code
        return find_address(faulty, *arguments)

    monkeypatch.setattr(quick, "find_address", find_planted)
    one, other = drive(spec, False), drive(spec, True)
    assert planted, "the kernel is called by its address"
    assert other[2] > 0
    assert one[:2] != other[:2]


def test_every_kernel_that_is_called_by_address_has_its_fault() -> None:
    assert set(FAULTS) == set(quick.Addresses._fields)
