"""Rain drops on the lens: a prepared layer, out of focus, composited on an image (B-160, B-161).

Drops sit far closer than the focal distance, so each is a soft disc that shows a blurred and turned
picture of the scene behind it. The layer depends on seed and camera only and stays through a run;
its strength follows the rain. Nothing here touches friction: it has a switch of its own.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from skidpad.core.frames import CameraImage
from skidpad.core.maths.randomness import stream
from skidpad.core.weather import Weather

Image = NDArray[np.uint8]
Layer = NDArray[np.float32]

DROPS_FULL = 160  # on an image of 640 x 480 at precipitation 100; assumption
AREA = 640 * 480  # px
RADIUS = (4.0, 14.0)  # px at a height of 480; assumption
DEFOCUS = 0.02  # of the image's height: deviation of the low-pass filter on the layer
BLUR = 0.03  # of the height: deviation of the blur of the scene seen through a drop
OPACITY = 0.85


def droplet_layer(weather: Weather, width: int, height: int, seed: int, camera: str) -> Layer:
    """Returns (H, W) opacity in [0, OPACITY] of the drops on this camera's lens; zeros without rain."""
    layer = np.zeros((height, width), dtype=np.float32)
    share = weather.precipitation / 100.0
    rng = stream(seed, "overlay", camera)
    count = round(DROPS_FULL * share * width * height / AREA)
    place = rng.uniform(0.0, 1.0, (DROPS_FULL * width * height // AREA + 1, 3))
    scale = height / 480.0
    for u, v, size in place[:count]:
        radius = max(round((RADIUS[0] + size * (RADIUS[1] - RADIUS[0])) * scale), 1)
        cv2.circle(layer, (int(u * width), int(v * height)), radius, 1.0, -1)
    sigma = max(DEFOCUS * height / 2.0, 0.5)
    soft = cv2.GaussianBlur(layer, (0, 0), sigma)
    return np.asarray(OPACITY * np.clip(soft, 0.0, 1.0), dtype=np.float32)


def overlaid(image: Image, layer: Layer) -> Image:
    """Returns (H, W, 3) the image seen through the drops; `image` itself where there are none.

    layer: (H, W) opacity, as by `droplet_layer`. A drop shows the scene blurred and upside down. The
    input is never changed.
    """
    if not layer.any():
        return image
    height = image.shape[0]
    through = cv2.GaussianBlur(cv2.flip(image, 0), (0, 0), max(BLUR * height, 0.5))
    weight = layer[:, :, None]
    mixed = image * (1.0 - weight) + through * weight
    return np.asarray(np.round(mixed), dtype=np.uint8)


class Lens:
    """The drops on all cameras of a run: images in, images behind drops out."""

    def __init__(self, weather: Weather, seed: int) -> None:
        self.weather, self.seed = weather, seed
        self.layers: dict[str, Layer] = {}

    def add_drops(self, images: Mapping[str, Any]) -> Mapping[str, Any]:
        """Returns the same readings by sensor id; images get their drops whenever they are read."""
        return _Wet(images, self)

    def wet(self, id: str, image: CameraImage) -> CameraImage:
        """Returns an image with drops; all but RGB stay as they are: labels and depth are ideal sensors."""
        if image.rgb is None:
            return image
        if id not in self.layers:
            height, width = image.rgb.shape[:2]
            self.layers[id] = droplet_layer(self.weather, width, height, self.seed, id)
        return replace(image, rgb=overlaid(image.rgb, self.layers[id]))


class _Wet(Mapping[str, Any]):
    """Readings by sensor id, images behind drops; still rendered only when read."""

    def __init__(self, images: Mapping[str, Any], lens: Lens) -> None:
        self.images, self.lens = images, lens

    def __getitem__(self, id: str) -> Any:
        found = self.images[id]
        return self.lens.wet(id, found) if isinstance(found, CameraImage) else found

    def __iter__(self) -> Iterator[str]:
        return iter(self.images)

    def __len__(self) -> int:
        return len(self.images)
