"""What the speed envelope allowed before a crash: one sentence and a chart."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars as pl
from numpy.typing import NDArray

from skidpad.recording.run.readings import name_values, read_readings
from skidpad.report.elements.figures import PALETTE, canvas, svg_of
from skidpad.report.elements.page import Figure

TYPE, WATCHING = "envelope", "watching"  # type of the recorded "sensor", and word of its title
KMH = 3.6  # per m/s
BEFORE, SHOWN = 5.0, 10.0  # s before a crash that the sentence and the chart are about
ABOVE = 1.0  # km/h above the limit that count


@dataclass(frozen=True, slots=True)
class AllowedSpeeds:
    """(n,) what the envelope of a run allowed, by time: s, km/h, km/h, names of the lowest limits."""

    t: NDArray[np.float64]
    limit: NDArray[np.float64]
    v: NDArray[np.float64]
    binding: tuple[str, ...]
    watching: bool  # it only recorded

    def between(self, start: float, end: float) -> AllowedSpeeds:
        """Returns the part from start to end, s."""
        rows = np.flatnonzero((self.t >= start) & (self.t <= end))
        binding = tuple(self.binding[i] for i in rows)
        return AllowedSpeeds(self.t[rows], self.limit[rows], self.v[rows], binding, self.watching)


def read_allowed(run: Path, dt: float) -> AllowedSpeeds | None:
    """Returns what a run's envelope allowed; None where it had none."""
    readings = read_readings(run)
    sensor = next((s for s in readings.sensors if s.type == TYPE), None) if readings else None
    if readings is None or sensor is None:
        return None
    columns = [f"{sensor.id}.{name}" for name in ("speed_mps", "ego_mps", "binding")]
    table = readings.table.drop_nulls(columns)
    names = name_values(sensor, "binding")
    limit, v, binding = (table[name].to_numpy() for name in columns)
    words = tuple(names.get(round(float(b)), "") for b in binding)
    watching = WATCHING in sensor.title
    t = table["tick"].cast(pl.Float64).to_numpy() * dt
    return AllowedSpeeds(t, KMH * limit, KMH * v, words, watching)


def describe_allowed(allowed: AllowedSpeeds, t: float) -> str:
    """Returns one sentence on the seconds before a crash at t; empty where nothing was recorded."""
    part = allowed.between(t - BEFORE, t)
    if not len(part.t):
        return ""
    word = "would have allowed" if part.watching else "allowed"
    i = int(np.argmax(part.v - part.limit))
    if part.v[i] - part.limit[i] <= ABOVE:
        return (
            f"In the {BEFORE:.0f} s before, the ego stayed within what the speed envelope {word}, "
            f"{part.limit.min():.0f} km/h and more."
        )
    bound = f", bound by {part.binding[i]}" if part.binding[i] not in ("", "none") else ""
    return (
        f"{t - part.t[i]:.1f} s before, the speed envelope {word} {part.limit[i]:.0f} km/h{bound}; "
        f"the ego drove {part.v[i]:.0f} km/h."
    )


def draw_allowed(allowed: AllowedSpeeds, t: float) -> list[Figure]:
    """Returns a figure of speed and lowest limit in the SHOWN s before `t`; empty with less than 2 points."""
    part = allowed.between(t - SHOWN, t)
    if len(part.t) < 2:
        return []
    with canvas(height=2.4) as (figure, (axes,)):
        axes.plot(part.t - t, part.v, color="#1c2530", label="ego")
        for k, name in enumerate(dict.fromkeys(part.binding)):
            mine = np.array([b == name for b in part.binding])
            limit = np.where(mine, part.limit, np.nan)
            label = f"limit: {name or 'unnamed'}"
            axes.plot(part.t - t, limit, ".", markersize=3, color=PALETTE[k], label=label)
        axes.set_xlabel("s before the crash")
        axes.set_ylabel("km/h")
        axes.set_ylim(bottom=0.0)
        axes.legend(ncols=4, loc="upper left", fontsize=8)
        svg = svg_of(figure)
    word = "would have allowed" if part.watching else "allowed"
    return [Figure(svg, f"Speed, and what the speed envelope {word}, by its lowest limit.")]
