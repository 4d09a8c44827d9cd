"""Crash cards: what happened, what was seen of it and when, pictures, and a replay."""

from __future__ import annotations

import base64
import io
from collections.abc import Sequence
from pathlib import Path

from PIL import Image as Picture

from skidpad.core.vocabulary import DetectionStatus, Tier
from skidpad.evidence.drive.collisions import Crash, CrashKind, Sighting, Striker
from skidpad.evidence.drive.prepared import Drive
from skidpad.recording.campaigns import snapshot
from skidpad.report.page import Card, Image
from skidpad.report.replay import replay
from skidpad.roads.queries import RoadMap

PICTURE_WIDTH = 480  # px
PICTURE_BYTES = 60_000  # decision M-17
QUALITIES = (80, 65, 50, 35, 20)
TIERS = {
    Tier.NONE: "no rule acted",
    Tier.HARD_STOP: "hard stop",
    Tier.STOPPED_TOO_CLOSE: "stopped too close",
    Tier.EMERGENCY: "emergency braking",
    Tier.STOPPED_BEHIND_CAR: "holding behind a car",
    Tier.APPROACH: "approaching a red light behind a car",
    Tier.ACC_HOLD: "following",
    Tier.ACC_OPEN: "following, opening up",
    Tier.ACC_CLOSE: "following, closing in",
    Tier.LIGHT_STOP: "stopping for a light",
    Tier.HOLDING_AT_LINE: "holding at the line",
    Tier.COAST: "coasting",
    Tier.CRUISE: "cruising",
    Tier.BEND: "slowing for a bend",
}
STATUS = {
    DetectionStatus.NO_TARGET: "no target",
    DetectionStatus.FUSION_DETECT: "cameras see a vehicle",
    DetectionStatus.FUSION_PERSIST: "cameras lost it, held",
    DetectionStatus.RADAR_ACTIVE: "radar alone",
    DetectionStatus.SAFETY_PERSIST: "lost, held for safety",
}


def severity(crash: Crash) -> float:
    """What makes a crash the worse one: the closing speed, else the ego's own."""
    return crash.v_closing if crash.v_closing is not None else crash.v_ego


def crash_card(crash: Crash, drive: Drive, road_map: RoadMap, run: Path) -> Card:
    """The card of one crash of the run in the folder `run`."""
    return Card(
        title=headline(crash),
        subtitle=f"{run.name} at {crash.t:.2f} s",
        tags=tags(crash),
        facts=facts(crash),
        chain=chain(crash),
        images=pictures(run, crash.t),
        replay=replay(drive.log, road_map, drive.row(crash.tick)),
    )


def headline(crash: Crash) -> str:
    """One line that says what happened."""
    if crash.kind is CrashKind.WRONG_WAY:
        return "Facing the wrong way"
    if crash.kind is CrashKind.OFF_ROAD:
        where = " in a bend, without a lead" if crash.bend_exit else ""
        return f"Off the road at {_kmh(crash.v_ego)}{where}"
    if crash.kind is CrashKind.STATIC:
        where = " in a bend, without a lead" if crash.bend_exit else ""
        return f"Into the {crash.other} at {_kmh(crash.v_ego)}{where}"
    if crash.rear_ended:
        return f"Struck from behind by {crash.other}, closing at {_kmh(crash.v_closing)}"
    who = "Ego into" if crash.striker is not Striker.OTHER else "Hit by"
    return f"{who} {crash.other}, closing at {_kmh(crash.v_closing)}"


def tags(crash: Crash) -> list[str]:
    """Short marks to scan by."""
    marks = [crash.kind.value.replace("_", " ")]
    if crash.rear_ended:
        marks.append("rear-ended")
    if crash.bend_exit:
        marks.append("bend exit")
    if crash.lead_since is not None and crash.lead_since < 2.0:
        marks.append("cut-in")
    return marks


def facts(crash: Crash) -> list[tuple[str, str]]:
    """Numbers of the moment; what was not there is left out."""
    rows = [
        ("ego", _kmh(crash.v_ego)),
        ("other", _kmh(crash.v_other)),
        ("closing", _kmh(crash.v_closing)),
        ("offset in lane", _metres(crash.lane_offset)),
        ("bend radius", _metres(crash.bend_radius, 0)),
        ("friction", f"{crash.mu:.2f}" if crash.mu is not None else None),
        ("hardest brake, last 2 s", f"{100 * crash.brake_max:.0f} %"),
        ("lead not reported, last 10 s", f"{crash.unseen:.2f} s"),
    ]
    return [(name, value) for name, value in rows if value is not None]


def chain(crash: Crash) -> list[str]:
    """The causes in order of time."""
    lines = []
    if crash.lead_since is not None:
        lines.append(f"-{crash.lead_since:.1f} s: {crash.other} becomes the lead")
    if crash.first_detection is not None:
        lines.append(f"{_sighting(crash.first_detection)} - first seen as the lead")
    elif crash.kind is CrashKind.VEHICLE and not crash.rear_ended:
        lines.append("never reported while it was the lead")
    lines += [_sighting(s) for s in crash.last_detections]
    lines.append(f"0.0 s: {headline(crash)}")
    return lines


def _sighting(s: Sighting) -> str:
    parts = []
    if s.status is not None:
        parts.append(STATUS[s.status])
    if s.distance is not None:
        parts.append(f"measured {s.distance:.1f} m")
    if s.gap is not None:
        parts.append(f"true gap {s.gap:.1f} m")
    if s.tier is not None:
        parts.append(TIERS[s.tier])
    return f"-{s.before:.1f} s: " + ", ".join(parts)


def pictures(run: Path, t: float) -> list[Image]:
    """The snapshot of that moment, if there is one, small enough to travel inside the page."""
    found = snapshot(run, t)
    if found is None:
        return []
    return [Image(webp_uri(found), "front camera at the contact, top view inset")]


def webp_uri(path: Path) -> str:
    """A picture as a WebP data URI of at most 60 kB."""
    with Picture.open(path) as picture:
        small = picture.convert("RGB")
        small.thumbnail((PICTURE_WIDTH, PICTURE_WIDTH))
        data = b""
        for quality in QUALITIES:
            buffer = io.BytesIO()
            small.save(buffer, "WEBP", quality=quality, method=4)
            data = buffer.getvalue()
            if len(data) <= PICTURE_BYTES:
                break
    return "data:image/webp;base64," + base64.b64encode(data).decode()


def worst(crashes: Sequence[Crash], n: int) -> list[Crash]:
    """The n hardest crashes, hardest first."""
    return sorted(crashes, key=severity, reverse=True)[:n]


def _kmh(v: float | None) -> str:
    return "unknown speed" if v is None else f"{3.6 * v:.0f} km/h"


def _metres(value: float | None, digits: int = 2) -> str | None:
    return None if value is None else f"{value:.{digits}f} m"
