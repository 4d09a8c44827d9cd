"""A judged recording as arrays and JSON, so that judging is done once and goes on where it stopped.

What was judged by other rules is judged again: the file says which code and which options made it.
A checksum over all of it tells damage, which is never taken for what was found.
"""

from __future__ import annotations

import hashlib
import io
from collections.abc import Mapping
from dataclasses import fields
from functools import lru_cache
from pathlib import Path
from typing import Any, get_type_hints

import msgspec
import numpy as np

from skidpad.core.errors import FileError
from skidpad.core.files.reading import UNUSABLE, read_arrays
from skidpad.evidence.channels.judging.segments import Segment

ARRAYS = ("t", "rows", "motion", "times")
KIND = "a judged recording"
FOLDER = Path(__file__).parents[1]  # all that judges


@lru_cache(maxsize=1)
def code_hash() -> str:
    """Returns SHA-256 over the code and the rules that judge, in hexadecimal digits."""
    total = hashlib.sha256()
    for file in sorted(p for p in FOLDER.rglob("*") if p.suffix in (".py", ".yaml")):
        total.update(file.relative_to(FOLDER).as_posix().encode() + b"\0" + file.read_bytes())
    return total.hexdigest()


def segment_bytes(segment: Segment, made_by: Mapping[str, str]) -> bytes:
    """Returns the segment as bytes of an .npz file, sealed by a checksum.

    made_by: the code and options that the judgement depends on.
    """
    plain = {f.name: getattr(segment, f.name) for f in fields(segment) if f.name not in ARRAYS}
    text = msgspec.json.encode({"made_by": dict(made_by), "segment": plain}, enc_hook=_plain)
    buffer = io.BytesIO()
    arrays: dict[str, Any] = {name: getattr(segment, name) for name in ARRAYS}
    seal = np.frombuffer(_seal(text, arrays), dtype=np.uint8)
    np.savez_compressed(buffer, text=np.frombuffer(text, dtype=np.uint8), seal=seal, **arrays)
    return buffer.getvalue()


def _seal(text: bytes, arrays: Mapping[str, Any]) -> bytes:
    """Returns SHA-256 over everything that is stored."""
    total = hashlib.sha256(text)
    for name in ARRAYS:
        total.update(f"{arrays[name].dtype.str} {arrays[name].shape}".encode())
        total.update(arrays[name].tobytes())
    return total.digest()


def segment_from(data: bytes, made_by: Mapping[str, str]) -> Segment | None:
    """Returns the segment in `data`; None when something else than `made_by` made it, or it is damaged."""
    try:
        arrays = read_arrays(data, KIND, KIND)
        text = arrays["text"].tobytes()
        if arrays["seal"].tobytes() != _seal(text, arrays):
            return None
        plain = msgspec.json.decode(text)
        if plain["made_by"] != dict(made_by):
            return None
        hints = get_type_hints(Segment)
        values: dict[str, Any] = {
            name: msgspec.convert(value, hints[name], strict=False)
            for name, value in plain["segment"].items()
        }
        values |= {name: arrays[name] for name in ARRAYS}
        return Segment(**values)
    except (FileError, *UNUSABLE):
        return None


def _plain(value: Any) -> Any:
    """Returns a number of numpy as Python's."""
    return value.item()
