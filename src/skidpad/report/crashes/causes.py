"""Why a crash happened, in one sentence made from the log."""

from __future__ import annotations

from math import isfinite

from skidpad.core.geometry import kmh_from_mps
from skidpad.core.maths.constants import G
from skidpad.core.vocabulary import DetectionStatus
from skidpad.evidence.drive.collisions import Crash, CrashKind, Striker
from skidpad.evidence.drive.story import Arrival, Moment, Sighting, Story

LATE = 1.0  # s without a report that are worth a word
STANDS = 1.0  # m/s
STRAIGHT = 1000.0  # m, a wider bend is none
BRIEF = 0.1  # s of braking that are worth a word
ASIDE = 0.5  # m beside the middle of the lane that are worth a word
REPORTERS = {
    DetectionStatus.FUSION_DETECT: "the cameras",
    DetectionStatus.FUSION_PERSIST: "the held track of the cameras",
    DetectionStatus.RADAR_ACTIVE: "the radar",
    DetectionStatus.SAFETY_PERSIST: "the held target",
}


ENDS = {CrashKind.OFF_ROAD: " and left the road", CrashKind.ROLL_OVER: " and rolled over"}


def write_cause(story: Story) -> str:
    """Returns the cause of a crash as one sentence."""
    crash = story.crash
    if crash.kind is CrashKind.VEHICLE:
        struck = crash.rear_ended or crash.striker is Striker.OTHER
        if crash.sideways:
            parts = _describe_sideways(story)
        else:
            parts = _describe_struck(story) if struck else _describe_striking(story)
    elif crash.kind is CrashKind.WRONG_WAY:
        parts = [f"The ego faced against the direction of its lane at {format_speed(crash.v_ego)}"]
    else:
        parts = _describe_departure(story)
    if story.pushed_by is not None:
        parts.append(
            f"it had touched {story.pusher} {format_seconds(story.pushed_by.before)} before"
        )
    text = "; ".join(part for part in parts if part) + "."
    return "The " + text[4:] if text.startswith("the ") else text


def _describe_sideways(story: Story) -> list[str]:
    """Returns clauses on a sideways contact: which of the two moved across, and the ego's offset."""
    crash = story.crash
    ego, other = f"the ego at {format_speed(crash.v_ego)}", crash.other
    if crash.v_other is not None:
        other += f" at {format_speed(crash.v_other)}"
    first, second = (other, ego) if crash.striker is Striker.OTHER else (ego, other)
    text = f"{first} moved sideways into {second} beside it"
    return [text, _describe_offset(crash)]


def _describe_offset(crash: Crash) -> str:
    """Returns a clause on the ego's place in its lane; "" within ASIDE m of the middle or unknown."""
    if crash.lane_offset is None or abs(crash.lane_offset) <= ASIDE:
        return ""
    side = "left" if crash.lane_offset > 0.0 else "right"
    return f"the ego was {format_metres(abs(crash.lane_offset))} {side} of the middle of its lane"


def _describe_struck(story: Story) -> list[str]:
    """Returns clauses on another that drove into the ego, and on a wrong report of it."""
    crash, wrong = story.crash, story.worst
    where = " from behind" if crash.rear_ended else ""
    closing = "" if crash.v_closing is None else f", {format_speed(crash.v_closing)} faster"
    text = f"{crash.other} drove into the ego{where}{closing}, "
    if story.braked is not None:
        text += f"while it braked from {format_speed(story.braked.v)}"
    elif crash.v_ego < STANDS:
        text += "while it stood"
    else:
        text += f"while it drove at {format_speed(crash.v_ego)}"
    return [text, "" if wrong is None else _describe_report(wrong, crash.other)]


def _describe_striking(story: Story) -> list[str]:
    """Returns clauses on how the ego drove into another: the other's coming, reports, braking."""
    came = _describe_arrival(story)
    if came:
        return [came, _describe_perception(story), _describe_braking(story)]
    return [_describe_lead(story), _describe_perception(story), _describe_braking(story)]


def _describe_arrival(story: Story) -> str:
    """Returns a clause on how the other came before the ego; "" if it was ahead for long."""
    moment, other = story.arrived, story.crash.other
    if moment is None:
        return f"{other} crossed the way of the ego and was never ahead in its lane"
    if not story.came_just_before:
        return ""
    when, gap = f"{format_seconds(moment.before)} before", format_metres(moment.gap)
    return {
        Arrival.CUT_IN: f"{other} came into the lane of the ego {gap} ahead, {when}",
        Arrival.UNCOVERED: f"the vehicle ahead left the lane {when} and uncovered {other} {gap} ahead",
        Arrival.EGO_CAME: f"the ego changed into the lane of {other} {gap} behind it, {when}",
        Arrival.EGO_PUT: f"the ego had been put on the lane {gap} behind {other}, {when}",
    }[story.arrival or Arrival.CUT_IN]


def _describe_lead(story: Story) -> str:
    """Returns a clause on what the lead of long standing did: slowed, stood or drove on."""
    crash, slowed = story.crash, story.slowed
    if slowed is not None and crash.v_other is not None:
        return (
            f"{crash.other} ahead slowed from {format_speed(slowed.v)} to {format_speed(crash.v_other)} "
            f"within {format_seconds(slowed.before)}"
        )
    stood = crash.v_other is not None and crash.v_other < STANDS
    return f"{crash.other} {'stood' if stood else f'drove at {format_speed(crash.v_other)}'} ahead"


def _describe_perception(story: Story) -> str:
    """Returns a clause on a wrong or late report of the other; "" if it came within LATE s."""
    if story.worst is not None:
        return _describe_report(story.worst, story.crash.other)
    first, arrived = story.first, story.arrived
    if arrived is None or first is None:
        return "the stack never reported it"
    if arrived.before - first.before < LATE:
        return ""
    return f"it was first reported {format_seconds(first.before)} before, {format_metres(first.gap)} away"


def _describe_report(wrong: Sighting, hit: str) -> str:
    """Returns a clause on what the stack had reported against the true gap, for the sentence on the cause."""
    who = "the stack" if wrong.status is None else REPORTERS.get(wrong.status, "the stack")
    text = f"{who} had reported {format_metres(wrong.distance)}, {format_seconds(wrong.before)} before, "
    if wrong.gap is None:
        return text + "with nothing ahead in the lane"
    return (
        text
        + f"the true gap was {format_metres(wrong.gap)}"
        + (f" to {wrong.to}" if wrong.to not in ("", hit) else "")
    )


def _describe_braking(story: Story) -> str:
    """Returns a clause on when the ego braked, and whether full braking there could have been enough."""
    crash, braked = story.crash, story.braked
    if braked is None:
        return f"the ego did not brake and drove at {format_speed(crash.v_ego)}"
    text = f"the ego braked {format_seconds(braked.before)} before, from {format_speed(braked.v)}"
    if not isfinite(braked.gap):
        return text
    text += f", {format_metres(braked.gap)} away"
    faster = braked.v - (crash.v_other or 0.0)
    if crash.mu is None or crash.mu <= 0.0 or faster <= 0.0:
        return text
    needed = faster**2 / (2.0 * crash.mu * G)
    enough = "less than" if needed < braked.gap else "more than"
    moves = (crash.v_other or 0.0) > STANDS
    end, way = ("match its speed", " of gap") if moves else ("stop", "")
    return (
        f"{text}; to {end} by full braking on a friction of {crash.mu:.2f} takes {needed:.0f} m{way}, "
        f"{enough} that"
    )


def _describe_departure(story: Story) -> list[str]:
    """Returns clauses on a departure: speed and place in the lane, bend against grip, braking, report."""
    crash, wrong, braked = story.crash, story.worst, story.braked
    end = f" and hit the {crash.other}" if crash.kind is CrashKind.STATIC else ENDS[crash.kind]
    text = f"the ego drove at {format_speed(crash.v_ego)}{end}"
    if crash.lane_offset is not None and abs(crash.lane_offset) > ASIDE:
        side = "left" if crash.lane_offset > 0.0 else "right"
        text += f", {format_metres(abs(crash.lane_offset))} {side} of the middle of its lane"
    brake = ""
    if braked is not None and braked.before >= BRIEF:
        brake = f"it had been braking for {format_seconds(braked.before)}, from {format_speed(braked.v)}"
    return [
        text,
        _describe_rebound(crash),
        _describe_bend(crash),
        brake,
        "" if wrong is None else _describe_report(wrong, crash.other),
    ]


def is_thrown_back(crash: Crash) -> bool:
    """Returns True when something static changed the ego's velocity by more than its speed."""
    contact = crash.contact
    if contact is None or contact.actor >= 0 or contact.delta_v is None:
        return False
    return contact.delta_v > crash.v_ego


def _describe_rebound(crash: Crash) -> str:
    """Returns a clause on why delta-v exceeds the speed that was lost; "" where it does not."""
    if not is_thrown_back(crash) or crash.contact is None:
        return ""
    back = format_speed(crash.contact.delta_v)
    return f"it was stopped and thrown back, a change of velocity of {back}"


def _describe_bend(crash: Crash) -> str:
    """Returns a clause on the bend: the acceleration it takes and, with friction known, what holds."""
    if crash.bend_radius is None or crash.bend_radius > STRAIGHT:
        return "the road was straight"
    takes = crash.v_ego**2 / crash.bend_radius
    text = f"the bend of {crash.bend_radius:.0f} m takes {takes:.1f} m/s² at that speed"
    if crash.mu is None:
        return text
    holds = crash.mu * G
    if takes > holds:
        return f"{text}, more than the {holds:.1f} m/s² that the tyres hold"
    less = f"{text}, less than the {holds:.1f} m/s² that the tyres hold"
    return f"{less}, so the bend alone does not explain it"


def format_speed(v: float | None) -> str:
    """Returns a speed in m/s as text in km/h; "unknown speed" for None."""
    return "unknown speed" if v is None else f"{kmh_from_mps(v):.0f} km/h"


def format_metres(value: float | None) -> str:
    """Returns a distance as text in m; "an unknown distance" for None."""
    return "an unknown distance" if value is None else f"{value:.1f} m"


def format_seconds(value: float) -> str:
    """Returns a time as text in s, without its sign."""
    return f"{abs(value):.1f} s"


def format_gap(moment: Moment) -> str:
    """Returns the gap of a moment as text in m, "" where there is none."""
    return format_metres(moment.gap) if isfinite(moment.gap) else ""
