"""The storyboard as a tree of text: what can happen, to which entities, and on which condition."""

from __future__ import annotations

from collections.abc import Iterator

from skidpad.scenarios.storyboard import Act, Event, Group, Storyboard
from skidpad.scenarios.triggers import AnyEntity, Edge, Timed, Trigger

STEP = "  "  # by which each level is indented


def storyboard_tree(board: Storyboard) -> str:
    """Returns stories, acts, groups, manoeuvres and events, one a line, with conditions and actions."""
    lines = []
    for story in board.stories:
        lines.append(f"story {story.path[-1]}")
        lines += [STEP + line for act in story.acts for line in _act_lines(act)]
    return "\n".join([*lines, *_trigger_lines("ends when", board.stop)])


def _act_lines(act: Act) -> Iterator[str]:
    """Yields the lines of an act."""
    yield f"act {act.path[-1]}"
    for line in _trigger_lines("starts when", act.start):
        yield STEP + line
    for group in act.groups:
        for line in _group_lines(group):
            yield STEP + line
    for line in _trigger_lines("stops when", act.stop):
        yield STEP + line


def _group_lines(group: Group) -> Iterator[str]:
    """Yields the lines of a manoeuvre group, its actors first."""
    triggering = ["entities that trigger an event"] if group.by_trigger else []
    actors = ", ".join([*group.actors, *triggering]) or "no entity"
    yield f"group {group.path[-1]}{_times(group.count)}: {actors}"
    for manoeuvre in group.manoeuvres:
        yield f"{STEP}manoeuvre {manoeuvre.path[-1]}"
        for event in manoeuvre.events:
            for line in _event_lines(event):
                yield 2 * STEP + line


def _event_lines(event: Event) -> Iterator[str]:
    """Yields the lines of an event: its name and priority, its conditions, its actions."""
    yield f"event {event.path[-1]}{_times(event.count)}, {event.priority.value}"
    for line in _trigger_lines("when", event.start):
        yield STEP + line
    for action in event.actions:
        yield f"{STEP}-> {action.path[-1]}: {action.outline}"


def _times(count: int) -> str:
    """Returns how often something may happen; "" for once."""
    return "" if count == 1 else f" (at most {count} times)"


def _trigger_lines(when: str, trigger: Trigger) -> Iterator[str]:
    """Yields a line for each group of conditions, of which one is enough."""
    for k, group in enumerate(trigger.groups):
        yield f"{when if k == 0 else 'or'} {' and '.join(map(_condition_text, group))}"


def _condition_text(timed: Timed) -> str:
    """Returns a condition with its name, the entities that it is about, edge and delay."""
    found = timed.condition
    about = ""
    if isinstance(found, AnyEntity):
        rule = "" if len(found.names) == 1 else "all of " if found.of_all else "any of "
        about = f" {rule}{', '.join(found.names)}:"
    edge = "" if timed.edge is Edge.NONE else f", {timed.edge.value}"
    delay = f", delay {timed.delay:g} s" if timed.delay else ""
    return f"{timed.name}:{about} {timed.outline}{edge}{delay}"
