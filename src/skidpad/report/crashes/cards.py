"""Crash cards: what happened, what was seen of it and when, pictures, and a replay."""

from __future__ import annotations

import base64
import io
from collections.abc import Sequence
from pathlib import Path

from PIL import Image as Picture

from skidpad.core.vocabulary import DetectionStatus, Tier
from skidpad.evidence.drive.collisions import Crash, CrashKind, Striker
from skidpad.evidence.drive.prepared import Drive
from skidpad.evidence.drive.severity import Contact
from skidpad.evidence.drive.story import Arrival, Sighting, Story, tell_story
from skidpad.recording.campaign.folder import snapshot
from skidpad.recording.run.surfaces import read_surfaces
from skidpad.report.crashes.causes import (
    format_gap,
    format_metres,
    format_speed,
    is_thrown_back,
    write_cause,
)
from skidpad.report.crashes.envelope import describe_allowed, draw_allowed, read_allowed
from skidpad.report.elements.page import Card, Event, Image
from skidpad.report.elements.replay import replay
from skidpad.roads.queries import RoadMap

Found = tuple[Crash, Drive, RoadMap, Path]  # Path: of the run
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


def severity(crash: Crash) -> tuple[bool, float, float]:
    """Returns a sort key, larger is worse: person or two wheels hit, grading speed, ego's speed."""
    contact = crash.contact
    if contact is None:
        return False, 0.0, crash.v_ego
    return contact.is_vulnerable, contact.v_graded, crash.v_ego


def crash_card(crash: Crash, drive: Drive, road_map: RoadMap, run: Path) -> Card:
    """Returns the card of one crash of the run in the folder `run`, with pictures and a replay."""
    story = tell_story(drive, crash)
    allowed = read_allowed(run, drive.log.header.dt)
    sentence = "" if allowed is None else describe_allowed(allowed, crash.t)
    return Card(
        title=headline(crash),
        subtitle=f"{run.name} at {crash.t:.2f} s",
        tags=tags(story),
        facts=facts(crash),
        cause=" ".join(filter(None, (write_cause(story), sentence))),
        events=timeline(story),
        images=pictures(run, crash.t),
        replay=replay(drive.log, road_map, drive.row(crash.tick), laid=read_surfaces(run)),
        charts=[] if allowed is None else draw_allowed(allowed, crash.t),
    )


def headline(crash: Crash) -> str:
    """Returns one line on what happened, such as "Off the road at 60 km/h"."""
    if crash.kind is CrashKind.WRONG_WAY:
        return "Facing the wrong way"
    alone = " in a bend, without a lead" if crash.bend_exit else ""
    if crash.kind is CrashKind.OFF_ROAD:
        return f"Off the road at {format_speed(crash.v_ego)}{alone}"
    if crash.kind is CrashKind.ROLL_OVER:
        return f"Rolled over at {format_speed(crash.v_ego)}{alone}"
    if crash.kind is CrashKind.STATIC:
        return f"Into the {crash.other} at {format_speed(crash.v_ego)}{alone}"
    closing = "" if crash.v_closing is None else f", closing at {format_speed(crash.v_closing)}"
    if crash.sideways:
        return f"Sideways against {crash.other}{closing}"
    if crash.rear_ended:
        return f"Struck from behind by {crash.other}{closing}"
    who = "Ego into" if crash.striker is not Striker.OTHER else "Hit by"
    return f"{who} {crash.other}{closing}"


def tags(story: Story) -> list[str]:
    """Returns short labels that let a reader skim crash cards."""
    crash, contact = story.crash, story.crash.contact
    marks = [
        (crash.kind.value.replace("_", " "), True),
        (_class_mark(contact), contact is not None),
        ("person or two wheels", contact is not None and contact.is_vulnerable),
        ("rear-ended", crash.rear_ended),
        ("bend exit", crash.bend_exit),
        ("cut-in", story.arrival is Arrival.CUT_IN and story.came_just_before),
    ]
    return [mark for mark, applies in marks if applies]


def _class_mark(contact: Contact | None) -> str:
    """Returns what graded a contact and its severity as words, "" without a contact."""
    return "" if contact is None else f"{contact.graded_by.value} {contact.severity.value}"


def facts(crash: Crash) -> list[tuple[str, str]]:
    """Returns names and values as text of the moment's numbers; unknown ones are left out."""
    contact = crash.contact
    delta_v = None if contact is None else contact.delta_v
    rows = [
        ("ego", crash.v_ego, format_speed),
        ("other", crash.v_other, format_speed),
        (_closing_name(contact), crash.v_closing, format_speed),
        (_delta_v_name(crash), delta_v, format_speed),
        ("offset in lane", crash.lane_offset, lambda m: f"{round(m, 2) + 0.0:.2f} m"),
        ("bend radius", crash.bend_radius, "{:.0f} m".format),
        ("friction", crash.mu, "{:.2f}".format),
        ("hardest brake, last 2 s", 100 * crash.brake_max, "{:.0f} %".format),
        ("lead not reported, last 10 s", crash.unseen, "{:.2f} s".format),
    ]
    return [(name, write(value)) for name, value, write in rows if value is not None]


def _closing_name(contact: Contact | None) -> str:
    """Returns the name of the closing speed; of what stands, the part perpendicular to the piece hit."""
    if contact is None or contact.actor >= 0:
        return "closing"
    return f"perpendicular to the {contact.other}"


def _delta_v_name(crash: Crash) -> str:
    """Returns the name under which the card shows delta-v: by what was hit and whether it bounced."""
    contact = crash.contact
    if contact is not None and contact.actor >= 0:
        return "delta-v, larger of the two"
    return "delta-v, thrown back" if is_thrown_back(crash) else "delta-v"


def timeline(story: Story) -> list[Event]:
    """Returns the events of a crash in order of time; reports unlike the truth are marked wrong."""
    crash, found = story.crash, []
    found += [(s.before, _news_event(s, story)) for s in story.news]
    for moment, text in (
        (story.arrived, f"{crash.other} is ahead in the lane"),
        (story.braked, "the ego begins to brake"),
        (story.slowed, f"{crash.other} begins to slow"),
        (story.pushed_by, f"contact with {story.pusher}"),
    ):
        if moment is not None:
            parts = [text, moment.v and f"from {format_speed(moment.v)}", format_gap(moment)]
            found.append((moment.before, _event(moment.before, [p for p in parts if p])))
    found.append((0.0, _event(0.0, [headline(crash)])))
    found += [(-after, _event(-after, [contact_text(c)])) for after, c in story.others]
    if story.put_back is not None:
        found.append(
            (-story.put_back, _event(-story.put_back, ["the ego is put back on its lane"]))
        )
    return [event for _, event in sorted(found, key=lambda item: -round(item[0], 3))]


def _event(before: float, parts: Sequence[str], is_wrong: bool = False) -> Event:
    """Returns a card event whose time is `before` s ahead of the crash, shown with a minus sign."""
    sign = "+" if before < 0.0 else "-" if before > 0.0 else ""
    return Event(f"{sign}{abs(before):.2f} s", ", ".join(parts), is_wrong)


def _news_event(s: Sighting, story: Story) -> Event:
    """Returns the event of one change in what the stack reported, beside the true gap."""
    parts = [STATUS[s.status]] if s.status is not None else []
    if s.distance is not None:
        parts.append(f"measured {format_metres(s.distance)}")
    if s.gap is not None:
        to = f" to {s.to}" if s.to and s.to != story.crash.other else ""
        parts.append(f"true gap {format_metres(s.gap)}{to}")
    elif s.distance is not None:
        parts.append("no vehicle ahead in the lane within 80 m (centre to centre)")
    if s.tier is not None:
        parts.append(TIERS[s.tier])
    if s == story.first:
        parts.append(f"first report of {story.crash.other}")
    return _event(s.before, parts, s.is_wrong)


def contact_text(contact: Contact) -> str:
    """Returns one contact in words, with the speed that grades it and its severity."""
    what = contact.other if contact.actor > 0 else f"the {contact.other}"
    by = f"{contact.graded_by.value} {format_speed(contact.v_graded)}"
    return f"contact with {what}, {by}, {contact.severity.value}"


def pictures(run: Path, t: float) -> list[Image]:
    """Returns the picture of the run at `t` s as WebP; empty where none was taken."""
    found = snapshot(run, t)
    if found is None:
        return []
    return [
        Image(
            webp_uri(found, PICTURE_WIDTH, PICTURE_BYTES),
            "front camera at the contact, top view inset",
        )
    ]


def webp_uri(path: Path, width: int, bytes_max: int) -> str:
    """Returns the picture as a WebP data URL, at most `width` px; if too large, at the least quality."""
    with Picture.open(path) as picture:
        small = picture.convert("RGB")
        small.thumbnail((width, width))
        data = b""
        for quality in QUALITIES:
            buffer = io.BytesIO()
            small.save(buffer, "WEBP", quality=quality, method=4)
            data = buffer.getvalue()
            if len(data) <= bytes_max:
                break
    return "data:image/webp;base64," + base64.b64encode(data).decode()
