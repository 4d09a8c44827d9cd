"""Camera messages of one tick as images by sensor id, decoded when first read."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from math import isfinite
from typing import Any

import numpy as np
from numpy.typing import NDArray

from skidpad.core.errors import BackendError
from skidpad.core.frames import CameraImage
from skidpad.core.kernels.depthcode import inverse_depth_from_bgra
from skidpad.core.setup import Setup
from skidpad.core.specs import CameraSpec, Modality
from skidpad.core.vocabulary import RangeModel
from skidpad.physics.optics import depth_range, label_range
from skidpad.sensors.pictures.degradation import CameraNoise, degradation
from skidpad.simulation.carla import decode

FEED_WORKERS = 5  # one per display feed
IDS = 1 << 16  # actor ids are told apart by their lower 16 bits


class Pictures:
    """Buffers and weather of all cameras of a run. A tick's images are valid until the next."""

    def __init__(self, setup: Setup, seed: int, silent: Sequence[str], pooled: bool) -> None:
        """silent: ids of attached cameras that send nothing. pooled: degrade feeds in threads."""
        self.cameras = {s.id: s for s in setup.specs if isinstance(s, CameraSpec)}
        self.silent = frozenset(silent)
        physical = setup.range_model is RangeModel.PHYSICAL
        self._depth_sight = depth_range(setup.weather) if physical else np.inf
        self._label_sight = label_range(setup.weather) if physical else np.inf
        self._twin = _depth_twins(self.cameras.values())
        self._buffers: dict[str, NDArray[Any]] = {
            c.id: np.zeros((c.height, c.width), dtype=DTYPES[c.modality])
            for c in self.cameras.values()
        }
        effect = degradation(setup.weather)
        degraded = setup.camera_effect and effect.any
        self._noise = {
            c.id: CameraNoise(c.id, seed, effect)
            for c in self.cameras.values()
            if degraded and c.modality is Modality.RGB
        }
        self._pool = ThreadPoolExecutor(FEED_WORKERS) if pooled and self._noise else None
        self.rows: NDArray[np.uint16] = np.zeros(IDS, dtype=np.uint16)
        self.tick = -1
        self._newest: TickImages | None = None

    def of(self, tick: int, messages: Mapping[str, Any]) -> TickImages:
        """Returns the images of a tick; display feeds are degraded in the background when pooled.

        Waits for those of the tick before, whose buffers are used again.
        """
        self.finish()
        self.tick = tick
        self._newest = images = TickImages(self, tick, messages)
        if self._pool is not None:
            for id in self._noise:
                if id in images:
                    images.ahead(id, self._pool)
        return images

    def decode(self, camera: CameraSpec, messages: Mapping[str, Any]) -> CameraImage:
        """Returns a camera's image from its message, as the weather leaves it, in the camera's buffer."""
        out = self._buffers[camera.id]
        bgra = _bytes(messages[camera.id], camera)
        if camera.modality is Modality.DEPTH:
            inverse_depth_from_bgra(bgra, out)
            if isfinite(self._depth_sight):
                decode.limit_sight(camera, self._depth_sight, out)
            return CameraImage(inverse_depth=out)
        if camera.modality is Modality.SEMANTIC:
            np.copyto(out, bgra[..., 2])
            twin = self._twin.get(camera.id)
            if twin is not None and twin.id in messages and isfinite(self._label_sight):
                inverse = np.empty((twin.height, twin.width), dtype=np.float32)
                inverse_depth_from_bgra(_bytes(messages[twin.id], twin), inverse)
                decode.limit_sight(camera, self._label_sight, inverse, out)
            return CameraImage(labels=out)
        if camera.modality is Modality.INSTANCE:
            decode.instance_rows(bgra, self.rows, out)
            return CameraImage(instances=out)
        decode.packed_rgb(bgra, out)
        if camera.id in self._noise:
            self._noise[camera.id].apply(self.tick, out)
        return CameraImage(rgb=out.view(np.uint8).reshape(*out.shape, 4)[..., :3])

    def finish(self) -> None:
        """Waits for what is still being decoded, before buffers and messages are used again."""
        if self._newest is not None:
            self._newest.settle()

    def close(self) -> None:
        """Ends the threads that decode images."""
        if self._pool is not None:
            self._pool.shutdown(cancel_futures=True)


DTYPES: dict[Modality, type[np.generic]] = {
    Modality.DEPTH: np.float32,
    Modality.SEMANTIC: np.uint8,
    Modality.INSTANCE: np.uint16,
    Modality.RGB: np.uint32,
}


class TickImages(Mapping[str, CameraImage]):
    """Images by sensor id of one tick; only cameras that send are listed."""

    def __init__(self, pictures: Pictures, tick: int, messages: Mapping[str, Any]) -> None:
        self._pictures, self._tick, self._messages = pictures, tick, messages
        self._ids = [id for id in pictures.cameras if id in messages]
        self._ready: dict[str, CameraImage] = {}
        self._coming: dict[str, Future[CameraImage]] = {}

    def ahead(self, id: str, pool: ThreadPoolExecutor) -> None:
        """Begins to decode an image in a thread of the pool; reading it waits for that."""
        p = self._pictures
        self._coming[id] = pool.submit(p.decode, p.cameras[id], self._messages)

    def __getitem__(self, id: str) -> CameraImage:
        """Returns an image, decoded when first read; KeyError for a camera that there is not.

        BackendError for one that sends nothing, or when first read after the next tick.
        """
        if id in self._ready:
            return self._ready[id]
        if id in self._pictures.silent:
            raise BackendError(
                f"camera {id} is attached but sends nothing; --render all lets every camera send"
            )
        if id not in self._ids:
            raise KeyError(id)
        if id in self._coming:
            self._ready[id] = self._coming.pop(id).result()
            return self._ready[id]
        if self._pictures.tick != self._tick:
            raise BackendError(
                f"image {id} of tick {self._tick} was first read after tick "
                f"{self._pictures.tick}; a frame is valid until the next step"
            )
        self._ready[id] = self._pictures.decode(self._pictures.cameras[id], self._messages)
        return self._ready[id]

    def settle(self) -> None:
        """Waits for what is still being decoded."""
        for id in list(self._coming):
            self._ready[id] = self._coming.pop(id).result()

    def __contains__(self, id: object) -> bool:
        return id in self._ids

    def __iter__(self) -> Iterator[str]:
        return iter(self._ids)

    def __len__(self) -> int:
        return len(self._ids)


def _bytes(message: Any, camera: CameraSpec) -> NDArray[np.uint8]:
    """Returns (H, W, 4) of a message, not copied; BackendError when the server sent another size."""
    if (message.height, message.width) != (camera.height, camera.width):
        raise BackendError(
            f"CARLA sent {message.width}x{message.height} px for camera {camera.id}, asked for "
            f"{camera.width}x{camera.height}"
        )
    return np.frombuffer(message.raw_data, dtype=np.uint8).reshape(camera.height, camera.width, 4)


def _depth_twins(cameras: Any) -> dict[str, CameraSpec]:
    """Returns for each camera the depth camera with the same view; those without one are left out."""
    depth = {c.view: c for c in cameras if c.modality is Modality.DEPTH}
    return {c.id: depth[c.view] for c in cameras if c.view in depth}
