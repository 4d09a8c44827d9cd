"""What is said beside the pictures, as plain data for the page (A-272)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from skidpad.campaign.driving.loop import Moment
from skidpad.core.geometry import kmh_from_mps
from skidpad.core.inputs import Beam, LampSwitch, Outside
from skidpad.core.maths.constants import G
from skidpad.core.vocabulary import Supervision, Tier
from skidpad.stack.perception.radar import velocity_limit


def _title(tier: Tier) -> str:
    """Returns a tier's name in words."""
    return tier.name.replace("_", " ").capitalize().replace("Acc ", "ACC ")


# by value: the page lights the one that acted
TIERS = tuple("No action" if tier is Tier.NONE else _title(tier) for tier in Tier)


def round_value(value: float | None, digits: int = 2) -> float | None:
    """Returns a number rounded for the page; None for None and nan."""
    if value is None or value != value:
        return None
    return round(float(value), digits)


def mean_grip(mu: NDArray[np.float32]) -> float | None:
    """Returns the mean friction of the tyres of one actor; None when no value is finite.

    mu: NaN where there is no tyre; 0, as of a tyre in the air, counts.
    """
    known = mu[np.isfinite(mu)]
    return float(known.mean()) if known.size else None


def stopping_distance(v: float, mu: NDArray[np.float32]) -> float | None:
    """Returns the way in m of a full braking from v (m/s) on what the tyres find now; None without grip."""
    grip = mean_grip(mu)
    return None if not grip else v * v / (2.0 * grip * G)


def motion(moment: Moment) -> dict[str, Any]:
    """Returns how the ego moves and what commands move it, by the names that the page uses."""
    ego, truth = moment.frame.ego, moment.truth
    throttle, brake, steer, handbrake, reverse = truth.commands[0].tolist()
    return {
        "speed_kmh": round_value(kmh_from_mps(ego.speed), 1),
        "gear": ego.gear,
        "throttle": round_value(throttle),
        "brake": round_value(brake),
        "steer": round_value(steer, 3),
        "handbrake": bool(handbrake),
        "reverse": bool(reverse),
        "mu": [round_value(v) for v in truth.mu[0].tolist()],
        "grip": round_value(mean_grip(truth.mu[0])),
        "stop_m": round_value(stopping_distance(ego.speed, truth.mu[0]), 0),
        "x": round_value(float(truth.states.x[0])),
        "y": round_value(float(truth.states.y[0])),
    }


def opinion(moment: Moment) -> dict[str, Any]:
    """Returns what the stack reports at a moment."""
    r = moment.report
    return {
        "mode": moment.driver.mode,
        "tier": None if r.tier is None else int(r.tier),
        "status": None if r.status is None else r.status.name.replace("_", " ").lower(),
        "distance": round_value(r.distance, 1),
        "time_gap": round_value(r.time_gap, 1),
        "bumper": round_value(r.bumper, 1),
        "roof": round_value(r.roof, 1),
        "radar": round_value(r.radar_lane, 1),
        "radar_limit": round_value(velocity_limit(moment.frame.ego.speed), 1),
        "light": None if r.light_state is None else r.light_state.name.lower(),
        "light_at": round_value(r.light_distance, 0),
    }


def radar(moment: Moment) -> list[list[float]]:
    """Returns radar points as [x forward, y left (m), range rate (m/s)]."""
    p = moment.frame.radar
    x, y = p.range * np.cos(p.azimuth), p.range * np.sin(p.azimuth)
    points: list[list[float]] = np.stack([x, y, p.velocity], axis=1).round(1).tolist()
    return points


def seat(outside: Outside, manual: bool, method: str, lamps: LampSwitch | None) -> dict[str, Any]:
    """Returns how the desk stands, by the names that the page uses."""
    return {
        "manual": manual,
        "method": method,
        "lamps": "sun" if lamps is None else lamps.value,
        "beam": None if outside.beam is None else Beam(outside.beam).name.lower(),
        "weather": outside.weather.name,
        "grip": outside.grip.value,
    }


def list_events(moment: Moment) -> list[str]:
    """Returns the events of this tick in words: contacts, roll-overs, markings, relocation, recovery."""
    truth, frame = moment.truth, moment.frame
    told = [f"contact with {c.static or truth.table.names[c.actor]}" for c in truth.contacts]
    told += [f"{truth.table.names[row]} rolled over" for row in truth.rolled]
    told += [f"{i.marking} marking crossed" for i in truth.invasions]
    if moment.action.relocate is not None and moment.action.relocate.moved is not None:
        reason = moment.action.relocate.moved.reason.name.lower().replace("_", " ")
        told.append(f"put back after: {reason}")
    if frame.supervision is not Supervision.NONE:
        told.append(f"recovery: {frame.supervision.name.lower().replace('_', ' ')}")
    return told
