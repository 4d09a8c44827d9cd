"""A drive with a person at the desk, kept as an ordinary run folder that can be driven again."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from msgspec import structs

from skidpad.campaign.driving.backends import keep_server, make_backend
from skidpad.campaign.driving.loop import Sink
from skidpad.campaign.runs.folder import write_config, write_run
from skidpad.campaign.runs.run import Run, run
from skidpad.campaign.takeover.desk import Desk
from skidpad.core.run import RunSpec
from skidpad.recording.files import require_free, write_bytes
from skidpad.recording.run.inputs import INPUTS, encode_inputs, inputs_hash


def drive_at_desk(spec: RunSpec, desk: Desk, folder: Path, sinks: Sequence[Sink] = ()) -> Run:
    """Drives until the run or the person ends it, writes the folder, however it ended; returns the run.

    Raises OutputError when the folder is taken.
    """
    require_free(folder)
    keep_server(spec.backend)
    driven = run(spec, backend=make_backend(spec.backend), folder=folder, sinks=sinks, desk=desk)
    text = encode_inputs(desk.inputs)
    if text:
        write_bytes(folder / INPUTS, text)
    ready = structs.replace(spec, inputs=inputs_hash(text), surface=driven.surface)
    write_config(folder, ready.to_plain())
    write_run(folder, driven)
    return driven
