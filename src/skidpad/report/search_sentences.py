"""Sentences on failures, on the driver that was searched, and on a hazard that a search began from."""

from __future__ import annotations

from collections.abc import Sequence

from skidpad.core.run import AdasDriver, DriverSpec
from skidpad.core.text.wording import count_text
from skidpad.recording.campaign.searches import Group, Hazard, Trial


def hazard_sentences(hazard: Hazard) -> list[str]:
    """Returns how near a hazard was, and what would have made it a crash, in two or three sentences."""
    first = (
        f"{hazard.title}: as recorded {_nearness(hazard.recorded)}; with the searched driver in the "
        f"ego's place {_nearness(hazard.driven)}."
    )
    if hazard.failing is None:
        return [first, "No crash was found around it; this is no proof that there is none."]
    if not hazard.changes:
        return [first, "So it is a crash as it was recorded."]
    changes = " and ".join(
        f"{c.name} {_precise(c.failing)} instead of {_precise(c.harmless)}" for c in hazard.changes
    )
    found = [first, f"It would have been a crash with {changes}: {hazard.failing.kind}."]
    if hazard.likelihood is not None:
        times = f"{hazard.likelihood:.3g} times as likely as the likeliest ones"
        found += [f"Given the exposure, these values are {times}."]
    return found


def _nearness(trial: Trial) -> str:
    """Returns how near a run came, in words."""
    if trial.fault:
        return f"it could not be driven ({trial.fault})"
    if trial.contact_kmh is not None:
        return f"there was a contact of {trial.contact_kmh:.1f} km/h with {trial.other}"
    if trial.departed_s is not None:
        return "the ego left the road"
    if trial.min_gap_m is None:
        return "no other road user was met"
    ttc = (
        "" if trial.min_ttc_s is None else f", the least time to collision {trial.min_ttc_s:.1f} s"
    )
    return f"the least gap was {trial.min_gap_m:.1f} m{ttc}"


def judges_text(failures: Sequence[Trial]) -> str:
    """Returns how many failures each of the two judges avoids, and how many neither does."""
    reference = sum(t.is_avoided_by_reference for t in failures)
    bound = sum(t.bound != "" for t in failures)
    both = sum(t.is_avoided_by_reference and t.bound != "" for t in failures)
    return (
        f"the reference driver avoids {reference}, braking or steering from the same state {bound}, "
        f"both {both}, neither {sum(not t.is_avoidable for t in failures)}"
    )


def driver_text(driver: DriverSpec) -> str:
    """Returns the driver in words: our stack with its functions, or the label of another driver."""
    if isinstance(driver, AdasDriver):
        return (
            f"our stack ({', '.join(sorted(f.value for f in driver.functions)) or 'no function'})"
        )
    return driver.label


def group_sentence(group: Group) -> str:
    """Returns a group in one sentence: what, how often, and what would have been enough."""
    worst = max(group.failures, key=lambda t: t.contact_kmh or 0.0)
    speed = "" if worst.contact_kmh is None else f", up to {worst.contact_kmh:.0f} km/h"
    text = f"{group.kind}: {count_text(len(group.failures), 'failure')}{speed}"
    if group.changes:
        changes = " and ".join(
            f"{c.name} {_precise(c.harmless)} instead of {_precise(c.failing)}"
            for c in group.changes
        )
        text += f"; harmless with {changes}"
    return text


def _precise(value: float | str) -> str:
    """Returns a number with five digits as text; text stays as it is."""
    return value if isinstance(value, str) else f"{value:.5g}"
