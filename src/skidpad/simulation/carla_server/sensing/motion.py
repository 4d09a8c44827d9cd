"""Where a camera and all that it sees was at its last reading, and so how far each surface moved.

Two numbers per pixel, right and up, as shares of half the picture's width and height: to get pixels
multiply by half the width, and by minus half the height (carla-simulator/carla#4795). It is now minus
before, so it leads from the last picture to this one.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats
from skidpad.sensors.raster.passes import Pass
from skidpad.sensors.raster.view import View
from skidpad.simulation.carla_server.sensing.surroundings import Pictured

NEAREST = 1e-3  # share of a pixel's depth before which it lay beside the last picture's plane


@dataclass(slots=True, eq=False)
class Memory:
    """Where the camera and everybody was at the last reading."""

    view: View | None = None
    bodies: dict[int, tuple[Floats, Floats]] = field(default_factory=dict)  # by actor

    def since(self, scene: Pictured, view: View, drawn: Pass) -> NDArray[np.float32]:
        """Returns (H, W, 2) flow since the last call, zeros at the first, and keeps the present instead."""
        out = np.zeros((*drawn.inverse.shape, 2), dtype=np.float32)
        if self.view is not None:
            out[:] = compute_flow(view, self.view, np.eye(3), np.zeros(3), drawn.inverse)
            for row, actor in enumerate(scene.members):
                before = self.bodies.get(actor.id)
                mine = drawn.instances == row + 1
                if before is not None and mine.any():
                    turn = before[0] @ scene.live.actors.rotation[row].T
                    shift = before[1] - turn @ scene.live.actors.position[row]
                    out[mine] = compute_flow(view, self.view, turn, shift, drawn.inverse)[mine]
        self.view, self.bodies = view, _copy_motions(scene)
        return out


def _copy_motions(scene: Pictured) -> dict[int, tuple[Floats, Floats]]:
    """Returns how each actor is turned and where it is, by id, as the next picture is compared with it."""
    actors = scene.live.actors
    return {
        actor.id: (actors.rotation[row].copy(), actors.position[row].copy())
        for row, actor in enumerate(scene.members)
    }


def compute_flow(
    now: View, before: View, turn: Floats, shift: Floats, inverse: NDArray[np.float32]
) -> NDArray[np.float32]:
    """Returns (H, W, 2) flow of pixels at inverse depth (1/m), 0 being infinitely far.

    turn, shift: a point p of the world now was at turn p + shift before.
    """
    across = (np.arange(now.width) + 0.5 - now.cx) / now.focal
    down = (np.arange(now.height) + 0.5 - now.cy) / now.focal
    whole = before.rotation @ turn @ now.rotation.T
    near = before.rotation @ (turn @ now.centre + shift - before.centre)
    x, y, z = (
        whole[k, 0] * across[None, :]
        + whole[k, 1] * down[:, None]
        + whole[k, 2]
        + near[k] * inverse
        for k in range(3)
    )
    seen = z > NEAREST
    z = np.where(seen, z, 1.0)
    flow = np.stack(
        (
            (across[None, :] - x / z) * (2.0 * now.focal / now.width),
            (y / z - down[:, None]) * (2.0 * now.focal / now.height),
        ),
        axis=-1,
    )
    return np.where(seen[..., None], flow, 0.0).astype(np.float32)
