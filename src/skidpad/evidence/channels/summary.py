"""What a monitored recording showed, in numbers and as the summary that is kept of it."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from skidpad.core.vocabulary import HazardType
from skidpad.evidence.channels.indicators.catalogue import Bound
from skidpad.evidence.channels.indicators.layout import Place
from skidpad.evidence.channels.monitor import Monitor, drive_events
from skidpad.evidence.channels.timefilter import Event
from skidpad.recording.channels.indicators import Column
from skidpad.recording.channels.mcap_files import Losses


@dataclass(frozen=True, slots=True)
class Watched:
    """What a monitored recording showed."""

    channels: tuple[str, ...]
    cycles: int
    hours: float
    hazards: dict[HazardType, int]  # events
    violations: dict[Place, int]  # events
    summary: dict[str, Any]  # for JSON


def columns(monitor: Monitor) -> list[Column]:
    """Returns what each place of the readings is, for their log."""
    return [
        Column(
            indicator.value,
            subject,
            monitor.thresholds[indicator].threshold,
            monitor.thresholds[indicator].bound is Bound.UPPER,
            monitor.thresholds[indicator].claim,
        )
        for indicator, subject in monitor.layout.places
    ]


def summarise_drive(monitor: Monitor, losses: Losses, seconds: float, n: int) -> Watched:
    """Returns the outcome of a drive of n cycles and so many seconds that has ended; ends its events."""
    hazards, violations = drive_events(monitor)
    beyond = _count_keys([e.key for e in violations])
    summary = {
        "channels": list(monitor.channels),
        "cycles": n,
        "seconds": round(seconds, 3),
        "rules": monitor.settings.profile.value,
        "grip": monitor.settings.grip,
        "forms": monitor.settings.indicators.form.value,
        "identifier": monitor.settings.identify.value,
        "losses": asdict(losses),
        "unusable": monitor.unusable.as_dict(),
        "hazards": [_event(e, e.key.value) for e in hazards],
        "brief_objects": dict(monitor.ghosts.brief),  # a cue for ghosts (C-130)
        "context": monitor.context,
        "undecided_cycles": {h.value: c for h, c in monitor.undecided.items()},
        "indicators": _audit(monitor, beyond),
        "violations": [_event(e, e.key[0].value, e.key[1]) for e in violations],
    }
    return Watched(
        channels=monitor.channels,
        cycles=n,
        hours=seconds / 3600.0,
        hazards=_count_keys([e.key for e in hazards]),
        violations=beyond,
        summary=summary,
    )


def _audit(monitor: Monitor, events: dict[Place, int]) -> list[dict[str, Any]]:
    """Returns per indicator and subject claim, threshold, violations and cycles without a value (C-17)."""
    missing, beyond = monitor.not_evaluated, monitor.violation_cycles
    return [
        {
            "indicator": place.indicator.value,
            "subject": place.subject,
            "claim": monitor.thresholds[place.indicator].claim,
            "threshold": monitor.thresholds[place.indicator].threshold,
            "violation_events": events.get(place, 0),
            "violation_cycles": beyond[place],
            "not_evaluated_cycles": missing[place],
        }
        for place in monitor.layout.places
    ]


def _event(event: Event[Any], name: str, subject: str | None = None) -> dict[str, Any]:
    """Returns an event as plain data, times rounded to ms; an extreme of nan becomes None."""
    extreme = None if event.extreme != event.extreme else event.extreme
    row = {
        "name": name,
        "t_start": round(event.t_start, 3),
        "t_end": round(event.t_end, 3),
        "count": event.count,
        "extreme": extreme,
    }
    return row | ({"subject": subject} if subject else {})


def _count_keys(keys: list[Any]) -> dict[Any, int]:
    """Returns how often each key occurs, in the order of first occurrence."""
    return {key: keys.count(key) for key in dict.fromkeys(keys)}
