"""Actors with shaped bodies: wheels roll and steer with the motion, and far ones are drawn coarsely."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from skidpad.core.arrays import Floats, Ints32
from skidpad.core.kernels.jit import kernel
from skidpad.core.states import ActorStates, ActorTable
from skidpad.core.vocabulary import ActorKind
from skidpad.sensors.bodywork.body import Limb
from skidpad.sensors.bodywork.choice import make_body
from skidpad.sensors.raster.rasteriser import Actors
from skidpad.sensors.raster.view import View
from skidpad.sensors.scene.bodies import body_mesh
from skidpad.sensors.scene.mesh import Mesh
from skidpad.sensors.scene.static import pixel_key

FAR = 60.0  # m from a camera, beyond which a plain body is drawn: a car is 10 px high there
WALKING = 0.8  # m/s, from which on a walker's limbs swing in full; they hang down at 0
SLOWEST = 0.5  # m/s, below which wheels stay turned as they are
MOST_STEER = 0.6  # rad
LONGEST_STEP = 20.0  # m in one step; more is a relocation


class _Wheels(NamedTuple):
    """w wheels of all actors; vertices are rows of all meshes one after the other."""

    actor: Ints32  # (w,)
    first: Ints32  # (w,)
    spins: Ints32  # (w,) first vertex that turns with the wheel
    end: Ints32  # (w,)
    hub: Floats  # (w, 3) m, in the actor's frame
    radius: Floats  # (w,) m
    steered: Floats  # (w,) 1 or 0


class _Limbs(NamedTuple):
    """l limbs of all walkers; vertices are rows of all meshes one after the other."""

    actor: Ints32  # (l,)
    first: Ints32  # (l,)
    end: Ints32  # (l,)
    pivot: Floats  # (l,) m, height of hip or shoulder
    low: Floats  # (l,) m, height of its end
    reach: Floats  # (l,) m by which its end is drawn ahead
    lift: Floats  # (l,) m by which its end rises where it moves ahead


class _Ranges(NamedTuple):
    """Which vertices and triangles are those of each of n actors; fields of `Actors`."""

    vertex_start: Ints32
    vertex_count: Ints32
    triangle_start: Ints32
    triangle_count: Ints32


class ShapedActors:
    """The meshes of a table's actors, each with vertices of its own, and how their wheels stand."""

    UNSAVED = (
        "far",
        "near",
        "_still",
        "_wheels",
        "_limbs",
        "_step",
        "_front",
    )  # set by `turn_wheels`, or constant

    def __init__(self, table: ActorTable) -> None:
        n = len(table)
        shapes = [
            (ActorKind(int(k)), float(a), float(b), float(c))
            for k, a, b, c in zip(table.kind, table.length, table.width, table.height, strict=True)
        ]
        bodies = [make_body(type, *s) for type, s in zip(table.types, shapes, strict=True)]
        kinds = {shape: i for i, shape in enumerate(dict.fromkeys(shapes))}
        plain = [body_mesh(*shape) for shape in kinds]
        meshes = [b.mesh for b in bodies] + plain
        if not meshes:
            meshes.append(body_mesh(ActorKind.PROP, 1.0, 1.0, 1.0))
        every = _ranges(meshes, range(len(meshes)))
        which = [n + kinds[shape] for shape in shapes]
        near = _Ranges._make(field[:n] for field in every)
        self.far = _Ranges._make(field[which] for field in every)
        self._still = np.concatenate([m.vertices for m in meshes])
        radius = np.array([np.linalg.norm(m.vertices, axis=1).max() for m in meshes])
        self.near = Actors(
            self._still.copy(),
            np.concatenate([m.triangles for m in meshes]),
            np.concatenate([pixel_key(m) for m in meshes]),
            *near,
            np.maximum(radius[:n], radius[which]) + 0.2,  # a steered wheel may stand out
            np.zeros((n, 3, 3)),
            np.zeros((n, 3)),
            np.zeros(n, dtype=np.bool_),
        )
        rows = [
            (i, int(near.vertex_start[i]), w) for i, body in enumerate(bodies) for w in body.wheels
        ]
        self._wheels = _Wheels(
            np.array([i for i, _, _ in rows], dtype=np.int32),
            np.array([at + w.first for _, at, w in rows], dtype=np.int32),
            np.array([at + w.spins for _, at, w in rows], dtype=np.int32),
            np.array([at + w.end for _, at, w in rows], dtype=np.int32),
            np.array([(w.x, w.y, w.z) for _, _, w in rows], dtype=np.float64).reshape(-1, 3),
            np.array([w.radius for _, _, w in rows], dtype=np.float64),
            np.array([float(w.steered) for _, _, w in rows], dtype=np.float64),
        )
        self._limbs = _limbs_of([b.limbs for b in bodies], near.vertex_start)
        legs = np.where(self._limbs.lift > 0.0, np.abs(self._limbs.reach), 0.0)
        self._step = np.bincount(self._limbs.actor, legs, n)  # m, from one foot to the other
        self._front = np.array([b.axle_front for b in bodies], dtype=np.float64)
        self.steer = np.zeros(n)  # rad, of the front wheels
        self.rolled = np.zeros(n)  # m

    def turn_wheels(self, states: ActorStates, elapsed: float) -> None:
        """Turns wheels and swings limbs by `elapsed` s of the present motion.

        Front wheels point where they go.
        """
        c, s = np.cos(states.yaw), np.sin(states.yaw)
        ahead = states.vx * c + states.vy * s
        left = states.vy * c - states.vx * s + self._front * states.yaw_rate
        moves = np.abs(ahead) > SLOWEST
        angle = np.arctan(left / np.where(moves, ahead, 1.0))
        self.steer[moves] = np.clip(angle[moves], -MOST_STEER, MOST_STEER)
        step = ahead * elapsed if np.isfinite(elapsed) else np.zeros_like(ahead)
        self.rolled += np.where(np.abs(step) < LONGEST_STEP, step, 0.0)
        turn_vertices(self._wheels, self.steer, self.rolled, self._still, self.near.vertices)
        phase = np.pi * self.rolled / np.where(self._step > 0.0, self._step, 1.0)
        share = np.minimum(np.hypot(states.vx, states.vy) / WALKING, 1.0)
        swing_limbs(self._limbs, phase, share, self._still, self.near.vertices)

    def select_for(self, view: View) -> Actors:
        """Returns the actors with plain bodies beyond `FAR`."""
        far = ((self.near.position - view.centre) ** 2).sum(axis=1) > FAR * FAR
        if not far.any():
            return self.near
        chosen = {
            name: np.where(far, there, getattr(self.near, name))
            for name, there in zip(_Ranges._fields, self.far, strict=True)
        }
        return self.near._replace(**chosen)


def _limbs_of(limbs: Sequence[tuple[Limb, ...]], vertex_start: Ints32) -> _Limbs:
    """Returns the limbs of all actors, whose meshes begin at these vertices (n,)."""
    rows = [(i, int(vertex_start[i]), limb) for i, own in enumerate(limbs) for limb in own]
    return _Limbs(
        np.array([i for i, _, _ in rows], dtype=np.int32),
        np.array([at + limb.first for _, at, limb in rows], dtype=np.int32),
        np.array([at + limb.end for _, at, limb in rows], dtype=np.int32),
        np.array([limb.pivot for _, _, limb in rows], dtype=np.float64),
        np.array([limb.low for _, _, limb in rows], dtype=np.float64),
        np.array([limb.reach for _, _, limb in rows], dtype=np.float64),
        np.array([limb.lift for _, _, limb in rows], dtype=np.float64),
    )


def _ranges(meshes: list[Mesh], rows: range) -> _Ranges:
    """Returns where each mesh lies when they stand one after the other."""
    vertices = [0, *itertools.accumulate(len(m.vertices) for m in meshes)]
    triangles = [0, *itertools.accumulate(len(m.triangles) for m in meshes)]
    return _Ranges(
        np.array([vertices[r] for r in rows], dtype=np.int32),
        np.array([vertices[r + 1] - vertices[r] for r in rows], dtype=np.int32),
        np.array([triangles[r] for r in rows], dtype=np.int32),
        np.array([triangles[r + 1] - triangles[r] for r in rows], dtype=np.int32),
    )


@kernel
def turn_vertices(
    wheels: _Wheels, steer: Floats, rolled: Floats, still: Floats, out: Floats
) -> None:
    """Writes the vertices of all wheels: spun about their hub's axis, then steered about the upright."""
    for w in range(wheels.actor.size):
        i = wheels.actor[w]
        angle = steer[i] * wheels.steered[w]
        c, s = np.cos(angle), np.sin(angle)
        turn = rolled[i] / wheels.radius[w]
        cs, ss = np.cos(turn), np.sin(turn)
        hx, hy, hz = wheels.hub[w, 0], wheels.hub[w, 1], wheels.hub[w, 2]
        for v in range(wheels.first[w], wheels.end[w]):
            x, y, z = still[v, 0] - hx, still[v, 1] - hy, still[v, 2] - hz
            if v >= wheels.spins[w]:
                x, z = cs * x + ss * z, cs * z - ss * x
            out[v, 0] = hx + c * x - s * y
            out[v, 1] = hy + s * x + c * y
            out[v, 2] = hz + z


@kernel
def swing_limbs(limbs: _Limbs, phase: Floats, share: Floats, still: Floats, out: Floats) -> None:
    """Writes the vertices of all limbs, sheared so that their ends swing from `reach` to its opposite.

    phase: (n,) rad, 0 as drawn; share: (n,) of the whole swing, 0 for limbs that hang down.
    """
    for q in range(limbs.actor.size):
        i = limbs.actor[q]
        reach, tall = limbs.reach[q], limbs.pivot[q] - limbs.low[q]
        shift = reach * (share[i] * np.cos(phase[i]) - 1.0)
        ahead = -np.sin(phase[i]) if reach > 0.0 else np.sin(phase[i])
        lift = share[i] * limbs.lift[q] * max(ahead, 0.0)
        for v in range(limbs.first[q], limbs.end[q]):
            part = min(max((limbs.pivot[q] - still[v, 2]) / tall, 0.0), 1.0)
            out[v, 0] = still[v, 0] + part * shift
            out[v, 2] = still[v, 2] + part * lift
