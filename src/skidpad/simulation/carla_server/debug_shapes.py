"""Debug shapes that clients draw: kept while they live, for views; nothing renders them yet."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from skidpad.simulation.carla_server.protocol import wire

KINDS = ("point", "line", "arrow", "box", "text", "hud point", "hud line", "hud arrow", "hud box")
MOST = 10_000


@dataclass(slots=True)
class Shape:
    """One shape as it came, in CARLA's axes."""

    kind: str
    body: Any
    colour: Any
    left: float | None  # s still to live; None: for good


class DebugShapes:
    """The newest shapes, at most 10 000."""

    def __init__(self) -> None:
        self.shapes: list[Shape] = []

    def draw(self, value: Any) -> None:
        """Adds one debug shape from a call, for its life time in s or for ever; the oldest beyond MOST go.

        For ever: a negative time, or 0 and persistent. WireError for another shape.
        """
        primitive, colour, life, persistent = wire.items(value, "debug shape", 4)
        index, body = wire.items(primitive, "debug shape.primitive", 2)
        kind = KINDS[wire.integer(index, "debug shape.primitive", 0, len(KINDS) - 1)]
        seconds = wire.number(life, "debug shape.life_time")
        forever = seconds < 0.0 or (seconds == 0.0 and bool(persistent))
        self.shapes.append(Shape(kind, body, colour, None if forever else seconds))
        del self.shapes[:-MOST]

    def age(self, dt: float) -> None:
        """Lets shapes grow older by dt s and removes those whose time is over."""
        if not self.shapes:
            return
        for shape in self.shapes:
            if shape.left is not None:
                shape.left -= dt
        self.shapes = [s for s in self.shapes if s.left is None or s.left > 0.0]

    def clear(self, texts: bool | None = None) -> None:
        """Removes all shapes; only the texts (True), or all but the texts (False)."""
        if texts is None:
            self.shapes = []
        else:
            self.shapes = [s for s in self.shapes if (s.kind == "text") != texts]
