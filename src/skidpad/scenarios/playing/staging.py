"""What a file stages between the ego and others, and which of it a run has reached."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from math import hypot, pi

from skidpad.core.geometry import wrap_angle
from skidpad.recording.run.staging import StagedEvent, Staging
from skidpad.scenarios.actions.base import NoEffect
from skidpad.scenarios.actions.speed import Speed
from skidpad.scenarios.actions.world import SetValue
from skidpad.scenarios.conditions.by_entity import Collision
from skidpad.scenarios.conditions.by_value import Value
from skidpad.scenarios.elements import Happening, Move
from skidpad.scenarios.movement.lines import Line
from skidpad.scenarios.movement.tracking import PacedTrack, TimedTrack
from skidpad.scenarios.scenario import Scenario
from skidpad.scenarios.scene import Actor
from skidpad.scenarios.storyboard import Event, Group
from skidpad.scenarios.triggers import AnyEntity, Trigger

CORNER = pi / 4  # rad between a way's first and last direction, from which it turns off; assumption
ASIDE = 3.5  # m beside its way, a lane's width, at which the ego has left it; assumption


def staging_of(
    scenario: Scenario,
    story: Iterable[Happening],
    driven_by_file: bool,
    *,
    went_back: bool = False,
    left_way: bool = False,
) -> Staging:
    """Returns what the file stages, with the times at which its events began in this story.

    driven_by_file: the ego is no stack's; went_back: the ego has gone backwards; left_way: it has left
    a way round a corner of the file.
    """
    began: dict[tuple[str, ...], float] = {}
    for happening in story:
        if happening.what == Move.START.value:
            began.setdefault(happening.path, happening.t)
    staged = [
        (event, actors)
        for group, event in _events(scenario)
        if (actors := _others(event, group, scenario.ego))
    ]
    moved = {name for _, actors in staged for name in actors}
    return Staging(
        scenario=scenario.file.stem,
        ego=scenario.ego,
        driven_by_file=driven_by_file or scenario.ego_entity.is_ghost,
        partners=tuple(name for name in scenario.entities if name in moved),
        events=tuple(
            StagedEvent(
                name="::".join(event.path),
                actors=actors,
                began=began.get(event.path),
                on_contact=_waits_for_contact(event),
            )
            for event, actors in staged
        ),
        criteria=scenario.criteria,
        unreversed=not went_back and _lets_ego_reverse(scenario),
        unturned=left_way,
    )


class WayOfEgo:
    """Watches whether an ego that the file does not drive leaves a way round a corner.

    The way is the last trajectory of the ego whose direction turns by `CORNER` or more.
    """

    def __init__(self) -> None:
        self.line: Line | None = None
        self.is_left = False

    def look(self, ego: Actor) -> None:
        """Measures how far the ego is from its way, in each step."""
        track = ego.track
        if isinstance(track, PacedTrack | TimedTrack) and track.line is not self.line:
            turn = wrap_angle(track.line.tangent(track.line.length) - track.line.tangent(0.0))
            self.line = track.line if abs(turn) >= CORNER else None
        if self.line is not None and not self.is_left:
            at = self.line.at_length(self.line.nearest(ego.pose.x, ego.pose.y))
            self.is_left = hypot(at.x - ego.pose.x, at.y - ego.pose.y) > ASIDE


def _lets_ego_reverse(scenario: Scenario) -> bool:
    """Tells whether the file asks a speed below zero of the ego, at the begin or in an event."""
    if scenario.start.entities[scenario.ego].speed < 0.0:
        return True
    return any(
        isinstance(action.private, Speed)
        and action.private.target.other is None
        and action.private.target.value < 0.0
        for group, event in _events(scenario)
        if scenario.ego in group.actors
        for action in event.actions
    )


def _events(scenario: Scenario) -> Iterator[tuple[Group, Event]]:
    """Yields the events that can begin with the run's parameters, each with its group."""
    fixed = _fixed_parameters(scenario)
    acts = (act for story in scenario.storyboard.stories for act in story.acts)
    acts = (act for act in acts if not _is_ruled_out(act.start, fixed))
    for group in (group for act in acts for group in act.groups):
        for event in (event for manoeuvre in group.manoeuvres for event in manoeuvre.events):
            if not _is_ruled_out(event.start, fixed):
                yield group, event


def _fixed_parameters(scenario: Scenario) -> Mapping[str, str]:
    """Returns the parameters that no action changes, with their values."""
    actions = [a.worldwide for event in scenario.storyboard.events for a in event.actions]
    changed = {
        action.name
        for action in (*scenario.start.actions, *actions)
        if isinstance(action, SetValue) and not action.variable
    }
    return {name: value for name, value in scenario.parameters.items() if name not in changed}


def _is_ruled_out(trigger: Trigger, fixed: Mapping[str, str]) -> bool:
    """Tells whether parameters keep a trigger from ever firing, as that of a variant not chosen."""
    never = (
        any(
            isinstance(c, Value) and not c.variable and c.name in fixed and not c.holds_among(fixed)
            for c in (timed.condition for timed in group)
        )
        for group in trigger.groups
    )
    return bool(trigger) and all(never)


def _others(event: Event, group: Group, ego: str) -> tuple[str, ...]:
    """Returns the actors that an event moves, without the ego; () where it only sets values."""
    private = (action.private for action in event.actions)
    if all(action is None or isinstance(action, NoEffect) for action in private):
        return ()
    return tuple(name for name in group.actors if name != ego)


def _waits_for_contact(event: Event) -> bool:
    """Returns whether a start condition of the event is a collision of an entity."""
    conditions = (timed.condition for group in event.start.groups for timed in group)
    return any(isinstance(c, AnyEntity) and isinstance(c.condition, Collision) for c in conditions)
