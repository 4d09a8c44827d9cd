"""Plates of the signs that a file names and draws nothing for: stop, yield and speed limits."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from skidpad.core.vocabulary import SemanticClass
from skidpad.roads.lanes import LaneKind, LaneSamples, LaneTable, SignalKind, SignalTable
from skidpad.roads.roadside import Box, Roadside, Shape

PLATE = 0.7  # m, German size 2 is 0.6 m for discs and 0.9 m for others (VwV-StVO, table 2)
LOWER_EDGE = 2.0  # m above the road, VwV-StVO to sections 39 to 43, III 13 a
POST = 0.08  # m
NEAR = 1.5  # m within which the file has a plate of its own
BESIDE = 0.3  # m between a post and the lanes that are driven on, below which it stands on the road
GREY, RED, WHITE = (120, 120, 125), (176, 32, 36), (228, 228, 224)
CORNERS: dict[SignalKind, tuple[int, tuple[int, int, int]]] = {
    SignalKind.STOP: (8, RED),
    SignalKind.YIELD: (3, WHITE),
    SignalKind.SPEED_LIMIT: (16, WHITE),
}


def signs_of(
    samples: LaneSamples, lanes: LaneTable, signals: SignalTable, roadside: Roadside
) -> Iterator[Box]:
    """Yields post and plate for every stop, yield and speed-limit sign beside the road without a plate.

    A sign has a plate when a traffic-sign box stands within NEAR m; a sign nearer than BESIDE m to a
    driving lane gets none.
    """
    driven = np.isin(lanes.kind, (LaneKind.DRIVING, LaneKind.RAMP))[samples.lane]
    plates = np.array(
        [(b.x, b.y) for b in roadside.boxes if b.label == SemanticClass.TRAFFIC_SIGN]
    ).reshape(-1, 2)
    _, rows = np.unique(signals.id, return_index=True)
    for row in rows.tolist():
        kind = SignalKind(int(signals.kind[row]))
        x, y, heading = (float(v[row]) for v in (signals.x, signals.y, signals.heading))
        if kind not in CORNERS or (np.hypot(plates[:, 0] - x, plates[:, 1] - y) < NEAR).any():
            continue
        away = np.hypot(samples.x - x, samples.y - y)
        if (away[driven] - 0.5 * samples.width[driven]).min(initial=np.inf) < BESIDE:
            continue
        corners, rgb = CORNERS[kind]
        z = round(float(samples.z[away.argmin()]), 3)
        place = (round(x, 3), round(y, 3))
        size = (POST, POST, LOWER_EDGE + PLATE)
        yield Box(int(SemanticClass.POLE), *place, z, heading, *size, rgb=GREY, shape=Shape.POST)
        yield Box(
            int(SemanticClass.TRAFFIC_SIGN), *place, z + LOWER_EDGE, round(heading, 5),
            2.0 * POST, PLATE, PLATE, False, rgb, Shape.SIGN, corners,
        )  # fmt: skip
