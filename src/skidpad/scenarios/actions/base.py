"""What all actions are, and how a change is spread over time, distance or rate."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Protocol

from skidpad.scenarios.movement.motion import STEEPEST, Shape
from skidpad.scenarios.reading.document import Node
from skidpad.scenarios.scene import DONE, Actor, Running, Scene


class PrivateAction(Protocol):
    """Something that one entity does."""

    def begin(self, scene: Scene, actor: Actor) -> Running:
        """Starts the action for an entity and returns it running."""
        ...


class GlobalAction(Protocol):
    """Something that happens to the world."""

    def happen(self, scene: Scene) -> Running:
        """Acts at once, or begins to, and returns the running action."""
        ...


@dataclass(frozen=True, slots=True)
class NoEffect:
    """An action that changes nothing that this world can show; the log says so."""

    what: str

    def begin(self, scene: Scene, actor: Actor) -> Running:
        """Notes that the action has no effect on the actor, and returns an action that is done."""
        scene.notice(f"<{self.what}> of {actor.name} has no effect")
        return DONE

    def happen(self, scene: Scene) -> Running:
        """Notes that the global action has no effect, and returns an action that is done."""
        scene.notice(f"<{self.what}> has no effect")
        return DONE


def note_bound(
    scene: Scene, actor: Actor, element: str, asked: float, applied: float, of: str
) -> bool:
    """Notes in the log what a bound makes of an action; returns whether the bound acts.

    of: "quantity, unit, bound", as in "duration, s, maxAcceleration". It acts where asked and applied
    differ by more than SAME.
    """
    quantity, unit, bound = of.split(", ")
    acts = abs(asked - applied) > SAME * max(abs(asked), abs(applied))
    if acts:
        scene.notice(
            f"<{element}> of {actor.name}: {quantity} {asked:g} {unit} asked, "
            f"{applied:g} {unit} applied ({bound})"
        )
    return acts


SAME = 1e-6  # relative difference of two values that are one
ASIDE = "speed to the side, m/s, it goes no faster"  # what the own speed bounds


class Dimension(Enum):
    """What the number of a change means."""

    TIME = "time"
    RATE = "rate"
    DISTANCE = "distance"


class Following(Enum):
    """How closely a change is followed: by being placed there, or within the limits of a vehicle."""

    POSITION = "position"
    FOLLOW = "follow"


@dataclass(frozen=True, slots=True)
class Dynamics:
    """How fast a change is. A time or distance that is not positive makes a step, as in esmini."""

    shape: Shape
    dimension: Dimension
    value: float
    following: Following = Following.POSITION

    def span(self, size: float) -> float:
        """Returns the time in s, or distance in m, of a change by `size`; 0 for a step."""
        if self.shape is Shape.STEP:
            return 0.0
        if self.dimension is not Dimension.RATE:
            return max(self.value, 0.0)
        rate = abs(self.value)
        return abs(size) * STEEPEST[self.shape] / rate if rate > 0.0 else 0.0


def dynamics(node: Node) -> Dynamics:
    """Compiles a <...Dynamics> element; a step without value takes 0 s."""
    following = node.choice("followingMode", Following, Following.POSITION)
    shape = node.choice("dynamicsShape", Shape)
    if shape is Shape.STEP and not node.has("value"):
        return Dynamics(shape, Dimension.TIME, 0.0, following)
    dimension = node.choice("dynamicsDimension", Dimension)
    return Dynamics(shape, dimension, node.number("value"), following)
