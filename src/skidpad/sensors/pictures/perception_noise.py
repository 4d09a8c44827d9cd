"""Optional noise on depth and labels (A-230): off by default, to test claimed mechanisms.

The published runs degrade only what people see, so their noise cannot act on the functions
(D-098); this stage makes the claim testable. It delivers copies: the shared buffers stay exact.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from skidpad.core.errors import require_range
from skidpad.core.maths.randomness import stream
from skidpad.core.vocabulary import SemanticClass


@dataclass(frozen=True, slots=True)
class PerceptionNoise:
    """Strengths; zero switches an effect off."""

    depth_sigma_ratio: float = 0.0  # standard deviation of depth, as a share of it
    label_dropout: float = 0.0  # share of pixels whose class is lost

    def __post_init__(self) -> None:
        require_range("perception_noise.depth_sigma_ratio", self.depth_sigma_ratio, 0.0, 1.0)
        require_range("perception_noise.label_dropout", self.label_dropout, 0.0, 1.0)

    def on_depth(
        self, inverse: NDArray[np.float32], seed: int, id: str, tick: int
    ) -> NDArray[np.float32]:
        """Returns (H, W) inverse depth with multiplicative noise; 0 (nothing) stays 0.

        `inverse` itself without noise. The same seed, camera id and tick give the same noise.
        """
        if self.depth_sigma_ratio == 0.0:
            return inverse
        deviates = stream(seed, "perception", id, tick).standard_normal(
            inverse.shape, dtype=np.float32
        )
        factor = np.maximum(1.0 + self.depth_sigma_ratio * deviates, 0.05).astype(np.float32)
        noisy: NDArray[np.float32] = inverse / factor
        return noisy

    def on_labels(
        self, labels: NDArray[np.uint8], seed: int, id: str, tick: int
    ) -> NDArray[np.uint8]:
        """Returns (H, W) class ids, of which a share is lost (SemanticClass.NONE).

        `labels` itself without a share. The same seed, camera id and tick give the same loss.
        """
        if self.label_dropout == 0.0:
            return labels
        lost = stream(seed, "perception", id, tick).random(labels.shape) < self.label_dropout
        return np.where(lost, np.uint8(SemanticClass.NONE), labels)
