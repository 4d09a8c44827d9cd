"""What a person did during a run, one JSON line per input in inputs.jsonl, in order of ticks."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from pathlib import Path

import msgspec

from skidpad.core.errors import ConfigError, FileError
from skidpad.core.inputs import Input, Timed
from skidpad.core.text.told import on_a_line

INPUTS = "inputs.jsonl"


class _Line(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    tick: int
    input: Input


def encode_inputs(inputs: Iterable[Timed]) -> bytes:
    """Returns one JSON line per input, in the order given."""
    lines = (msgspec.json.encode(_Line(i.tick, i.input), order="deterministic") for i in inputs)
    return b"".join(line + b"\n" for line in lines)


def inputs_hash(text: bytes) -> str:
    """Returns what `RunSpec.inputs` says of a file of inputs; "" for none."""
    return hashlib.sha256(text).hexdigest() if text else ""


def read_inputs(folder: Path, wanted: str) -> tuple[Timed, ...]:
    """Returns the inputs of a run; FileError when the file is missing or another.

    wanted: `RunSpec.inputs`; "": none were given, and () is returned.
    """
    if not wanted:
        return ()
    path = folder / INPUTS
    try:
        text = path.read_bytes()
    except OSError as error:
        raise FileError(f"cannot read {path}: {error.strerror}") from error
    if inputs_hash(text) != wanted:
        raise FileError(f"{path} is not what was done in this run: its hash is not config.yaml's")
    return decode_inputs(text, str(path))


def decode_inputs(text: bytes, name: str = INPUTS) -> tuple[Timed, ...]:
    """Returns the inputs of lines of `encode_inputs`; FileError names the line that cannot be read."""
    inputs: list[Timed] = []
    for number, line in enumerate(text.splitlines(), start=1):
        try:
            read = msgspec.json.decode(line, type=_Line)
        except (msgspec.MsgspecError, ConfigError, UnicodeError, RecursionError) as error:
            raise FileError(f"{name}, line {number} is not an input: {on_a_line(error)}") from error
        if read.tick < (inputs[-1].tick if inputs else 0):
            raise FileError(f"{name}, line {number} goes back in time, to tick {read.tick}")
        inputs.append(Timed(read.tick, read.input))
    return tuple(inputs)
