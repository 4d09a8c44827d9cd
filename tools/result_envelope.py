"""Tables and the Pareto picture of the speed envelope's proof, made of committed results.

A campaign `envelope-MAP` has the bare stack, the fixed limit, the envelope and the reference driver; the
rivals lie beside it in `envelope-MAP-GOVERN`. Events: contacts of 5 km/h and more, and departures.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import polars as pl

from envelope_power import ENOUGH, factor_bound
from result_texts import markdown
from skidpad.evidence.statistics import compare_pairs, holm, mean_limits, poisson_interval
from skidpad.report.elements.figures import scatter

OWN = {"3": "bare", "4": "fixed 80 km/h", "5": "envelope", "reference": "reference driver"}
RIVALS = {
    "table": "table of three speeds", "rss": "RSS, constant grip", "oracle": "envelope, true grip",
    "pulses": "envelope with brake pulses", "only-sight": "sight alone", "only-lead": "lead alone",
    "only-bend": "bend alone", "only-water": "water alone", "grip-low": "grip 30 % too low",
    "grip-high": "grip 30 % too high", "first-curve": "envelope, resume ends behind the first bend",
}  # fmt: skip
BARE, ENVELOPE, TABLE = "bare", "envelope", RIVALS["table"]
PICTURE = "pareto.svg"


def read_drivers(folder: Path) -> dict[str, pl.DataFrame]:
    """Returns the runs of each driver of a map's family of campaigns."""
    own = pl.read_parquet(folder / "results.parquet")
    found = {
        name: own.filter(pl.col("config") == config)
        for config, name in OWN.items()
        if config in own["config"].to_list()
    }
    for govern, name in RIVALS.items():
        file = folder.with_name(f"{folder.name}-{govern}") / "results.parquet"
        if file.is_file():
            found[name] = pl.read_parquet(file)
    return found


def events(runs: pl.DataFrame) -> int:
    """Returns contacts of 5 km/h and more, and departures, of these runs."""
    return int(runs["serious_contacts"].sum()) + int(runs["road_departures"].sum())


def cells(folder: Path) -> Iterator[tuple[str, dict[str, pl.DataFrame]]]:
    """Yields each weather with the runs of each driver in it."""
    drivers = read_drivers(folder)
    for weather in drivers[BARE]["weather"].unique(maintain_order=True).to_list():
        yield weather, {n: t.filter(pl.col("weather") == weather) for n, t in drivers.items()}


def rivals(folder: Path) -> str:
    """Returns one row per weather and driver."""
    p_values = against_table(folder)
    rows = []
    for weather, drivers in cells(folder):
        bare = events(drivers[BARE])
        for name, runs in drivers.items():
            km, n = float(runs["distance_km"].sum()), events(runs)
            limits = poisson_interval(n, km / 100.0)
            speeds = runs["mean_speed_kmh"].to_numpy()
            speed, mean = mean_limits(speeds), float(speeds.mean())
            pm = "" if speed is None else f" ({speed.low:.1f} to {speed.high:.1f})"
            rows.append(
                [weather, name, f"{mean:.1f}{pm}", f"{km:.0f}",
                 str(runs["serious_contacts"].sum()), str(runs["road_departures"].sum()),
                 f"{100.0 * n / km:.1f} ({limits.low:.1f} to {limits.high:.1f})",
                 factor_text(bare, n) if name == ENVELOPE else "",
                 str(runs["rear_ended"].sum()), p_values.get(weather, "") if name == ENVELOPE else ""]
            )  # fmt: skip
    head = ["weather", "driver", "mean speed, km/h", "km", "contacts of 5 km/h", "departures",
            "both per 100 km (95 %)", "times fewer than bare (95 % bound)", "struck from behind",
            "against the table, p (Holm)"]  # fmt: skip
    return markdown(head, rows)


def factor_text(bare: int, governed: int) -> str:
    """Returns how many times fewer events there were; too few of them are said to be."""
    if bare < ENOUGH:
        return f"too few ({bare})"
    bound = factor_bound(bare, governed)
    return f"{bare / governed:.1f} (above {bound:.1f})" if governed else f"above {bound:.1f}"


def against_table(folder: Path) -> dict[str, str]:
    """Returns the p value of each weather that the envelope has fewer events per km than the table."""
    found: dict[str, float | None] = {}
    for weather, drivers in cells(folder):
        if ENVELOPE not in drivers or TABLE not in drivers:
            continue
        rates = [
            drivers[name].sort("seed").select(
                (pl.col("serious_contacts") + pl.col("road_departures")) / pl.col("distance_km")
            ).to_series().to_numpy()
            for name in (ENVELOPE, TABLE)
        ]  # fmt: skip
        differences = rates[0] - rates[1]
        found[weather] = 1.0 if not np.any(differences) else compare_pairs(differences).p
    adjusted = iter(holm([p for p in found.values() if p is not None]))
    return {w: "too few seeds" if p is None else f"{next(adjusted):.2f}" for w, p in found.items()}


def pareto(folder: Path) -> str:
    """Draws events per 100 km against mean speed beside the results, and returns the link to it."""
    points = []
    for name, runs in read_drivers(folder).items():
        km = float(runs["distance_km"].sum())
        points.append((name, [float(runs["mean_speed_kmh"].mean())], [100.0 * events(runs) / km]))  # type: ignore[arg-type]
    svg = scatter(points, "mean speed, km/h, all weathers", "contacts and departures per 100 km")
    (folder / PICTURE).write_text(svg, encoding="utf-8")
    return f"![Contacts and departures against mean speed](results/{folder.name}/{PICTURE})\n"
