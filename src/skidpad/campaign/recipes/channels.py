"""The recipe of channels: routes for hours, in segments with own seeds (C-12).

OUT/<route>/<route>-<seed>.mcap and, once it is complete, .json with its outcome beside it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from itertools import product
from math import ceil
from pathlib import Path
from tempfile import TemporaryDirectory

import msgspec
from msgspec import structs

from skidpad import __version__
from skidpad.campaign.channels.drive import drive_segment
from skidpad.campaign.channels.routes import driven_routes
from skidpad.campaign.channels.world import crew_of, route_of
from skidpad.campaign.recipes.recipe import Driven, Recipe
from skidpad.campaign.runs.folder import Stopwatch
from skidpad.campaign.user_files import with_kept_map
from skidpad.core.errors import require_range
from skidpad.core.run import RunSpec
from skidpad.core.vocabulary import Outcome
from skidpad.live.settings import Links
from skidpad.recording.channels.content_hash import recording_hash
from skidpad.recording.channels.drives import (
    DRIVES,
    DriveEntry,
    DriveKey,
    DriveMetrics,
    DriveRecord,
)
from skidpad.recording.files import write_bytes

SEGMENT = 600.0  # s (C-12)
SEEDS_EACH = 100_000  # seeds are seed * this + number of the segment; hours allow for fewer


def segments(routes: Sequence[RunSpec], hours: float, template: RunSpec) -> list[RunSpec]:
    """Returns segments of SEGMENT s, the hours split equally among routes; the last one is the rest.

    Each has a seed of its own (C-12), also where only the weather differs, so that no error of a
    sensor counts twice in pooled segments. template: what routes do not say; its seed is the base.
    """
    require_range("hours", hours, 1.0 / 3600.0, 10_000.0)
    seconds = hours * 3600.0 / len(routes)
    rounds = range(ceil(seconds / SEGMENT - 1e-9))
    return [
        structs.replace(
            template,
            course=route.course,
            weather=route.weather,
            seed=template.seed * SEEDS_EACH + number,
            duration=min(SEGMENT, seconds - i * SEGMENT),
        )
        for number, (i, route) in enumerate(product(rounds, routes))
    ]


def drive_one(
    out: Path, spec: RunSpec, links: Links | None = None
) -> Driven[DriveKey, DriveMetrics]:
    """Drives one segment, writes recording and record into the folder of its cell; returns its row."""
    watch = Stopwatch()
    folder = out / spec.cell
    folder.mkdir(parents=True, exist_ok=True)
    recording = folder / f"{spec.name}.mcap"
    outcome = drive_segment(with_kept_map(spec, out), recording, links)
    timing, digest = watch.timing(outcome.driven_s), recording_hash(recording)
    outcome = replace(outcome, content_hash=digest, cpu_s=round(timing.cpu_s, 2))
    record = msgspec.json.encode(DriveRecord(spec.to_plain(), outcome))
    write_bytes(recording.with_suffix(".json"), msgspec.json.format(record, indent=1))
    return Driven(key=drive_key(spec, Outcome.COMPLETED, digest), metrics=outcome, timing=timing)


def drive_key(spec: RunSpec, outcome: Outcome, log_hash: str | None = None) -> DriveKey:
    """Returns the identifying columns of a segment's row; log_hash None: it left no recording."""
    return DriveKey(
        route=route_of(spec).name,
        seed=spec.seed,
        drive_by=crew_of(spec).drive_by,
        outcome=outcome.value,
        version=__version__,
        log_hash=log_hash,
    )


def warm_up() -> None:
    """Compiles every kernel that a segment needs, by driving a moment."""
    with TemporaryDirectory() as folder:
        spec = structs.replace(driven_routes()["route-4"], duration=1.0)
        drive_segment(spec, Path(folder) / "warm.mcap")


RECIPE = Recipe(
    command="channels",
    columns=DRIVES,
    entry=DriveEntry,
    key=drive_key,
    drive=drive_one,
    warm_up=warm_up,
    success=lambda metrics: metrics.collisions == 0,
    success_means="without a collision",
)


def recipe_with_links(links: Links) -> Recipe[RunSpec, DriveKey, DriveMetrics]:
    """Returns the recipe of channels whose every drive has these listeners."""
    return replace(RECIPE, drive=partial(drive_one, links=links))
