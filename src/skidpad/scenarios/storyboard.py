"""The storyboard of a file: stories, acts, groups, manoeuvres and events, as they are written."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from functools import partial

from skidpad.scenarios.actions.base import GlobalAction, PrivateAction
from skidpad.scenarios.actions.private import private_action
from skidpad.scenarios.actions.world import global_action, user_defined
from skidpad.scenarios.context import Context, Path
from skidpad.scenarios.reading.document import Node
from skidpad.scenarios.reading.findings import Fault, Kind
from skidpad.scenarios.reading.outline import describe_element
from skidpad.scenarios.reading.parameters import inner
from skidpad.scenarios.triggers import Trigger, compile_trigger


class Priority(Enum):
    """What an event does to others of its manoeuvre that are under way."""

    PARALLEL = "parallel"
    OVERRIDE = "override"
    OVERWRITE = "overwrite"  # its name before 1.2
    SKIP = "skip"


@dataclass(frozen=True, slots=True)
class NamedAction:
    """An action of an event, of its actors or of the world.

    outline: what the file says of it, in one line.
    """

    path: Path
    private: PrivateAction | None
    worldwide: GlobalAction | None
    outline: str = "nothing"


@dataclass(frozen=True, slots=True)
class Event:
    """Actions that begin together, at most `count` times."""

    path: Path
    priority: Priority
    count: int
    actions: tuple[NamedAction, ...]
    start: Trigger


@dataclass(frozen=True, slots=True)
class Manoeuvre:
    """Events that share their actors."""

    path: Path
    events: tuple[Event, ...]


@dataclass(frozen=True, slots=True)
class Group:
    """Manoeuvres of the same actors, done `count` times.

    by_trigger: entities for which an event's trigger holds take part in that event too.
    """

    path: Path
    count: int
    actors: tuple[str, ...]
    manoeuvres: tuple[Manoeuvre, ...]
    by_trigger: bool = False


@dataclass(frozen=True, slots=True)
class Act:
    """Groups between a start and a stop trigger."""

    path: Path
    groups: tuple[Group, ...]
    start: Trigger
    stop: Trigger


@dataclass(frozen=True, slots=True)
class Story:
    """Acts that share one name."""

    path: Path
    acts: tuple[Act, ...]


@dataclass(frozen=True, slots=True)
class Storyboard:
    """All stories, and what ends them."""

    stories: tuple[Story, ...]
    stop: Trigger

    @property
    def events(self) -> tuple[Event, ...]:
        """Returns every event of all stories, in the order of the file."""
        acts = [a for s in self.stories for a in s.acts]
        return tuple(e for a in acts for g in a.groups for m in g.manoeuvres for e in m.events)


INSIDE: Mapping[str, tuple[str, ...]] = {  # the elements in an element of the storyboard
    "Story": ("Act",),
    "Act": ("ManeuverGroup",),
    "ManeuverGroup": ("Maneuver", "CatalogReference"),
    "Maneuver": ("Event",),
    "Event": ("Action",),
}


def element_paths(board: Node, ctx: Context) -> list[tuple[str, Path]]:
    """Returns types and paths of all elements, for conditions that name them, entries of catalogs too."""
    found: list[tuple[str, Path]] = []

    def look(node: Node, above: Path) -> None:
        if node.tag == "CatalogReference":
            try:
                node = ctx.catalogs.resolve(node, "Maneuver")
            except Fault:
                return  # reported where the manoeuvre is compiled
        tag = node.tag
        node = ctx.attempt(partial(inner, node)) or node
        path = (*above, node.label())
        found.append((tag[0].lower() + tag[1:], path))  # as conditions name it
        for child in node.children(*INSIDE[tag]) if tag in INSIDE else ():
            look(child, path)

    for story in board.children("Story"):
        look(story, ())
    return found


def compile_storyboard(board: Node, ctx: Context) -> Storyboard:
    """Compiles the <Storyboard>; what is faulty goes to the list of findings."""
    ctx.elements = element_paths(board, ctx)
    stories = tuple(_story(inner(s), ctx) for s in board.children("Story"))
    return Storyboard(stories, compile_trigger(board.find("StopTrigger"), ctx))


def _story(node: Node, ctx: Context) -> Story:
    """Compiles a story with all its acts."""
    path = (node.label(),)
    return Story(path, tuple(_act(a, path, ctx) for a in node.children("Act")))


def _act(node: Node, above: Path, ctx: Context) -> Act:
    """Compiles an act with its groups and its start and stop triggers."""
    path = (*above, node.label())
    groups = [ctx.attempt(partial(_group, g, path, ctx)) for g in node.children("ManeuverGroup")]
    return Act(
        path,
        tuple(g for g in groups if g is not None),
        compile_trigger(node.find("StartTrigger"), ctx),
        compile_trigger(node.find("StopTrigger"), ctx),
    )


def _group(node: Node, above: Path, ctx: Context) -> Group:
    """Compiles a manoeuvre group: count, actors and manoeuvres; faulty manoeuvres become findings."""
    path = (*above, node.label())
    found = node.child("Actors")
    by_trigger = found.flag("selectTriggeringEntities", default=False)
    actors = ctx.attempt(lambda: ctx.actors(found.children("EntityRef"))) or ()
    count = node.whole("maximumExecutionCount", 1)
    nodes = node.children("Maneuver", "CatalogReference")
    made = [ctx.attempt(partial(_manoeuvre, m, path, ctx)) for m in nodes]
    return Group(path, count, actors, tuple(m for m in made if m is not None), by_trigger)


def _manoeuvre(node: Node, above: Path, ctx: Context) -> Manoeuvre:
    """Compiles a manoeuvre, resolved from a catalogue; faulty events become findings."""
    node = ctx.catalogs.resolve(node, "Maneuver")
    path = (*above, node.label())
    events = [ctx.attempt(partial(_event, e, path, ctx)) for e in node.children("Event")]
    return Manoeuvre(path, tuple(e for e in events if e is not None))


def _event(node: Node, above: Path, ctx: Context) -> Event:
    """Compiles an event with priority, count, start trigger and actions; faulty actions become findings."""
    path = (*above, node.label())
    start = compile_trigger(node.find("StartTrigger"), ctx)
    actions = [ctx.attempt(partial(_action, a, path, ctx)) for a in node.children("Action")]
    return Event(
        path,
        node.choice("priority", Priority),
        node.whole("maximumExecutionCount", 1),
        tuple(a for a in actions if a is not None),
        start,
    )


def _action(node: Node, above: Path, ctx: Context) -> NamedAction:
    """Compiles a private, global or user-defined action; an empty one is over as it begins, with a note."""
    path = (*above, node.label())
    if next(node.children(), None) is None:
        ctx.findings.append(node.finding("holds no action: over as it begins", Kind.NOTE))
        return NamedAction(path, None, None)
    what = node.only()
    outline = describe_element(what)
    if what.tag == "PrivateAction":
        return NamedAction(path, private_action(what, ctx), None, outline)
    if what.tag == "GlobalAction":
        return NamedAction(path, None, global_action(what, ctx), outline)
    if what.tag == "UserDefinedAction":
        return NamedAction(path, None, user_defined(what, ctx), outline)
    raise what.unsupported_fault()
