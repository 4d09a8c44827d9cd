"""Stories, acts, groups, manoeuvres and events: who does what, when, and how far it has come."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from skidpad.scenarios.actions import GlobalAction, PrivateAction, global_action, private_action
from skidpad.scenarios.conditions import Trigger
from skidpad.scenarios.reader import Node, Unsupported
from skidpad.scenarios.scene import Running, Scene, State

PRIORITIES = ("parallel", "override", "overwrite", "skip")


class Element:
    """Something with a name and a state, told to the scene when it changes."""

    def __init__(self, node: Node) -> None:
        self.name = node.text("name")
        self.state = State.STANDBY

    def turn(self, scene: Scene, state: State, move: str) -> None:
        """Into another state."""
        self.state = state
        scene.states[self.name] = state
        scene.moves[self.name] = move

    def start(self, scene: Scene) -> None:
        """Into the running state."""
        self.turn(scene, State.RUNNING, "startTransition")

    def end(self, scene: Scene) -> None:
        """Into the complete state."""
        self.turn(scene, State.COMPLETE, "endTransition")


class Act(Element):
    """A set of groups between a start and a stop trigger."""

    def __init__(self, node: Node, dt: float) -> None:
        super().__init__(node)
        self.groups = [Group(g, dt) for g in node.children("ManeuverGroup")]
        self.begin = Trigger(node.find("StartTrigger"), dt)
        self.stop = Trigger(node.find("StopTrigger"), dt)

    def step(self, scene: Scene) -> None:
        """One step of everything inside."""
        if self.state is State.STANDBY and (not self.begin or self.begin.fires(scene)):
            self.start(scene)
        if self.state is not State.RUNNING:
            return
        if self.stop.fires(scene):
            self.turn(scene, State.COMPLETE, "stopTransition")
            return
        for group in self.groups:
            group.step(scene)
        if all(group.state is State.COMPLETE for group in self.groups):
            self.end(scene)


class Group(Element):
    """Manoeuvres of the same actors."""

    def __init__(self, node: Node, dt: float) -> None:
        super().__init__(node)
        actors = node.child("Actors")
        if actors.flag("selectTriggeringEntities", default=False):
            raise Unsupported(actors, "selectTriggeringEntities is not supported")
        if node.number("maximumExecutionCount", 1.0) != 1.0:
            raise Unsupported(node, "groups that run several times are not supported")
        names = tuple(n.text("entityRef") for n in actors.children("EntityRef"))
        found = list(node.children("Maneuver"))
        for reference in node.children("CatalogReference"):
            raise Unsupported(reference)
        self.manoeuvres = [Manoeuvre(m, names, dt) for m in found]

    def step(self, scene: Scene) -> None:
        """One step of everything inside."""
        if self.state is State.STANDBY:
            self.start(scene)
        if self.state is State.COMPLETE:
            return
        for manoeuvre in self.manoeuvres:
            manoeuvre.step(scene)
        if all(m.state is State.COMPLETE for m in self.manoeuvres):
            self.end(scene)


class Manoeuvre(Element):
    """Events that share actors."""

    def __init__(self, node: Node, actors: tuple[str, ...], dt: float) -> None:
        super().__init__(node)
        self.events = [Event(e, actors, dt) for e in node.children("Event")]

    def step(self, scene: Scene) -> None:
        """Let events begin by their triggers, and go on with those under way."""
        if self.state is State.STANDBY:
            self.start(scene)
        for event in self.events:
            if event.wants_to_begin(scene):
                event.launch(scene, [e for e in self.events if e.state is State.RUNNING])
        for event in self.events:
            event.step(scene)
        if self.state is State.RUNNING and all(e.state is State.COMPLETE for e in self.events):
            self.end(scene)


class Event(Element):
    """Actions that begin together."""

    def __init__(self, node: Node, actors: tuple[str, ...], dt: float) -> None:
        super().__init__(node)
        self.priority = node.choice("priority", PRIORITIES)
        self.left = int(node.number("maximumExecutionCount", 1.0))
        self.actors = actors
        self.actions = [_action(a) for a in node.children("Action")]
        self.begin = Trigger(node.find("StartTrigger"), dt)
        self.running: list[Running] = []
        self.happened = False

    def wants_to_begin(self, scene: Scene) -> bool:
        """The trigger fires, and the event may still run."""
        fires = not self.begin or self.begin.fires(scene)
        return fires and self.left > 0 and self.state is not State.RUNNING

    def launch(self, scene: Scene, others: Sequence[Event]) -> None:
        """Begin, as the priority has it with other events under way."""
        if others and self.priority == "skip":
            self.left -= 1
            self.turn(scene, State.STANDBY, "skipTransition")
            return
        if self.priority in ("override", "overwrite"):
            for other in others:
                other.running.clear()
                other.turn(scene, State.COMPLETE, "stopTransition")
        self.left -= 1
        self.happened = True
        self.running = [r for action in self.actions for r in self._begin(action, scene)]
        self.start(scene)

    def _begin(self, action: PrivateAction | Worldwide, scene: Scene) -> Iterator[Running]:
        if isinstance(action, Worldwide):
            yield action.action.begin(scene)
            return
        for name in self.actors:
            yield action.begin(scene, scene.actors[name])

    def step(self, scene: Scene) -> None:
        """Go on with the actions under way."""
        if self.state is not State.RUNNING:
            return
        self.running = [r for r in self.running if not r.step(scene)]
        if not self.running:
            if self.left > 0:
                self.turn(scene, State.STANDBY, "endTransition")
            else:
                self.end(scene)


@dataclass(frozen=True, slots=True)
class Worldwide:
    """An action that has no actor."""

    action: GlobalAction


def _action(node: Node) -> PrivateAction | Worldwide:
    inner = node.only()
    if inner.tag == "PrivateAction":
        return private_action(inner)
    if inner.tag == "GlobalAction":
        return Worldwide(global_action(inner))
    raise Unsupported(inner)


class Storyboard:
    """All acts of all stories, and what ends them."""

    def __init__(self, node: Node, dt: float) -> None:
        self.acts = [Act(a, dt) for s in node.children("Story") for a in s.children("Act")]
        self.stop = Trigger(node.find("StopTrigger"), dt)
        self.ended = False

    @property
    def events(self) -> list[Event]:
        """Every event."""
        groups = (g for a in self.acts for g in a.groups)
        return [e for g in groups for m in g.manoeuvres for e in m.events]

    def step(self, scene: Scene) -> None:
        """One step. Without a stop trigger it ends when all acts are complete."""
        for act in self.acts:
            act.step(scene)
        if self.stop:
            self.ended = self.ended or self.stop.fires(scene)
        elif self.acts and all(a.state is State.COMPLETE for a in self.acts):
            self.ended = True
        scene.moves.clear()
