"""CARLA's settings of a camera, read from an actor's attributes; a blueprint without one has its default."""

from __future__ import annotations

from skidpad.simulation.carla_server.actors.registry import Actor
from skidpad.simulation.carla_server.protocol import wire


class Settings:
    """The attributes of one sensor, as numbers and words."""

    def __init__(self, actor: Actor) -> None:
        self._id, self._given = actor.blueprint.id, actor.attributes

    def number(self, name: str, default: float, low: float, high: float) -> float:
        """Returns a number; WireError when it is outside [low, high]."""
        value = float(self._given.get(name, default))
        if not low <= value <= high:
            raise self.error(name, f"a number between {low:g} and {high:g}")
        return value

    def word(self, name: str, default: str) -> str:
        """Returns a text in small letters."""
        return self._given.get(name, default).lower()

    def error(self, name: str, allowed: str) -> wire.WireError:
        """Returns the error of a value that is not what is allowed."""
        return wire.WireError(
            f"{self._id}: {name} must be {allowed}, got {self._given[name][:40]!r}"
        )


class PostSettings(Settings):
    """Those of what is done to a finished picture, at their defaults while the client switches that off."""

    def __init__(self, actor: Actor) -> None:
        super().__init__(actor)
        if self.word("enable_postprocess_effects", "true") == "false":
            self._given = {}
