"""What can stand beside a road: a thing is a few boxes on the ground at one place."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, sin

import numpy as np

from skidpad.core.vocabulary import SemanticClass
from skidpad.roads.roadside import Box, Shape

Rgb = tuple[int, int, int]

WALLS: tuple[Rgb, ...] = (
    (196, 184, 162), (178, 148, 122), (158, 96, 74), (206, 204, 198), (142, 134, 126),
    (186, 168, 120), (132, 112, 96), (168, 176, 182), (214, 196, 168), (120, 78, 62),
    (172, 158, 146), (150, 156, 148),
)  # fmt: skip
BROAD: tuple[Rgb, ...] = ((66, 96, 42), (82, 110, 46), (54, 84, 40), (98, 116, 54), (74, 92, 52))
NEEDLES: tuple[Rgb, ...] = ((40, 66, 44), (48, 74, 46), (36, 58, 40))
HEDGES: tuple[Rgb, ...] = ((58, 86, 40), (70, 92, 48))
BARK: tuple[Rgb, ...] = ((86, 70, 54), (104, 92, 78))
GREY, WOODEN, GLASS = (104, 106, 110), (126, 104, 78), (92, 104, 112)
STOREY = 3.1  # m


@dataclass(frozen=True, slots=True)
class Thing:
    """Boxes that stand together; their z counts from the ground, which is found later.

    Attributes:
        name: What it is, in one word.
        boxes: Its parts.
        outline: Centre, direction, length and width of the ground that it covers.
        is_tall: Drivers of cars do not see over it.
        z: Height in m of the road that it stands on; None where it stands on the ground.
    """

    name: str
    boxes: tuple[Box, ...]
    outline: tuple[float, float, float, float, float]
    is_tall: bool = True
    z: float | None = None


@dataclass(frozen=True, slots=True)
class Place:
    """Where a thing stands; `along` is the direction of the road beside it."""

    x: float
    y: float
    along: float

    def move(self, ahead: float, left: float) -> Place:
        """Returns the place so many metres along the road and to the left of it."""
        c, s = cos(self.along), sin(self.along)
        return Place(self.x + c * ahead - s * left, self.y + s * ahead + c * left, self.along)


def _pick(colours: tuple[Rgb, ...], rng: np.random.Generator) -> Rgb:
    """Returns one of the colours at random."""
    return colours[int(rng.integers(len(colours)))]


def _part(
    at: Place, label: SemanticClass, size: tuple[float, float, float], rgb: Rgb, shape: Shape,
    z: float = 0.0, solid: bool = True, variant: int = 0,
) -> Box:  # fmt: skip
    """Returns a box at a place, its size (length, width, height) in m and z in m above the ground.

    solid: whether vehicles can hit it; variant: number that picks the look within a shape.
    """
    x, y, yaw = (round(v, 3) for v in (at.x, at.y, at.along))
    length, width, height = (round(v, 3) for v in size)
    return Box(
        int(label), x, y, round(z, 3), yaw, length, width, height, solid, rgb, shape, variant
    )


def _thing(
    name: str, at: Place, length: float, width: float, *boxes: Box, tall: bool = True
) -> Thing:
    """Returns a thing of these boxes that needs a rectangle of length by width in m."""
    return Thing(name, boxes, (at.x, at.y, at.along, length, width), tall)


def make_building(
    at: Place, length: float, depth: float, storeys: int, is_house: bool, rng: np.random.Generator
) -> Thing:
    """Returns a house (pitched roof) or a block around `at`, whose front is parallel to the road."""
    roof = 0.32 * depth if is_house else 0.9
    size = (length, depth, storeys * STOREY + 0.6 + roof)
    shape = Shape.HOUSE if is_house else Shape.BLOCK
    variant = int(rng.integers(1 << 16)) * 16 + storeys
    box = _part(at, SemanticClass.BUILDING, size, _pick(WALLS, rng), shape, variant=variant)
    return _thing("house" if is_house else "block", at, length, depth, box)


def make_tree(at: Place, crown: float, is_conifer: bool, rng: np.random.Generator) -> Thing:
    """Returns a conifer or a broad-leaved tree of random height; crown: its diameter in m."""
    trunk = float(rng.uniform(0.22, 0.4))
    if is_conifer:
        height, bare = crown * float(rng.uniform(2.2, 3.0)), 0.9
        rgb, shape = _pick(NEEDLES, rng), Shape.CONE
    else:
        height, bare = crown * float(rng.uniform(1.5, 2.0)) + 1.0, float(rng.uniform(1.8, 2.6))
        rgb, shape = _pick(BROAD, rng), Shape.CROWN
    variant = int(rng.integers(1 << 16))
    vegetation = SemanticClass.VEGETATION
    stem = _part(at, vegetation, (trunk, trunk, bare + 0.3), _pick(BARK, rng), Shape.POST)
    top = _part(at, vegetation, (crown, crown, height - bare), rgb, shape, bare, False, variant)
    return _thing("conifer" if is_conifer else "tree", at, crown, crown, stem, top)


def make_lamp(at: Place, to_road: float) -> Thing:
    """Returns a lamp post; to_road: 1 where the road lies to the left of `at.along`, else -1."""
    pole = _part(at, SemanticClass.POLE, (0.16, 0.16, 7.0), GREY, Shape.POST)
    tip = at.move(0.0, 0.35 * to_road)
    lamp = _part(tip, SemanticClass.POLE, (0.28, 0.8, 0.16), GREY, Shape.LAMP, 6.95, False)
    return _thing("lamp", at, 0.3, 1.5, pole, lamp, tall=False)


def make_hedge(at: Place, length: float, rng: np.random.Generator) -> Thing:
    """Returns a hedge along the road."""
    size = (length, 0.8, float(rng.uniform(0.9, 1.5)))
    variant = int(rng.integers(1 << 16))
    box = _part(
        at, SemanticClass.VEGETATION, size, _pick(HEDGES, rng), Shape.HEDGE, variant=variant
    )
    return _thing("hedge", at, length, 0.8, box)


def make_fence(at: Place, length: float) -> Thing:
    """Returns a wooden fence along the road."""
    box = _part(at, SemanticClass.FENCE, (length, 0.1, 1.1), WOODEN, Shape.FENCE)
    return _thing("fence", at, length, 0.2, box)


def make_wood(at: Place, length: float, depth: float, rng: np.random.Generator) -> Thing:
    """Returns the edge of a wood, as seen from afar."""
    size = (length, depth, float(rng.uniform(9.0, 15.0)))
    variant = int(rng.integers(1 << 16))
    box = _part(
        at, SemanticClass.VEGETATION, size, _pick((*BROAD, *NEEDLES), rng), Shape.WOOD,
        variant=variant,
    )  # fmt: skip
    return _thing("wood", at, length, depth, box)


def make_bus_stop(at: Place) -> Thing:
    """Returns a shelter beside the road with a pole 2.6 m further along it."""
    box = _part(at, SemanticClass.STATIC, (4.0, 1.5, 2.5), GLASS, Shape.SHELTER)
    pole = _part(at.move(2.6, 0.0), SemanticClass.POLE, (0.08, 0.08, 2.6), GREY, Shape.POST)
    return _thing("bus stop", at.move(0.4, 0.0), 5.0, 1.6, box, pole)


def make_marker_post(at: Place) -> Thing:
    """Returns a delineator post beside a road."""
    box = _part(at, SemanticClass.POLE, (0.12, 0.12, 1.0), (226, 226, 222), Shape.POST)
    return _thing("marker post", at, 0.12, 0.12, box, tall=False)


def make_wooden_pole(at: Place) -> Thing:
    """Returns a pole of a telephone line along a road."""
    pole = _part(at, SemanticClass.POLE, (0.24, 0.24, 7.5), WOODEN, Shape.POST)
    bar = _part(at, SemanticClass.POLE, (0.1, 1.6, 0.12), WOODEN, Shape.BOX, 6.9, False)
    return _thing("wooden pole", at, 0.24, 1.6, pole, bar, tall=False)


def make_noise_wall(at: Place, length: float) -> Thing:
    """Returns a piece of a noise wall, `length` m along the road and 3.2 m high."""
    box = _part(at, SemanticClass.WALL, (length, 0.3, 3.2), (138, 132, 118), Shape.BOX)
    return _thing("noise wall", at, length, 0.3, box)


def make_parked_car(at: Place, z: float, size: tuple[float, float, float], rgb: Rgb) -> Thing:
    """Returns a car that stands on a road z m high; size: its length, width and height in m."""
    box = _part(at, SemanticClass.CAR, size, rgb, Shape.CAR)
    return Thing("parked car", (box,), (at.x, at.y, at.along, *size[:2]), z=z)
