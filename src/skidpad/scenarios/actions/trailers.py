"""Trailers are connected and let go."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from skidpad.scenarios.context import Context
from skidpad.scenarios.reading.document import Node
from skidpad.scenarios.reading.entities import Entity
from skidpad.scenarios.scene import DONE, Actor, Running, Scene


def can_tow(tractor: Entity, trailer: Entity) -> bool:
    """Returns whether the first vehicle has a hitch and the second a coupler."""
    return tractor.coupling.hitch is not None and trailer.coupling.coupler is not None


def train_of(actor: Actor) -> Iterator[Actor]:
    """Yields an actor, what tows it, and so on to the front."""
    one: Actor | None = actor
    while one is not None:
        yield one
        one = one.towed_by


@dataclass(frozen=True, slots=True)
class ConnectTrailer:
    """Draw a trailer from now on."""

    trailer: str

    def begin(self, scene: Scene, actor: Actor) -> Running:
        """Couples at once and returns an action that is done.

        Without a hitch or a coupler nothing happens, and a notice says so.
        """
        trailer = scene.actors[self.trailer]
        if any(one is trailer for one in train_of(actor)):
            scene.notice(f"{actor.name} does not tow {trailer.name}, which tows it, or is itself")
        elif can_tow(actor.entity, trailer.entity):
            trailer.towed_by = actor
        else:
            scene.notice(f"{actor.name} does not tow {trailer.name}: no hitch, or no coupler")
        return DONE


@dataclass(frozen=True, slots=True)
class DisconnectTrailer:
    """Let the own trailer go; on a road it keeps its speed, as the standard says nothing of brakes."""

    def begin(self, scene: Scene, actor: Actor) -> Running:
        """Disconnects the actor's trailer, which goes on along its road; returns an action that is done."""
        for trailer in scene.actors.values():
            if trailer.towed_by is actor:
                trailer.towed_by = None
                trailer.follow_road(scene.network, trailer.guide.v)
                trailer.guide.at_end = scene.network.stand_in  # no road to go along
                if trailer.guide.at_end:
                    trailer.guide.base = None
        return DONE


def compile_trailer(node: Node, ctx: Context) -> ConnectTrailer | DisconnectTrailer:
    """Returns the action inside a <TrailerAction>."""
    inner = node.only()
    if inner.tag == "ConnectTrailerAction":
        return ConnectTrailer(ctx.entity(inner, "trailerRef"))
    if inner.tag == "DisconnectTrailerAction":
        return DisconnectTrailer()
    raise inner.unsupported_fault()
