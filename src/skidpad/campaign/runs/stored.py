"""Read what a run's folder says about the run, also folders of versions before this one."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec

from skidpad.campaign.cells.grip import DURATION, drawn_course
from skidpad.campaign.runs.folder import CONFIG
from skidpad.core.errors import ConfigError, FileError
from skidpad.core.reading import UNUSABLE, decode_yaml, read_bytes
from skidpad.core.run import VERSION, RunSpec, run_from_plain
from skidpad.core.told import describe_value
from skidpad.recording.channels.drives import read_record
from skidpad.scenarios.variation import CutIn
from skidpad.stack.configurations import functions_of

Plain = dict[str, Any]


def read_run(folder: Path) -> RunSpec:
    """The run that a folder's config.yaml describes; FileError when it cannot be told."""
    path = folder / CONFIG
    plain = decode_yaml(read_bytes(path, "run"), str(path))
    if not isinstance(plain, dict):
        raise FileError(f"{path} does not describe a run")
    return _read_description(plain, from_version_1, path)


def read_segment(recording: Path) -> RunSpec:
    """The run that the file beside a recording of channels describes."""
    path = recording.with_suffix(".json")
    record = read_record(path)
    if record is None:
        raise FileError(f"{path} does not describe a driven segment")
    return _read_description(record.plan, _segment_1, path)


def _read_description(plain: Plain, older: Callable[[Plain], Plain], path: Path) -> RunSpec:
    """The run of a description of this version, or of one that `older` turns into it."""
    try:
        return run_from_plain(plain if "version" in plain else older(plain), str(path))
    except FileError:
        raise
    except ConfigError as error:
        raise FileError(f"{path}: {error}") from None
    except UNUSABLE as error:
        raise FileError(f"{path} does not describe a run: {describe_value(error, 400)}") from None


def from_version_1(plain: Plain) -> Plain:
    """What `adas` and `grip` wrote before there was one description of a run.

    FileError for a folder of `play`, which did not hold all that decides its run.
    """
    if "file" in plain:
        raise FileError(
            "this run of `play` was written by an older version, which did not store the place of "
            "its file: play the file again"
        )
    return _grip_1(plain) if "scenario" in plain else _matrix_1(plain)


def _matrix_1(plain: Plain) -> Plain:
    where = plain["stack"] or ""
    label = plain["driver"]
    ours = {"type": "adas", "label": label, "functions": plain["functions"]}
    foreign = {"type": "stack", "where": where, "options": plain["options"], "name": label}
    return _common_1(plain) | {
        "driver": foreign if ":" in where else ours,
        "course": {"type": "roads"}
        | {name: plain[name] for name in ("map", "traffic", "vehicles", "allow_fewer")},
        "duration": plain["duration"],
        "sensors": plain["sensors"],
        "render": plain["render"],
    }


def _grip_1(plain: Plain) -> Plain:
    course = drawn_course(plain["scenario"], plain["seed"], CutIn(plain["cutin"]))
    course = msgspec.structs.replace(course, actors=plain["actors"])
    return _common_1(plain) | {
        "driver": _controller_1(plain["controller"], plain["config"]),
        "course": msgspec.to_builtins(course),
        "friction": plain["friction"],
        "duration": DURATION,
        "settings": plain["settings"] | {"grip": plain["model"], "mu_ref": plain["mu_ref"]},
        "sensors": plain["level"],
        "overlay": plain["overlay"],
    }


def _segment_1(plain: Plain) -> Plain:
    route = dict(plain["route"])
    weather = route.pop("weather")
    crew = {name: plain[name] for name in ("channels", "drive_by", "noise")}
    backend = plain.get("backend", {"kind": "embedded"})
    common = {"seed": plain["seed"], "profile": "recommended", "settings": {}, "backend": backend}
    return _common_1(common | {"weather": weather}) | {
        "driver": {"type": "channels", **crew},
        "course": {"type": "route", **route},
        "duration": plain["duration"],
        "sensors": "objects",
    }


def _controller_1(text: str, configuration: int) -> Plain:
    if text == "ideal":
        return {"type": "ideal"}
    if text == "stack":
        functions = sorted(f.value for f in functions_of(configuration))
        return {"type": "adas", "label": text, "functions": functions}
    if text.startswith("agent:"):
        return {"type": "agent", "where": text.removeprefix("agent:")}
    return {"type": "stack", "where": text}


def _common_1(plain: Plain) -> Plain:
    backend = dict(plain["backend"])
    return {
        "version": VERSION,
        "weather": plain["weather"],
        "seed": plain["seed"],
        "profile": plain["profile"],
        "settings": plain["settings"],
        "backend": {"backend": backend.pop("kind"), **backend},
    }
