"""Many ticks of the loop as one compiled call, which ends where Python has something to do.

It calls the kernels that Python calls one by one, by their addresses: world, motion, sensors, stack,
supervisor and log keep their own machine code, so nothing of them is compiled again.
"""

from __future__ import annotations

from math import inf, isfinite, nan

from skidpad.campaign.driving.quick_tables import (
    ARRIVED,
    DONE,
    MOVED,
    REFUSED,
    STEPPED,
    TOLD,
    UNUSUAL,
    Joined,
    Tables,
)
from skidpad.core.kernels.calls import call
from skidpad.core.kernels.jit import Held, inner_kernel, kernel
from skidpad.envelope.govern_kernel import (
    NOTHING_TOLD,
    V_CREEP,
    EnvelopeParts,
    Told,
    find_limits,
    keep_inside,
)
from skidpad.envelope.sight import Motion
from skidpad.physics.fleet import shown_gear
from skidpad.recording.run.ticks import APPLIED, REPORT, REQUESTED, copy_actors
from skidpad.roads.journeys import come_by
from skidpad.scenarios.playing.table_kernel import Table, play_tick
from skidpad.sensors.object_level.objects import sense
from skidpad.simulation.recovery import WRONG_WAY_DOT, find_ego
from skidpad.simulation.standing import has_reason, is_slow
from skidpad.simulation.world.feel import Felt, feel_motion
from skidpad.simulation.world.lights import ROUNDING
from skidpad.simulation.world.step import SETTLE, Arena, advance
from skidpad.simulation.world.touch import EGO
from skidpad.simulation.world.traffic.manager import CHECK_PERIOD
from skidpad.stack.perception.lights import NONE_AHEAD, Way, heed_light
from skidpad.stack.road import read_road
from skidpad.stack.think import Answer, Light, think, write_report

count_gear = kernel(shown_gear)


@kernel
def is_change_due(t: Tables, dt: float) -> bool:
    """Returns whether a light changes in a step of dt s."""
    due = False
    for g in range(len(t.first)):
        due |= t.elapsed[t.first[g]] + dt + ROUNDING >= t.limit[g]
    return due


@kernel
def is_traffic_due(a: Arena, far: float, stuck: float) -> bool:
    """Returns whether a vehicle that drives itself is farther from the ego, or stands for longer."""
    s, state, due = a.rows.states, a.drivers.state, far < 0.0
    for i in range(len(state)):
        if not state[i].active:
            continue
        dx, dy = s.x[i] - s.x[EGO], s.y[i] - s.y[EGO]
        due |= state[i].stuck > stuck or (s.present[i] and dx * dx + dy * dy > 0.999 * far * far)
    return due


@inner_kernel
def step_world(joined: Held[Joined], tick: int) -> tuple[int, int, int]:
    """Makes the world's step to `tick`; returns why Python has to go on (DONE: it need not).

    Then contacts and crossed markings of the step.
    """
    rules, t, arena = joined.value.rules, joined.value.tables, joined.value.arena
    address = joined.value.at.advance
    looks = tick % CHECK_PERIOD == 0
    stages = rules.moving if looks else rules.moving | SETTLE
    touches, crossed = call(
        address, advance, (arena, stages, tick, rules.dt, rules.substeps, 0.0, 0.0)
    )
    if looks:
        if is_traffic_due(arena.value, rules.far, rules.stuck):
            return MOVED, touches, crossed
        _, crossed = call(
            address, advance, (arena, SETTLE, tick, rules.dt, rules.substeps, 0.0, 0.0)
        )
    if touches > 0 or crossed or is_change_due(t, rules.dt):
        return STEPPED, touches, crossed
    for i in range(len(t.elapsed)):
        t.elapsed[i] += rules.dt
    return DONE, touches, crossed


@inner_kernel
def watch_ego(
    joined: Held[Joined], standing: int, has_grace: bool
) -> tuple[bool, bool, tuple[int, float, float]]:
    """Returns whether the supervisor leaves the tick to the stack, and whether the ego stands.

    It stands when it is slow and neither an actor nor a light explains it. Then lane (-1: not looked for),
    s and offset of the ego. has_grace: the detector of an ego that is stuck is off.
    """
    at, rules, t = joined.value.at, joined.value.rules, joined.value.tables
    if not rules.supervised:
        return True, False, (-1, nan, nan)
    map, states = joined.value.map, joined.value.states
    lane, s, offset, turned, inside = call(at.find_ego, find_ego, (map, states))
    usual = lane >= 0 and inside and turned >= WRONG_WAY_DOT
    stands = usual and not has_grace and is_slow(states, rules.stuck_speed)
    if stands:
        stands = not call(
            at.has_reason, has_reason, (map, states, t.stop_lane, t.stop_s, t.shown, rules.reach)
        )
    if stands:
        usual = (standing + 1) * rules.dt < rules.stuck_time
    return usual, stands, (lane, s, offset)


@inner_kernel
def ask_envelope(
    inside: Held[EnvelopeParts] | None, joined: Held[Joined], felt: Felt, n_radar: int,
    last: tuple[float, float, float],
) -> tuple[float, Told]:  # fmt: skip
    """Returns the m/s that the stack is told not to pass, and what the envelope says; all 0 without one.

    inside: of `joined`; an argument, as numba then leaves out what follows where it is None. last: throttle,
    brake, steer of the tick before.
    """
    rules = joined.value.rules
    if inside is None:
        return rules.v_told, NOTHING_TOLD
    echoes = joined.value.sensors.value.around.radar.echoes
    ego = Motion(
        felt[0], felt[1], felt[2], felt[4], felt[5], felt[6], felt[7], felt[8], felt[9],
        (felt[10], felt[11], felt[12], felt[13]),
    )  # fmt: skip
    told = call(
        joined.value.at.find_limits, find_limits,
        (
            inside, echoes[0, :n_radar], echoes[1, :n_radar], echoes[2, :n_radar],
            echoes[3, :n_radar], ego, last[0], last[1], last[2], rules.stage, rules.is_cold,
        ),
    )  # fmt: skip
    return max(told.speed, V_CREEP) if inside.value.rules.acts else rules.v_told, told


@inner_kernel
def obey_envelope(
    inside: Held[EnvelopeParts] | None, joined: Held[Joined], felt: Felt, told: Told, answer: Answer,
) -> Answer:  # fmt: skip
    """Returns the stack's answer, held back to what the envelope allows."""
    if inside is None:
        return answer
    throttle, brake = answer[1], answer[2]
    if inside.value.rules.acts and isfinite(felt[6]):
        throttle, brake = call(
            joined.value.at.keep_inside, keep_inside,
            (inside, told, felt[6], felt[9], throttle, brake, False),
        )  # fmt: skip
    return (answer[0], throttle, brake, *answer[3:])


@inner_kernel
def answer_tick(
    joined: Held[Joined], tick: int, felt: Felt, last: tuple[float, float, float]
) -> tuple[Answer, Way, Light]:
    """Senses and lets the stack decide: what it answers, where its way is, and the light ahead.

    last: throttle, brake, steer of the tick before.
    """
    at, rules, t = joined.value.at, joined.value.rules, joined.value.tables
    sensors = joined.value.sensors
    x, y, z, yaw, v = felt[0], felt[1], felt[2], felt[5], felt[6]
    eyes = sensors.value
    n_one, n_other, n_radar = call(at.sense, sense, (sensors, joined.value.map, tick))
    bumper, roof = (eyes.one, eyes.other) if rules.bumper_first else (eyes.other, eyes.one)
    b, r = (n_one, n_other) if rules.bumper_first else (n_other, n_one)
    echoes = eyes.around.radar.echoes
    v_told, told = ask_envelope(joined.value.inside, joined, felt, n_radar, last)
    way = call(
        at.read_road, read_road,
        (t.memory, joined.value.road, t.on_highway, t.ways, x, y, z, yaw, v, True),
    )  # fmt: skip
    source, state, there, stop = NONE_AHEAD, -1, nan, nan
    if rules.assists:
        source, ahead, there, stop = call(
            at.heed_light, heed_light,
            (t.memory, joined.value.lines, t.lines, way, rules.hsv_required, v, rules.dt),
        )  # fmt: skip
        if ahead >= 0:
            state = int(t.lines[ahead])
    answer = call(
        at.think, think,
        (
            t.memory, joined.value.stack, t.samples, t.history, t.kept, t.ways, t.room,
            bumper.runs[0, :b], bumper.runs[1, :b], bumper.runs[2, :b], bumper.runs[3, :b],
            bumper.runs[4, :b], bumper.classes[:b],
            roof.runs[0, :r], roof.runs[1, :r], roof.runs[2, :r], roof.runs[3, :r],
            roof.runs[4, :r], roof.classes[:r],
            echoes[0, :n_radar], echoes[1, :n_radar], echoes[2, :n_radar], echoes[3, :n_radar],
            t.on_highway, x, y, z, yaw, v, True, stop, inf, v_told,
        ),
    )  # fmt: skip
    answer = obey_envelope(joined.value.inside, joined, felt, told, answer)
    return answer, way, (source, state, there, stop)


@inner_kernel
def write_tick(
    joined: Held[Joined], k: int, tick: int, felt: Felt, answer: Answer, way: Way, light: Light
) -> None:
    """Writes row k of the log."""
    at, rules, t = joined.value.at, joined.value.rules, joined.value.tables
    rows, states = joined.value.arena.value.rows, joined.value.states
    t.ticks[k, 0], t.ticks[k, 1], t.ticks[k, 2] = tick, 0, rules.weather
    row = t.rows[k]
    row[0], row[1], row[2], row[3] = felt[0], felt[1], felt[5], felt[6]
    row[4], row[5], row[6] = felt[7], felt[8], felt[9]
    row[7] = count_gear(felt[6], rows.commands[EGO, 4] != 0.0)
    for c in range(5):
        row[APPLIED + c] = rows.commands[EGO, c]
    row[REQUESTED], row[REQUESTED + 1], row[REQUESTED + 2] = answer[1], answer[2], way[4]
    row[REQUESTED + 3], row[REQUESTED + 4] = 1.0 if answer[3] else 0.0, 0.0
    write_report(row, REPORT, answer, way, light, rules.assists, rules.dt)
    call(at.copy_actors, copy_actors, (states, rows.mu, joined.value.columns, k))


@inner_kernel
def has_arrived(t: Tables, felt: Felt) -> bool:
    """Follows the ego along its way, and returns whether it has come to the end."""
    if len(t.way) == 0:
        return False
    t.reached[0] = come_by(t.way, t.reached[0], felt[0], felt[1], felt[2])
    return bool(t.reached[0] == len(t.way) - 1)


@inner_kernel
def tell_actors(story: Held[Table] | None, joined: Held[Joined], tick: int) -> bool:
    """Plays the story on by a tick and hands its actors their pedals; False: Python has to play it.

    story: None as `inside` of `ask_envelope`.
    """
    if story is None:
        return True
    dt, commands = joined.value.rules.dt, joined.value.arena.value.rows.commands
    if not call(
        joined.value.at.play_tick, play_tick,
        (joined.value.map, joined.value.states, story, tick * dt, dt),
    ):  # fmt: skip
        return False
    actors, pedals = story.value.actors, story.value.pedals
    for i in range(len(actors)):
        if actors[i].is_told:
            command = commands[actors[i].row]
            command[0], command[1], command[2] = pedals[i, 0], pedals[i, 1], pedals[i, 2]
            command[3] = command[4] = 0.0
    return True


@kernel
def drive_ticks(
    joined: Held[Joined], story: Held[Table] | None, begun: bool, tick: int, n: int, k: int,
    grace: int, standing: int, throttle: float, brake: float, steer: float, handbrake: bool,
) -> tuple[int, int, int, int, float, float, float, bool, int, float, float, int]:  # fmt: skip
    """Drives up to n ticks after `tick` and writes rows of the log from k on.

    story: of a scenario, which says between two ticks what actors do; None: there is none. begun: the world
    has made the step of the first tick already, and stands at `tick`. grace: ticks without the detector of
    an ego that is stuck. standing: ticks for which it stands without a reason. throttle, brake, steer,
    handbrake: of the tick before. Returns ticks that are whole, why it came back, contacts and crossed
    markings of the step, the last request, lane (-1: not looked for), s and offset of the ego, and
    `standing`.
    """
    at, rules, arena = joined.value.at, joined.value.rules, joined.value.arena
    commands = arena.value.rows.commands
    done, why, touches, crossed, place = 0, DONE, 0, 0, (-1, nan, nan)
    while done < n:
        if not begun:
            commands[EGO, 0], commands[EGO, 1], commands[EGO, 2] = throttle, brake, steer
            commands[EGO, 3], commands[EGO, 4] = 1.0 if handbrake else 0.0, 0.0
            tick += 1
            why, touches, crossed = step_world(joined, tick)
            if why != DONE:
                break
        begun = False
        usual, stands, found = watch_ego(joined, standing, grace > done + 1)
        if not usual:
            why = UNUSUAL
            break
        place = found
        felt = call(at.feel_motion, feel_motion, (arena, EGO))
        answer, way, light = answer_tick(joined, tick, felt, (throttle, brake, steer))
        throttle, brake, steer, handbrake = answer[1], answer[2], way[4], answer[3]
        if not (0.0 <= throttle <= 1.0 and 0.0 <= brake <= 1.0 and -1.0 <= steer <= 1.0):
            why = REFUSED
            break
        standing = standing + 1 if stands and not (rules.holding >> answer[0]) & 1 else 0
        write_tick(joined, k + done, tick, felt, answer, way, light)
        done += 1
        if has_arrived(joined.value.tables, felt):
            why = ARRIVED
            break
        if done < n and not tell_actors(story, joined, tick):
            why = TOLD
            break
    return (
        done, why, touches, crossed, throttle, brake, steer, handbrake, *place, standing,
    )  # fmt: skip
