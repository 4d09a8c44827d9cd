"""Read what a run's folder says about the run."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from skidpad.campaign.runs.folder import CONFIG
from skidpad.core.errors import ConfigError, FileError
from skidpad.core.files.reading import UNUSABLE, decode_yaml, read_bytes
from skidpad.core.run import RunSpec, run_from_plain
from skidpad.core.text.told import describe_value
from skidpad.recording.channels.drives import read_record


def read_run(folder: Path) -> RunSpec:
    """Returns the run that a folder's config.yaml describes; FileError when it cannot be told."""
    path = folder / CONFIG
    plain = decode_yaml(read_bytes(path, "run"), str(path))
    if not isinstance(plain, dict):
        raise FileError(f"{path} does not describe a run")
    return _read_description(plain, path)


def read_segment(recording: Path) -> RunSpec:
    """Returns the run that the .json beside a recording of channels describes; FileError otherwise."""
    path = recording.with_suffix(".json")
    record = read_record(path)
    if record is None:
        raise FileError(f"{path} does not describe a driven segment")
    return _read_description(record.plan, path)


def _read_description(plain: dict[str, Any], path: Path) -> RunSpec:
    """Returns the run that a folder's plain data describe; raises FileError where they do not."""
    try:
        return run_from_plain(plain, str(path))
    except FileError:
        raise
    except ConfigError as error:
        raise FileError(f"{path}: {error}") from None
    except UNUSABLE as error:
        raise FileError(f"{path} does not describe a run: {describe_value(error, 400)}") from None
