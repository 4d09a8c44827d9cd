"""The content of a channel recording as one hash (decision X-1), whatever its compression."""

from __future__ import annotations

import hashlib
from pathlib import Path

import numpy as np

from skidpad.recording.channels.mcap_files import McapRecording


def recording_hash(path: Path) -> str:
    """Returns SHA-256 over all messages in order: channel, type and canonical values."""
    recording = McapRecording(path)
    digest = hashlib.sha256(repr(recording.channels).encode())
    for message in recording.messages():
        digest.update(f"{message.channel} {type(message.item).__name__}".encode())
        for name, value in zip(message.item._fields, message.item, strict=True):
            digest.update(name.encode())
            digest.update(_canonical(value))
    return digest.hexdigest()


def _canonical(value: object) -> bytes:
    """Returns the bytes of an array with its shape and type, or of a text; -0.0 and NaN are normalised.

    A dict counts by its sorted items as Python prints them; nothing within it is normalised.
    """
    if isinstance(value, dict):
        return repr(sorted(value.items())).encode()
    if isinstance(value, str):
        return value.encode()
    array = np.asarray(value)
    if array.dtype.kind == "f":
        array = np.where(np.isnan(array), np.nan, array + 0.0)
    return f"{array.shape} {array.dtype}".encode() + array.tobytes()
