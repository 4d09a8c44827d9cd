"""Paints of cars and how often they have them."""

from __future__ import annotations

from skidpad.core.maths.randomness import stream

# Paint of cars by registrations: white, black, grey, silver, blue, red, green, yellow
# (shares in the Axalta Global Automotive Color Popularity Report 2022).
PALETTE = (
    (225, 225, 225),
    (25, 25, 28),
    (95, 98, 102),
    (170, 173, 177),
    (30, 60, 130),
    (150, 25, 30),
    (35, 80, 50),
    (215, 180, 45),
)
PAINT_SHARES = (
    0.34,
    0.21,
    0.19,
    0.08,
    0.08,
    0.05,
    0.01,
    0.04,
)  # the same report; yellow: all others


def draw_paint(seed: int, name: str) -> tuple[int, int, int]:
    """Returns the paint of the actor of this name, drawn as often as cars have it."""
    return PALETTE[int(stream(seed, "paint", name).choice(len(PALETTE), p=PAINT_SHARES))]
