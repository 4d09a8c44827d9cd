"""What OpenSCENARIO files cost in CPU time: played, checked, and read when they are large.

For `skidpad bench scenarios`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from time import process_time_ns

from skidpad.campaign.bench.tick import Meter, Spans
from skidpad.campaign.driving.run_setup import stage_of
from skidpad.campaign.runs.run import run
from skidpad.core.courses import ActorMode, Scenario
from skidpad.core.run import Passenger, RunSpec
from skidpad.core.setup import DT
from skidpad.core.vocabulary import SensorLevel
from skidpad.scenarios.playing.stage import play_ideal
from skidpad.scenarios.scenario import check, compile_scenario

REPEATS = 5
SECONDS = 60.0  # s simulated per measurement
CHECKS, CHECKS_TARGET = 800, 2.0  # files; s
LARGE, LARGE_TARGET = 5_000_000, 1.0  # bytes; s
PLAYED_TARGET = 300.0  # times real time
NS = 1.0e-9  # s

BOX = (
    '<BoundingBox><Center x="1.4" y="0" z="0.7"/><Dimensions width="1.8" length="4.2" height="1.5"/>'
    "</BoundingBox>"
)
AXLE = 'wheelDiameter="0.6" trackWidth="1.6" positionZ="0.3"'
CAR = f"""<Vehicle name="car" vehicleCategory="car">{BOX}
<Performance maxSpeed="70" maxDeceleration="10" maxAcceleration="10"/><Axles>
<FrontAxle maxSteering="0.5" positionX="2.7" {AXLE}/><RearAxle maxSteering="0" positionX="0" {AXLE}/>
</Axles><Properties/></Vehicle>"""
STEP = '<SpeedActionDynamics dynamicsShape="step" value="0" dynamicsDimension="time"/>'
SLOWER = """<LongitudinalAction><SpeedAction><SpeedActionDynamics dynamicsShape="linear" value="3"
dynamicsDimension="time"/><SpeedActionTarget><AbsoluteTargetSpeed value="8"/></SpeedActionTarget>
</SpeedAction></LongitudinalAction>"""
ASIDE = """<LateralAction><LaneChangeAction><LaneChangeActionDynamics dynamicsShape="sinusoidal"
value="4" dynamicsDimension="time"/><LaneChangeTarget><AbsoluteTargetLane value="-2"/>
</LaneChangeTarget></LaneChangeAction></LateralAction>"""
LINE = """<RoutingAction><FollowTrajectoryAction><TrajectoryRef><Trajectory name="t" closed="false">
<Shape><Polyline>{}</Polyline></Shape></Trajectory></TrajectoryRef><TimeReference><Timing
domainAbsoluteRelative="absolute" scale="1" offset="0"/></TimeReference><TrajectoryFollowingMode
followingMode="position"/></FollowTrajectoryAction></RoutingAction>"""
VERTEX = (
    '<Vertex time="{:.4f}"><Position><WorldPosition x="{:.4f}" y="-1.75"/></Position></Vertex>\n'
)
V_LINE, VERTEX_EVERY = 10.0, 0.001  # m/s; s


@dataclass(frozen=True, slots=True)
class ScenarioCost:
    """One figure; most: it may be no larger than its target, else no smaller."""

    what: str
    value: float
    unit: str
    target: float
    most: bool

    @property
    def is_met(self) -> bool:
        """Returns True when the value reaches its target: at most it if `most`, else at least it."""
        return self.value <= self.target if self.most else self.value >= self.target


def measure(seconds: float = SECONDS, repeats: int = REPEATS) -> list[ScenarioCost]:
    """Returns the median speed of playing and duration of checking, of `repeats` each.

    seconds: simulated per play. Kernels and maps are loaded before; files are written and compiled
    outside the clock.
    """
    with TemporaryDirectory() as folder:
        small, large = Path(folder) / "two.xosc", Path(folder) / "large.xosc"
        small.write_text(two_cars(SLOWER, ASIDE, seconds=seconds), encoding="utf-8")
        large.write_text(two_cars(long_line(), seconds=seconds), encoding="utf-8")
        spec = RunSpec(
            driver=Passenger(),
            course=Scenario(file=str(small), actors=ActorMode.IDEAL),
            duration=seconds,
            sensors=SensorLevel.OBJECTS,
        )
        return [
            _fast("played by itself", lambda: _by_itself(small, seconds), repeats),
            _fast("played as `play` does", lambda: _drive_spec(spec), repeats),
            _short(f"{CHECKS} checks", lambda: _checks(small, CHECKS), repeats, CHECKS_TARGET),
            _short("a check of 5 MB", lambda: _checks(large, 1), repeats, LARGE_TARGET),
        ]


def _fast(what: str, once: Callable[[], float], repeats: int) -> ScenarioCost:
    """Returns the median speed of a play, in multiples of real time, beside its target.

    what: the name of the figure; once: plays once and returns the speed.
    """
    return ScenarioCost(what, _median(once, repeats), "times real time", PLAYED_TARGET, most=False)


def _short(what: str, once: Callable[[], float], repeats: int, target: float) -> ScenarioCost:
    """Returns the median of a duration in s beside its upper target.

    what: the name of the figure; once: measures once and returns the duration.
    """
    return ScenarioCost(what, _median(once, repeats), "s", target, most=True)


def _median(once: Callable[[], float], repeats: int) -> float:
    """Returns the median of `repeats` results, after one that warms up."""
    once()
    return median(once() for _ in range(repeats))


def _by_itself(file: Path, seconds: float) -> float:
    """Returns how many times faster than real time a file plays by itself, in CPU time."""
    scenario = compile_scenario(file)
    begin = process_time_ns()
    play_ideal(scenario, seconds)
    return seconds / ((process_time_ns() - begin) * NS)


def _drive_spec(spec: RunSpec) -> float:
    """Returns how many times faster than real time a run drives, in CPU time; the log stays in memory."""
    clock = Spans(Meter(), 0)
    run(spec, stage=stage_of(spec), sinks=(clock,))
    return float(len(clock.spans) * DT / (clock.spans.sum() * NS))


def _checks(file: Path, count: int) -> float:
    """Returns the CPU time in s of checking a file `count` times."""
    begin = process_time_ns()
    for _ in range(count):
        check(file).playable()
    return (process_time_ns() - begin) * NS


def long_line(size: int = LARGE) -> str:
    """Returns the XML of an action along so many points that a file with it has at least `size` bytes."""
    count = size // (len(VERTEX.format(0.0, 0.0)) + 2) + 1
    times = (k * VERTEX_EVERY for k in range(count))
    return LINE.format("".join(VERTEX.format(t, 200.0 + V_LINE * t) for t in times))


def two_cars(*actions: str, seconds: float) -> str:
    """Returns an OpenSCENARIO text of two cars on the straight; the second acts, one action every 5 s.

    seconds: of simulation after which it stops.
    """
    objects = "".join(
        f'<ScenarioObject name="{n}">{CAR}</ScenarioObject>' for n in ("ego", "other")
    )
    begins = _begin("ego", -3, 100) + _begin("other", -1, 150)
    events = "".join(_event(k, action) for k, action in enumerate(actions))
    return f"""<?xml version="1.0"?>
<OpenSCENARIO><FileHeader revMajor="1" revMinor="2" date="2026-01-01T00:00:00" description="two cars"
author="skidpad bench"/><CatalogLocations/><RoadNetwork><LogicFile filepath="straight.xodr"/>
</RoadNetwork><Entities>{objects}</Entities><Storyboard><Init><Actions>{begins}</Actions></Init>
<Story name="s"><Act name="a"><ManeuverGroup name="g" maximumExecutionCount="1">
<Actors selectTriggeringEntities="false"><EntityRef entityRef="other"/></Actors><Maneuver name="m">
{events}</Maneuver></ManeuverGroup><StartTrigger>{_when(0.0)}</StartTrigger></Act></Story>
<StopTrigger>{_when(seconds)}</StopTrigger></Storyboard></OpenSCENARIO>
"""


def _begin(name: str, lane: int, s: float) -> str:
    """Returns the XML that puts an entity on road 1 at `s` m with 10 m/s."""
    return f"""<Private entityRef="{name}"><PrivateAction><TeleportAction><Position>
<LanePosition roadId="1" laneId="{lane}" s="{s}"/></Position></TeleportAction></PrivateAction>
<PrivateAction><LongitudinalAction><SpeedAction>{STEP}<SpeedActionTarget>
<AbsoluteTargetSpeed value="10"/></SpeedActionTarget></SpeedAction></LongitudinalAction>
</PrivateAction></Private>"""


def _event(k: int, action: str) -> str:
    """Returns the XML of an event with the action, started at 5 k s."""
    return f"""<Event name="e{k}" priority="parallel"><Action name="e{k}"><PrivateAction>{action}
</PrivateAction></Action><StartTrigger>{_when(5.0 * k)}</StartTrigger></Event>"""


def _when(t: float) -> str:
    """Returns the XML of a condition that holds from `t` s of simulation on."""
    return f"""<ConditionGroup><Condition name="c" delay="0" conditionEdge="none"><ByValueCondition>
<SimulationTimeCondition value="{t}" rule="greaterOrEqual"/></ByValueCondition></Condition>
</ConditionGroup>"""
