"""Softer edges in a picture for people: a pixel where two surfaces meet takes part of its neighbours.

That is no supersampling: what is thinner than a pixel still comes and goes.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from skidpad.core.kernels.jit import inner_kernel, kernel
from skidpad.sensors.raster.view import View

_EVEN, _OPAQUE, _ONE = np.uint32(0xFEFEFEFE), np.uint32(0xFF000000), np.uint32(1)


@inner_kernel
def _mean(a: np.uint32, b: np.uint32) -> np.uint32:
    """Returns the mean of two packed pixels, byte by byte, without their lowest bits."""
    half: np.uint32 = np.uint32(np.uint32(a & _EVEN) >> _ONE)
    mean: np.uint32 = np.uint32(half + np.uint32(np.uint32(b & _EVEN) >> _ONE))
    return mean


@kernel
def soften_edges(view: View, key: NDArray[np.int32], out: NDArray[np.uint32]) -> None:
    """Mixes half of four neighbours into every pixel of `out` whose key differs from one of theirs.

    Rows of the view are changed, but for its first and last, and columns but for the outermost.
    """
    width = out.shape[1]
    above, here = out[view.top].copy(), out[view.top].copy()
    for row in range(view.top + 1, view.height - 1):
        here[:] = out[row]
        below, line = out[row + 1], out[row]
        keys, up, down = key[row], key[row - 1], key[row + 1]
        for x in range(1, width - 1):
            k = keys[x]
            differs = (k ^ keys[x - 1]) | (k ^ keys[x + 1]) | (k ^ up[x]) | (k ^ down[x])
            around = _mean(_mean(here[x - 1], here[x + 1]), _mean(above[x], below[x]))
            mixed = np.uint32(_mean(here[x], around) | _OPAQUE)
            line[x] = mixed if differs != 0 else here[x]
        above[:] = here
