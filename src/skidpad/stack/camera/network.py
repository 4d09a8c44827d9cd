"""The frozen network of the camera driver, run by OpenCV on one thread."""

from __future__ import annotations

from functools import cache
from importlib.resources import as_file, files
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats32
from skidpad.stack.camera.codes import Label, decode_output, network_input

WEIGHTS = "weights.onnx"


@cache
def _network() -> Any:
    """Returns the lane network, loaded once from its weights."""
    cv2.setNumThreads(1)  # decision X-10; also the order of sums
    with as_file(files("skidpad.stack.camera") / WEIGHTS) as path:
        return cv2.dnn.readNetFromONNX(str(path))


def read_mosaic(picture: NDArray[np.uint8]) -> Label:
    """Returns what the network makes of a mosaic of the three images."""
    net = _network()
    net.setInput(network_input(picture))
    output: Floats32 = np.asarray(net.forward(), dtype=np.float32).reshape(-1)
    return decode_output(output)
