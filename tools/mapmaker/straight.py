"""The map straight: 1.5 km, three 3.5 m lanes per direction (decision G-9)."""

from __future__ import annotations

from scenariogeneration import xodr

from mapmaker.furniture import Numbers, box, guardrail
from mapmaker.network import LaneSpec, Mark, Network, RoadSpec
from mapmaker.paths import Start, Straight, elements

LENGTH = 1500.0
LANE, SHOULDER = 3.5, 2.0


def network() -> Network:
    """The whole map."""
    lanes = (
        LaneSpec(LANE, mark=Mark.broken),
        LaneSpec(LANE, mark=Mark.broken),
        LaneSpec(LANE, mark=Mark.solid),
        LaneSpec(SHOULDER, xodr.LaneType.shoulder),
    )
    road = RoadSpec(
        1,
        elements(Start(0.0, 0.0, 0.0), [Straight(LENGTH)]),
        left=lanes,
        right=lanes,
        heights=[(0.0, 0.0, 0.0, 0.0, 0.0)],
        centre_mark=Mark.solid_solid,
        limits_kmh=[(0.0, 100.0)],
    )
    edge = 3 * LANE + SHOULDER
    ids = Numbers(20000)
    for t in (edge + 0.3, -edge - 0.3):
        guardrail(road, ids, t, 0.0, LENGTH)
    for k in range(1, 30):
        side = 1.0 if k % 2 else -1.0
        box(road, ids, xodr.ObjectType.streetLamp, 50.0 * k, side * (edge + 1.0), (0.2, 0.2, 9.0))
    return Network("straight", roads=[road], ego_start=(1, -2, 100.0))
