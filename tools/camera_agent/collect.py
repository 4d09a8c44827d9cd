"""Scenes into two arrays on disk: `python -m camera_agent.collect OUT N SEED`."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from camera_agent.scenes import samples
from skidpad.stack.camera.codes import OUTPUTS, encode_label, mosaic


def collect(out: Path, n: int, seed: int) -> None:
    """Write images.npy (n, 96, 128, 3) and labels.npy (n, OUTPUTS)."""
    out.mkdir(parents=True, exist_ok=True)
    images = np.lib.format.open_memmap(
        out / "images.npy", mode="w+", dtype=np.uint8, shape=(n, 96, 128, 3)
    )
    labels = np.zeros((n, OUTPUTS), dtype=np.float32)
    for k, sample in enumerate(samples(n, seed)):
        images[k], labels[k] = mosaic(sample.images), encode_label(sample.label)
    images.flush()
    np.save(out / "labels.npy", labels)


if __name__ == "__main__":
    collect(Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]))
