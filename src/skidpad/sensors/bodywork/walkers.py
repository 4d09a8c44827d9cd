"""Walkers within their boxes in m, in mid-step."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from skidpad.sensors.bodywork.body import (
    Body,
    Limb,
    assemble,
    ball,
    skin,
    tube,
)
from skidpad.sensors.scene.materials import Material
from skidpad.sensors.scene.mesh import Mesh, Points, box, merge

HAIR, SHOE = Material.TRIM, Material.TYRE
LIMB_PARTS = 3  # of a leg: thigh, shin, shoe; of an arm: two limbs and a hand
LIFT = 0.07  # m by which a foot rises that moves ahead


@dataclass(frozen=True, slots=True, kw_only=True)
class WalkerStyle:
    """What one kind of walker looks like, in shares of the height."""

    hip: float = 0.50
    neck: float = 0.83
    head: float = 0.066  # half of its height
    coat: float | None = None  # lower hem of a coat or skirt
    pack: bool = False  # on the back
    hair: float = 0.0  # how far it hangs down
    trousers: int = Material.TROUSERS
    sleeves: int = Material.CLOTH


WALKERS = {
    "walker in a jacket": WalkerStyle(),
    "walker in a coat": WalkerStyle(coat=0.34, hair=0.10, trousers=Material.TRIM),
    "walker with a pack": WalkerStyle(pack=True, trousers=Material.CARGO, sleeves=Material.SKIN),
    "child": WalkerStyle(hip=0.46, neck=0.77, head=0.09, pack=True, hair=0.05),
}


def make_walker(label: int, style: WalkerStyle, length: float, width: float, height: float) -> Body:
    """Returns the body of a walker in mid-step."""
    parts, limbs = _walker(label, style, 0.5 * length / height, 0.5 * width / height)
    mesh = merge(parts)
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    size = np.array([length, width, height])
    place = (mesh.vertices - low) / (high - low) * size - (0.5 * length, 0.5 * width, 0.0)
    starts = np.cumsum([0, *(len(part.vertices) for part in parts)])
    scale = size[2] / (high[2] - low[2])
    found = tuple(
        _find_limb(place, int(starts[at]), int(starts[at + LIMB_PARTS]), scale * (z - low[2]), lift)
        for at, z, lift in limbs
    )
    return assemble([mesh._replace(vertices=place)], ())._replace(limbs=found)


def _find_limb(vertices: Points, first: int, end: int, pivot: float, lift: float) -> Limb:
    """Returns the limb of these vertices, whose lowest quarter is its end; pivot, lift in m."""
    mine = vertices[first:end]
    low = float(mine[:, 2].min())
    tip = mine[mine[:, 2] < low + 0.25 * (pivot - low)]
    return Limb(first, end, pivot, low, float(tip[:, 0].mean()), lift)


def _walker(
    label: int, style: WalkerStyle, deep: float, wide: float
) -> tuple[list[Mesh], list[tuple[int, float, float]]]:
    """Returns the parts of a walker of height 1 in mid-step, left leg and right arm ahead, and its limbs.

    A limb: the first of its LIMB_PARTS parts, the height of its pivot, and its lift in m. deep, wide: half
    the length and half the width of its box, as shares of its height.
    """
    hip, neck = style.hip, style.neck
    k = min(1.0, (wide - 0.042) / 0.112)
    rows = [
        (hip - 0.02, 0.058, 0.085 * k),
        (hip + 0.10, 0.052, 0.080 * k),
        (neck - 0.09, 0.066, 0.112 * k),
        (neck - 0.02, 0.045, 0.095 * k),
        (neck, 0.03, 0.04 * k),
    ]
    parts = [_torso(label, rows), *_head(label, style)]
    limbs: list[tuple[int, float, float]] = []
    for s in (1.0, -1.0):
        limbs += [(len(parts), hip, LIFT), (len(parts) + LIMB_PARTS, neck - 0.045, 0.0)]
        parts += [*_leg(label, style, s, deep, k), *_arm(label, style, s, deep, wide, k)]
    if style.coat is not None:
        hem = [
            (style.coat, min(0.095, 0.9 * deep), 0.105 * k),
            (hip, 0.068, 0.092 * k),
            (hip + 0.1, 0.054, 0.081 * k),
        ]
        parts.append(_torso(label, hem))
    if style.pack:
        x, z = (max(-0.13, -deep), -0.04), (hip + 0.06, neck - 0.04)
        parts.append(box(x, (-0.075 * k, 0.075 * k), z, label, Material.FENCE))
    return parts, limbs


def _head(label: int, style: WalkerStyle) -> list[Mesh]:
    """Returns the neck, the head and the hair of a walker."""
    neck, half = style.neck, style.head
    nape = (0.0, 0.0, neck - 0.02), (0.01, 0.0, neck + 0.04)
    parts = [
        tube(nape, (0.03, 0.028), label, Material.SKIN),
        ball((0.012, 0.0, 1.0 - half), (0.052, 0.043, half), label, Material.SKIN),
        ball((-0.006, 0.0, 1.0 - 0.82 * half), (0.054, 0.047, 0.82 * half), label, HAIR),
    ]
    if style.hair > 0.0:
        z = 1.0 - half
        hanging = (-0.03, 0.0, z), (-0.035, 0.0, z - style.hair)
        parts.append(tube(hanging, (0.045, 0.03), label, HAIR))
    return parts


def _leg(label: int, style: WalkerStyle, s: float, deep: float, k: float) -> list[Mesh]:
    """The left leg (s = 1) ahead or the right one (-1) behind: thigh, shin and shoe. k: narrower by it."""
    hip = style.hip
    foot = (deep - 0.075 if s > 0.0 else 0.03 - deep, 0.048 * s * k, 0.045)
    knee = (0.5 * foot[0] + 0.025, 0.046 * s * k, 0.52 * hip)
    return [
        tube(((0.0, 0.046 * s * k, hip), knee), (0.052, 0.038), label, style.trousers),
        tube((knee, foot), (0.038, 0.026), label, style.trousers),
        box(
            (foot[0] - 0.03, foot[0] + 0.075),
            (foot[1] - 0.024, foot[1] + 0.024),
            (0.0, 0.05),
            label,
            SHOE,
        ),
    ]


def _arm(
    label: int, style: WalkerStyle, s: float, deep: float, wide: float, k: float
) -> list[Mesh]:
    """The left arm (s = 1) behind or the right one (-1) ahead: two limbs and a hand."""
    neck = style.neck
    swing = -0.3 * s * min(deep, 0.16)
    shoulder = (0.0, 0.114 * s * k, neck - 0.045)
    elbow = (0.5 * swing, s * min(0.115 + 0.02 * k, wide - 0.028), neck - 0.19)
    hand = (swing + 0.03, s * (wide - 0.018), neck - 0.335)
    return [
        tube((shoulder, elbow), (0.034, 0.027), label, Material.CLOTH),
        tube((elbow, hand), (0.026, 0.02), label, style.sleeves),
        ball(hand, (0.022, 0.018, 0.03), label, Material.SKIN, 6),
    ]


def _torso(label: int, rows: Sequence[tuple[float, float, float]]) -> Mesh:
    """An upright body of elliptic sections: height, half depth and half width of each."""
    angle = 2.0 * np.pi * (np.arange(10) + 0.5) / 10
    rings = [
        np.stack([a * np.cos(angle), b * np.sin(angle), np.full(10, z)], axis=1) for z, a, b in rows
    ]
    return skin(np.array(rings), label, Material.CLOTH)
