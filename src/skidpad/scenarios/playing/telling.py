"""A storyboard being told: what has begun, what is under way, what is complete.

In each step triggers are looked at from the top down, then what is under way goes on, as in
esmini: what begins in a step takes part in it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from skidpad.scenarios.elements import Move, Path, State
from skidpad.scenarios.scene import Running, Scene
from skidpad.scenarios.storyboard import (
    Act,
    Event,
    Group,
    Manoeuvre,
    NamedAction,
    Priority,
    Story,
    Storyboard,
)
from skidpad.scenarios.triggers import Watch, Watched

RUNNING, COMPLETE = State.RUNNING, State.COMPLETE  # asked in every step


class StatefulElement:
    """An element with a state, told to the scene when it changes."""

    def __init__(self, path: Path) -> None:
        self.path, self.state = path, State.STANDBY

    def turn(self, scene: Scene, state: State, move: Move) -> None:
        """Sets the element's state and reports it, and the transition, to the scene."""
        self.state = state
        scene.states[self.path] = state
        scene.moved(self.path, move)

    @property
    def running(self) -> bool:
        """Returns whether the element is under way."""
        return self.state is RUNNING

    @property
    def complete(self) -> bool:
        """Returns whether the element is in the state COMPLETE."""
        return self.state is COMPLETE


class ToldEvent(StatefulElement):
    """An event of a run, with its actions under way."""

    def __init__(self, event: Event, group: Group) -> None:
        super().__init__(event.path)
        self.event, self.group, self.left = event, group, event.count
        self.watch = Watch(event.start, event.path)
        self.going: list[tuple[Path, list[Running]]] = []
        self.happened_at: float | None = None  # s, the first time

    def due(self, scene: Scene) -> bool:
        """Tells whether the trigger fires, executions are left and it is not running.

        Without a start trigger it fires always.
        """
        fires = not self.watch.groups or self.watch.fires(scene)
        return fires and self.left > 0 and self.state is not RUNNING

    def launch(self, scene: Scene, others: Iterable[ToldEvent]) -> None:
        """Begins, as the priority has it with other events under way; uses up one execution.

        With priority skip it does not begin beside others; with override it stops them.
        """
        under_way = [e for e in others if e.running]
        if under_way and self.event.priority is Priority.SKIP:
            self.left -= 1
            over = self.left <= 0
            self.turn(scene, State.COMPLETE if over else State.STANDBY, Move.SKIP)
            return
        if self.event.priority in (Priority.OVERRIDE, Priority.OVERWRITE):
            for other in under_way:
                other.stop(scene)
        self.left -= 1
        if self.happened_at is None:
            self.happened_at = scene.t
        self.turn(scene, State.RUNNING, Move.START)
        self.going = []
        chosen = self.watch.triggering(scene) if self.group.by_trigger else []
        actors = dict.fromkeys((*self.group.actors, *chosen))
        for action in self.event.actions:
            scene.states[action.path] = State.RUNNING
            scene.moved(action.path, Move.START)
            self.going.append((action.path, list(_begin_action(action, actors, scene))))

    def step(self, scene: Scene) -> None:
        """Goes on with the actions under way; the event ends with the last of them."""
        if self.state is not RUNNING:
            return
        still = []
        for path, runs in self.going:
            runs = [r for r in runs if not r.step(scene)]
            if runs:
                still.append((path, runs))
            else:
                scene.states[path] = State.COMPLETE
                scene.moved(path, Move.END)
        self.going = still
        if not still:
            self.turn(scene, State.STANDBY if self.left > 0 else State.COMPLETE, Move.END)

    def stop(self, scene: Scene) -> None:
        """Ends the event early: actors let go of its actions, and it is complete."""
        if self.complete:
            return
        for path, runs in self.going:
            for run in runs:
                _let_go(run, scene)
            scene.states[path] = State.COMPLETE
            scene.moved(path, Move.STOP)
        self.going = []
        self.turn(scene, State.COMPLETE, Move.STOP)


def _let_go(action: Running, scene: Scene) -> None:
    """Makes every actor of the scene let go of the action."""
    for actor in scene.actors.values():
        actor.let_go(action, scene.network)


def _begin_action(action: NamedAction, actors: Iterable[str], scene: Scene) -> Iterable[Running]:
    """Begins a global action once or a private action for each actor, and yields what is then running."""
    if action.worldwide is not None:
        yield action.worldwide.happen(scene)
    if action.private is not None:
        for name in actors:
            yield action.private.begin(scene, scene.actors[name])


class ToldParent(StatefulElement):
    """An element that is complete when all its children are."""

    def __init__(self, path: Path, children: Sequence[ToldParent | ToldEvent]) -> None:
        super().__init__(path)
        self.children = children

    def start(self, scene: Scene) -> None:
        """Sets it running, and its children, which have no triggers of their own."""
        self.turn(scene, State.RUNNING, Move.START)
        for child in self.children:
            if isinstance(child, ToldParent):
                child.start(scene)

    def step(self, scene: Scene) -> None:
        """Steps the elements inside, and ends when all of them are complete."""
        if self.state is not RUNNING:
            return
        for child in self.children:
            child.step(scene)
        for child in self.children:
            if child.state is not COMPLETE:
                return
        self.end(scene)

    def end(self, scene: Scene) -> None:
        """Sets the element complete, as all inside is complete."""
        self.turn(scene, State.COMPLETE, Move.END)

    def stop(self, scene: Scene) -> None:
        """Ends the element and its children early."""
        for child in self.children:
            child.stop(scene)
        if not self.complete:
            self.turn(scene, State.COMPLETE, Move.STOP)


class ToldManoeuvre(ToldParent):
    """Events, which begin by their triggers."""

    def __init__(self, manoeuvre: Manoeuvre, group: Group) -> None:
        self.events = [ToldEvent(e, group) for e in manoeuvre.events]
        super().__init__(manoeuvre.path, self.events)

    def look(self, scene: Scene) -> None:
        """Launches every event that is due."""
        for event in self.events:
            if event.due(scene):
                event.launch(scene, [e for e in self.events if e is not event])


class ToldGroup(ToldParent):
    """Manoeuvres, told several times where the file says so."""

    def __init__(self, group: Group) -> None:
        self.group, self.left = group, group.count
        self.manoeuvres = [ToldManoeuvre(m, group) for m in group.manoeuvres]
        super().__init__(group.path, self.manoeuvres)

    def end(self, scene: Scene) -> None:
        """Begins the group once more, or sets it complete when its count is used up."""
        self.left -= 1
        if self.left <= 0:
            self.turn(scene, State.COMPLETE, Move.END)
            return
        scene.moved(self.path, Move.END)
        self.manoeuvres = [ToldManoeuvre(m, self.group) for m in self.group.manoeuvres]
        self.children = self.manoeuvres
        for event in (e for m in self.group.manoeuvres for e in m.events):
            for path in (event.path, *(action.path for action in event.actions)):
                scene.states[path] = State.STANDBY
        self.start(scene)


class ToldAct(ToldParent):
    """Groups between a start and a stop trigger."""

    def __init__(self, act: Act) -> None:
        self.groups = [ToldGroup(g) for g in act.groups]
        super().__init__(act.path, self.groups)
        self.begin, self.halt = Watch(act.start, act.path), Watch(act.stop, act.path)

    def look(self, scene: Scene) -> None:
        """Begins or stops by its triggers, then looks inside."""
        if self.halt.groups and self.state is RUNNING and self.halt.fires(scene):
            self.stop(scene)
        if self.state is State.STANDBY and (not self.begin.groups or self.begin.fires(scene)):
            self.turn(scene, State.RUNNING, Move.START)
            for group in self.groups:
                group.start(scene)
        if self.state is not RUNNING:
            return
        for group in self.groups:
            if group.state is RUNNING:
                for manoeuvre in group.manoeuvres:
                    if manoeuvre.state is RUNNING:
                        manoeuvre.look(scene)

    def running_manoeuvres(self) -> Iterator[ToldManoeuvre]:
        """Yields the manoeuvres under way of the groups under way."""
        for group in self.groups:
            if group.state is RUNNING:
                yield from (m for m in group.manoeuvres if m.state is RUNNING)


class ToldStory(ToldParent):
    """Acts of one story while it is played."""

    def __init__(self, story: Story) -> None:
        self.acts = [ToldAct(a) for a in story.acts]
        super().__init__(story.path, self.acts)

    def start(self, scene: Scene) -> None:
        """Sets the story running; its acts have triggers of their own."""
        self.turn(scene, State.RUNNING, Move.START)


class Telling:
    """All stories of a run. Without a stop trigger it ends when all acts are complete.

    A storyboard without any event, whose <Init> alone moves entities, does not end by itself.
    """

    def __init__(self, board: Storyboard) -> None:
        self.stories = [ToldStory(s) for s in board.stories]
        self.acts = [a for s in self.stories for a in s.acts]
        self.halt = Watch(board.stop)
        self.begun = self.ended = False
        self.ends = not self.halt.groups and bool(board.events)

    @property
    def events(self) -> list[ToldEvent]:
        """Returns every event of all stories."""
        return [e for a in self.acts for g in a.groups for m in g.manoeuvres for e in m.events]

    def list_conditions(self) -> Iterator[Watched]:
        """Yields the conditions that `look` looks at as long as nothing begins or ends."""
        watches = [self.halt]
        for act in (a for s in self.stories if s.state is RUNNING for a in s.acts):
            if act.state is State.STANDBY:
                watches.append(act.begin)
            elif act.state is RUNNING:
                watches.append(act.halt)
                watches += [e.watch for m in act.running_manoeuvres() for e in m.events]
        for watch in watches:
            for group in watch.groups:
                yield from group

    def list_actions(self) -> Iterator[Running]:
        """Yields the actions that go on, in the order of their steps."""
        for act in (a for s in self.stories if s.state is RUNNING for a in s.acts):
            for manoeuvre in act.running_manoeuvres() if act.state is RUNNING else ():
                for event in manoeuvre.events:
                    for _, runs in event.going:
                        yield from runs

    def look(self, scene: Scene) -> None:
        """Looks at the triggers of all stories, which the first call starts; `ended` by the stop trigger."""
        if not self.begun:
            self.begun = True
            for story in self.stories:
                story.start(scene)
        if self.halt.groups and self.halt.fires(scene):
            self.ended = True
        for story in self.stories:
            if story.state is RUNNING:
                for act in story.acts:
                    act.look(scene)

    def step(self, scene: Scene) -> None:
        """Goes on with what is under way; `ended` when all acts are complete, where that ends it."""
        for story in self.stories:
            story.step(scene)
        for act in self.acts if self.ends else ():
            if act.state is not COMPLETE:
                return
        self.ended = self.ended or self.ends
