"""Traffic signal controllers of a file: phases one after the other, over and over."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from skidpad.core.vocabulary import LightState
from skidpad.roads.opendrive.reader import id_number
from skidpad.scenarios.reading.document import Node
from skidpad.scenarios.scene import Scene

LAMPS = (LightState.RED, LightState.YELLOW, LightState.GREEN)  # from the top, as esmini reads three
LIT = ("on", "flashing")


@dataclass(frozen=True, slots=True)
class Phase:
    """The states that signals of a controller have for a while."""

    name: str
    duration: float  # s
    states: Mapping[str, str]  # by signal


@dataclass(frozen=True, slots=True)
class SignalController:
    """A cycle of phases; delay: s by which it lies behind time 0."""

    name: str
    phases: tuple[Phase, ...]
    delay: float

    def phase(self, t: float) -> Phase | None:
        """Returns the phase at t s of its cycle; None where there is no cycle."""
        cycle = sum(p.duration for p in self.phases)
        if cycle <= 0.0:
            return None
        left = t % cycle
        for phase in self.phases:
            left -= phase.duration
            if left < -1e-9:
                return phase
        return self.phases[0]

    def begin_of(self, name: str) -> float | None:
        """Returns when a phase begins in the cycle, s; None where there is no such phase."""
        t = 0.0
        for phase in self.phases:
            if phase.name == name:
                return t
            t += phase.duration
        return None


def compile_signals(road: Node | None) -> tuple[SignalController, ...]:
    """Returns the controllers of a <RoadNetwork>; a delay counts from the controller that is referred to."""
    signals = None if road is None else road.find("TrafficSignals")
    if signals is None:
        return ()
    nodes = {n.text("name"): n for n in signals.children("TrafficSignalController")}
    return tuple(
        SignalController(name, tuple(_phases(node)), _delay(node, nodes))
        for name, node in nodes.items()
    )


def _phases(node: Node) -> list[Phase]:
    """Returns the phases of a signal controller, with durations in s of at most 1e9."""
    found = []
    for phase in node.children("Phase"):
        duration = phase.limit("duration")
        if duration < 0.0:
            raise phase.error(f"duration must be >= 0, got {duration:g}")
        states = {
            s.text("trafficSignalId"): s.text("state") for s in phase.children("TrafficSignalState")
        }
        found.append(Phase(phase.text("name"), min(duration, 1e9), states))
    return found


def _delay(node: Node, nodes: Mapping[str, Node]) -> float:
    """Returns the delay in s of a controller, summed along its chain of references."""
    total, seen = 0.0, set[str]()
    while True:
        total += node.number("delay", 0.0)
        reference = node.text("reference", "")
        if not reference:
            return total
        if reference in seen or reference not in nodes:
            raise node.error(f"reference: there is no controller {reference!r} to count from")
        seen.add(reference)
        node = nodes[reference]


def read_signal_state(state: str) -> LightState | None:
    """Returns what a light shows: a colour, or three lamps from the top (`on;off;off`).

    `flashing` counts as lit, the topmost lit lamp decides, and none lit is OFF. The standard leaves
    states to the road's own signals; other words are for conditions alone: None.
    """
    words = [word.strip().lower() for word in state.split(";")]
    if len(words) == len(LAMPS):
        return next(
            (lamp for lamp, word in zip(LAMPS, words, strict=True) if word in LIT), LightState.OFF
        )
    found = LightState.__members__.get(words[0].upper())
    return None if found is LightState.UNKNOWN else found


def held_lights(scene: Scene) -> tuple[tuple[int, LightState], ...]:
    """Returns the colours of signals that the file has set, by the road's ids; `id=7` as CARLA has it.

    Signals in other states are left out.
    """
    states = (
        (id_number(n.removeprefix("id=")), read_signal_state(s)) for n, s in scene.signals.items()
    )
    return tuple((id, state) for id, state in states if state is not None)


class SignalPlan:
    """The controllers while a scenario is played; what an action sets goes on from there."""

    def __init__(self, controllers: Sequence[SignalController]) -> None:
        self.controllers = controllers
        self.shifts = [-c.delay for c in controllers]
        self.told: dict[str, str] = {}

    def step(self, scene: Scene) -> None:
        """Sets the phases and states that begin now in the scene's signals."""
        for k, controller in enumerate(self.controllers):
            name = controller.name
            asked = scene.signals.get(name)
            begin = None if asked == self.told.get(name) else controller.begin_of(asked or "")
            if begin is not None:
                self.shifts[k] = begin - scene.t
            phase = controller.phase(scene.t + self.shifts[k])
            if phase is not None and (begin is not None or self.told.get(name) != phase.name):
                self.told[name] = phase.name
                scene.signals.update({name: phase.name, **phase.states})
