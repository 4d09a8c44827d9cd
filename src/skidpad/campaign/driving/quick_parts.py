"""Which runs have a quick way, and what of a run takes part in it."""

from __future__ import annotations

from math import inf
from typing import NamedTuple

from skidpad.campaign.driving.loop import Arrival, Stepper, Timer, Unsupervised
from skidpad.campaign.driving.outdoors import ChangedBackend, FileChanges
from skidpad.campaign.driving.quick_tables import Rules
from skidpad.campaign.driving.stack_at_wheel import StackAtWheel
from skidpad.envelope.belief import COLD_C
from skidpad.envelope.govern import GovernedStack
from skidpad.sensors.object_level.objects import ObjectSuite
from skidpad.simulation.embedded.engine import EmbeddedBackend
from skidpad.simulation.recovery import HOLDING, LIGHT_REACH, Supervisor
from skidpad.simulation.sensing import Objects
from skidpad.simulation.world.step import DECIDE, MOVE
from skidpad.simulation.world.world import World
from skidpad.stack.adas import AdasStack
from skidpad.stack.loading import GuardedStack

ANOTHER_SIMULATOR = "another simulator drives"


class QuickParts(NamedTuple):
    """What of a run takes part in its quick way.

    timer: counts the ticks of a run whose world a kernel steps; None: Python steps it, as a story is asked
    or patches, wind or roll-over are looked at in each tick; while a table holds the story, in a kernel, too.
    way: of a run that ends with it.
    changed: the backend of one with a script, and the file's changes.
    """

    backend: EmbeddedBackend
    world: World
    suite: ObjectSuite
    guard: GuardedStack
    stack: AdasStack
    governed: GovernedStack | None  # what keeps the stack inside an envelope
    supervisor: Supervisor | None
    timer: Timer | None
    way: Arrival | None
    changed: tuple[ChangedBackend, FileChanges] | None


def find_parts(stepper: Stepper, changes: FileChanges | None = None) -> QuickParts | str:
    """Returns the parts of a run that has begun; else the first reason for which it has no quick way.

    changes: of a file that is played.
    """
    script = stepper.script
    backend: object = stepper.backend
    changed: tuple[ChangedBackend, FileChanges] | None = None
    if isinstance(backend, ChangedBackend) and changes is not None and script is changes.player:
        changed = backend, changes
        backend = backend.inner
    if isinstance(backend, ChangedBackend):
        return "the world is changed from outside"
    if type(backend) is not EmbeddedBackend:
        return ANOTHER_SIMULATOR
    sensing, supervisor = backend.sensing, stepper.supervisor
    if type(sensing) is not Objects:
        return "its sensors are pixels, or a radar with noise"
    driving = _find_stack(stepper.driver, backend.world.dt)
    if isinstance(driving, str):
        return driving
    suite, timer, way = sensing.suite, None, None
    if not backend.has_common_frames or suite.hold_common(backend.world.states) is None:
        return "it has other sensors than the common ones, or its localisation is noisy"
    if type(supervisor) not in (Supervisor, Unsupervised):
        return "another supervisor looks on, or a person is at the controls"
    supervising = supervisor if isinstance(supervisor, Supervisor) else None
    if changed is None:
        ending = script.script if type(script) is Timer else script
        if type(script) is not Timer or not (ending is None or type(ending) is Arrival):
            return "a script is followed in each tick"
        if backend.steps_alone:
            timer, way = script, ending
    for sink in stepper.sinks:
        if sink.sees_all:
            return f"{type(sink).__name__} is shown each tick"
    return QuickParts(backend, backend.world, suite, *driving, supervising, timer, way, changed)


def _find_stack(
    driver: object, dt: float
) -> tuple[GuardedStack, AdasStack, GovernedStack | None] | str:
    """Returns the driver's stack in its guard, and what keeps it inside an envelope; else the reason.

    dt: s of the world's steps.
    """
    if type(driver) is not StackAtWheel:
        return "another driver is at the wheel"
    outer = driver.stack.stack
    governed = outer if isinstance(outer, GovernedStack) else None
    stack = outer if governed is None else governed.inner
    if type(stack) is not AdasStack:
        return "another stack drives"
    if stack.config.dt != dt:
        return "the steps of its stack have another length"
    reason = stack.why_not_quick() or (governed and governed.why_not_quick())
    return reason or (driver.stack, stack, governed)


def make_rules(parts: QuickParts, weather: int) -> Rules:
    """Returns what holds in all ticks of a call; weather: its number in the log."""
    world, stack, supervisor = parts.world, parts.stack, parts.supervisor
    far, stuck = (inf, inf) if world.traffic is None else world.traffic.limits()
    governed = parts.governed
    governs = governed is not None and governed.envelope.rules.acts  # and tells it anew
    stage, air_c = (0, 0.0) if governed is None else parts.backend.read_air()
    return Rules(
        dt=world.dt,
        substeps=world.fleet.steps,
        moving=MOVE if parts.timer is None else DECIDE | MOVE,
        weather=weather,
        bumper_first=parts.suite.camera_ids[0] == stack.cameras.bumper.depth_id,
        supervised=supervisor is not None,
        stuck_speed=0.0 if supervisor is None else supervisor.settings.stuck_speed,
        stuck_time=inf if supervisor is None else supervisor.settings.stuck_time,
        holding=sum(1 << tier for tier in HOLDING),
        reach=LIGHT_REACH,
        v_told=inf if governs else stack.v_told,
        far=far,
        stuck=stuck,
        assists=stack.assists,
        hsv_required=stack.lock.hsv_required,
        stage=stage,
        is_cold=air_c < COLD_C,
    )
