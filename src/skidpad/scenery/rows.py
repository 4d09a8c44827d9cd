"""What stands beside a border of a road, by the kind of the road: rows of things, walked along it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from skidpad.scenery import things
from skidpad.scenery.sides import RoadKind, Side
from skidpad.scenery.things import Place, Thing

Rng = np.random.Generator


def rows_of(side: Side, rng: Rng) -> Iterator[Thing]:
    """Yields all that would stand beside this border, what matters most first; places may be taken."""
    yield from {
        RoadKind.TOWN: _town,
        RoadKind.RURAL: _rural,
        RoadKind.MOTORWAY: _motorway,
    }[side.kind](side, rng)


def backdrop_of(side: Side, rng: Rng) -> Iterator[Thing]:
    """Yields woods 70 to 170 m beyond a border, behind all rows."""
    for s in _walk(side, rng, 25.0, 70.0):
        length, depth = rng.uniform(28.0, 60.0), rng.uniform(12.0, 24.0)
        offset = rng.uniform(70.0, 170.0) + 0.5 * depth
        yield things.make_wood(_place(side, s, offset), length, depth, rng)


def _place(side: Side, s: float, offset: float) -> Place:
    """Returns the place at s in m along the side, `offset` in m away from the road."""
    return Place(*side.at(s, offset))


def _walk(side: Side, rng: Rng, least: float, most: float) -> Iterator[float]:
    """Yields distances s in m along a border, `least` to `most` m apart, up to its length."""
    s = float(rng.uniform(0.2, 1.0)) * least
    while s < side.length:
        yield s
        s += float(rng.uniform(least, most))


def _to_road(side: Side) -> float:
    """Returns 1 where the road lies to the left of a border's direction, else -1 (left borders)."""
    return -1.0 if side.is_left else 1.0


def _town(side: Side, rng: Rng) -> Iterator[Thing]:
    """Yields what stands beside a street in town: bus stop, lamps, houses and trees."""
    is_avenue = bool(rng.random() < 0.6)
    setback = float(rng.uniform(6.4, 8.5)) if is_avenue else float(rng.uniform(2.2, 3.5))
    if side.length > 70.0 and rng.random() < 0.45:
        yield things.make_bus_stop(_place(side, side.length * rng.uniform(0.3, 0.7), 2.2))
    for s in _walk(side, rng, 26.0, 32.0):
        yield things.make_lamp(_place(side, s, 2.1), _to_road(side))
    yield from _houses(side, rng, setback, is_suburb=bool(rng.random() < 0.4))
    for s in _walk(side, rng, 9.0, 16.0) if is_avenue else ():
        crown = float(rng.uniform(2.8, 4.2))
        yield things.make_tree(_place(side, s, 1.3 + 0.5 * crown), crown, False, rng)
    for s in _walk(side, rng, 7.0, 18.0):
        crown = float(rng.uniform(3.0, 6.5))
        offset = float(rng.uniform(3.0, 40.0)) + 0.5 * crown
        yield things.make_tree(_place(side, s, offset), crown, bool(rng.random() < 0.25), rng)


def _houses(side: Side, rng: Rng, setback: float, is_suburb: bool) -> Iterator[Thing]:
    """Yields the front row of buildings with hedges and fences; outside suburbs a taller row behind.

    setback: m from the border to the buildings' fronts, at least.
    """
    s = float(rng.uniform(1.0, 6.0))
    while s < side.length - 5.0:
        is_house = bool(rng.random() < (0.85 if is_suburb else 0.12))
        length = float(rng.uniform(8.5, 13.0) if is_house else rng.uniform(12.0, 26.0))
        depth = float(rng.uniform(8.0, 10.5) if is_house else rng.uniform(10.0, 15.0))
        storeys = int(rng.integers(1, 3) if is_house else rng.integers(2, 6))
        back = setback + float(rng.uniform(0.0, 1.2)) + (2.0 if is_house else 0.0)
        if rng.random() > 0.07:  # else a plot is empty
            at = _place(side, s + 0.5 * length, back + 0.5 * depth)
            yield things.make_building(at, length, depth, storeys, is_house, rng)
        if is_house and rng.random() < 0.7:
            front = _place(side, s + 0.5 * length, 2.0)
            if rng.random() < 0.6:
                yield things.make_hedge(front, length - 1.0, rng)
            else:
                yield things.make_fence(front, length - 1.0)
        s += length + float(rng.uniform(3.0, 8.0) if is_house else rng.choice([0.2, 0.2, 3.5, 7.0]))
    for s in () if is_suburb else _walk(side, rng, 26.0, 48.0):
        length, depth = float(rng.uniform(16.0, 30.0)), float(rng.uniform(12.0, 18.0))
        at = _place(side, s, setback + 36.0 + 0.5 * depth)
        yield things.make_building(at, length, depth, int(rng.integers(4, 11)), False, rng)


def _rural(side: Side, rng: Rng) -> Iterator[Thing]:
    """Yields what stands beside a rural road: marker posts, wooden poles, farms, hedges and trees."""
    for s in _walk(side, rng, 49.0, 51.0):
        yield things.make_marker_post(_place(side, s, 1.3))
    if rng.random() < 0.6:
        offset = float(rng.uniform(5.0, 9.0))
        for s in _walk(side, rng, 38.0, 44.0):
            yield things.make_wooden_pole(_place(side, s, offset))
    for s in _walk(side, rng, 160.0, 420.0):
        at = _place(side, s, float(rng.uniform(18.0, 34.0)))
        yield things.make_building(at, 13.0, 9.0, int(rng.integers(1, 3)), True, rng)
        barn = at.move(float(rng.choice([-22.0, 22.0])), 0.0)
        yield things.make_building(barn, 18.0, 11.0, 1, True, rng)
    for s in _walk(side, rng, 30.0, 120.0):
        yield things.make_hedge(_place(side, s, float(rng.uniform(3.0, 6.0))), 16.0, rng)
    yield from _trees(side, rng, (4.0, 16.0), (3.6, 34.0), conifers=0.3)


def _motorway(side: Side, rng: Rng) -> Iterator[Thing]:
    """Yields what stands beside a motorway: noise walls and trees."""
    for s in _walk(side, rng, 220.0, 700.0):
        for k in range(int(rng.integers(3, 9))):
            yield things.make_noise_wall(_place(side, s + 12.0 * k, 6.0), 11.9)
    yield from _trees(side, rng, (3.0, 11.0), (8.0, 46.0), conifers=0.45)


def _trees(
    side: Side, rng: Rng, apart: tuple[float, float], offsets: tuple[float, float], conifers: float
) -> Iterator[Thing]:
    """Yields single trees, fewer near the road.

    apart: least and most m between two along the border; offsets: m from it to the crown; conifers: share.
    """
    for s in _walk(side, rng, *apart):
        crown = float(rng.uniform(3.0, 7.5))
        share = float(rng.random()) ** 0.7
        offset = offsets[0] + share * (offsets[1] - offsets[0]) + 0.5 * crown
        yield things.make_tree(_place(side, s, offset), crown, bool(rng.random() < conifers), rng)
