"""Named random streams: each noise source owns one, so adding a sensor changes no other's noise."""

from __future__ import annotations

import hashlib

import numpy as np


def stream(seed: int, *name: str | int) -> np.random.Generator:
    """Returns the generator of the noise source `name` in the run with `seed`, at its beginning.

    The name is hashed, not counted: streams do not depend on the order in which they are made.
    """
    return np.random.Generator(np.random.PCG64(stream_key(seed, *name)))


def stream_key(seed: int, *name: str | int) -> int:
    """Returns a 64-bit key for kernels that hash (key, tick, pixel) themselves."""
    text = "/".join([str(seed), *map(str, name)]).encode()
    return int.from_bytes(hashlib.blake2b(text, digest_size=8).digest(), "little")
