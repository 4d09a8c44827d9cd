"""Tables and the Pareto picture of the speed envelope's proof, made of committed results.

A campaign `envelope-MAP` has the bare stack, the fixed limit, the envelope and the reference driver; the
rivals lie beside it in `envelope-MAP-GOVERN`; a stack of a user is bare in its campaign. Events: contacts of
5 km/h and more, and departures.
Weathers in which everything moved alike count once (decision T-3).
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import polars as pl

from envelope_power import ENOUGH, LEVEL, factor_bound
from result_texts import markdown
from skidpad.core.arrays import Floats
from skidpad.evidence.statistics import compare_pairs, holm, mean_limits, poisson_interval
from skidpad.report.elements.figures import scatter

OWN = {"3": "bare", "4": "fixed 80 km/h", "5": "envelope", "reference": "reference driver"}
RIVALS = {
    "envelope": "envelope", "table": "table of three speeds", "rss": "RSS, constant grip",
    "oracle": "envelope, true grip", "oracle-sight": "envelope, true sight",
    "full": "envelope, walkers and lane boundaries too",
    "pulses": "envelope with brake pulses", "only-sight": "sight alone", "only-lead": "lead alone",
    "only-bend": "bend alone", "only-water": "water alone", "grip-low": "grip 30 % too low",
    "grip-high": "grip 30 % too high", "first-curve": "envelope, resume ends behind the first bend",
}  # fmt: skip
BARE, ENVELOPE, TABLE, ORACLE = "bare", "envelope", RIVALS["table"], RIVALS["oracle"]
PICTURE = "pareto.svg"
COMPLETION, UNAIDED = "route_completion_pct", "route_unaided_pct"  # of routes with an end
MAPS = ("envelope-figure8", "envelope-motorway", "envelope-town")
SURFACES = {
    "rain": ("rain-noon", "rain_100"), "snow": ("snow",), "ice": ("icy_30", "icy_100"),
    "dry": ("clear-noon", "clear-night"),
}  # fmt: skip
SLIPPERY = ("rain", "snow", "ice")
WORSE_BY = 5.0  # events per 100 km that make a cell worse: preregistration of 2026-11-28
EVENTS_PER_KM = (pl.col("serious_contacts") + pl.col("road_departures")).sum() / pl.col(
    "distance_km"
).sum()


def read_drivers(folder: Path) -> dict[str, pl.DataFrame]:
    """Returns the runs of each driver of a map's family of campaigns.

    Of weathers in which everything moved alike one is kept, named after all: "icy_100, icy_30".
    """
    own = pl.read_parquet(folder / "results.parquet")
    found = {
        name: own.filter(pl.col("config") == config)
        for config, name in OWN.items()
        if config in own["config"].to_list()
    }
    found = found or {BARE: own}  # a stack of a user
    for govern, name in RIVALS.items():
        file = folder.with_name(f"{folder.name}-{govern}") / "results.parquet"
        if file.is_file():
            found[name] = pl.read_parquet(file)
    found = {driver: complete_twins(runs) for driver, runs in found.items()}
    names = name_alike(found)
    return {driver: keep_alike_once(runs, names) for driver, runs in found.items()}


def complete_twins(runs: pl.DataFrame) -> pl.DataFrame:
    """Returns one driver's runs with every weather whole, where --distinct drove one seed of those alike.

    A weather with fewer seeds takes the runs of another one that moved alike in all seeds of both.
    """
    by_weather = {str(w): t for (w,), t in runs.group_by("weather", maintain_order=True)}
    moved = {w: dict(zip(t["seed"], t["motion_hash"], strict=True)) for w, t in by_weather.items()}
    whole = []
    for weather, own in by_weather.items():
        twins = [
            w
            for w in by_weather
            if moved[weather].items() <= moved[w].items() and len(moved[w]) > len(own)
        ]
        most = by_weather[max(twins, key=lambda w: len(moved[w]))] if twins else own
        whole.append(most.with_columns(pl.lit(weather).alias("weather")))
    return pl.concat(whole)


def keep_alike_once(runs: pl.DataFrame, names: dict[str, str]) -> pl.DataFrame:
    """Returns the runs of the first weather of each group that the driver has, named after the group."""
    kept: dict[str, pl.DataFrame] = {}
    for weather, name in names.items():
        some = runs.filter(pl.col("weather") == weather)
        if name not in kept and len(some):
            kept[name] = some.with_columns(pl.lit(name).alias("weather"))
    return pl.concat(kept.values()) if kept else runs.clear()


def name_alike(drivers: dict[str, pl.DataFrame]) -> dict[str, str]:
    """Returns for each weather the name of its group: all in which each driver moved alike.

    Drivers that lack a weather of the bare stack have no say.
    """
    weathers = drivers[BARE]["weather"].unique(maintain_order=True).to_list()
    asked = [t for t in drivers.values() if set(weathers) <= set(t["weather"])]
    groups: dict[tuple[str, ...], list[str]] = {}
    for weather in weathers:
        moved = tuple(
            pl.concat(
                t.filter(pl.col("weather") == weather).sort("seed")["motion_hash"] for t in asked
            )
        )
        groups.setdefault(moved, []).append(weather)
    return {weather: ", ".join(group) for group in groups.values() for weather in group}


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
        for name, runs in drivers.items():
            if runs.is_empty():
                continue
            km, n = float(runs["distance_km"].sum()), events(runs)
            limits = poisson_interval(n, km / 100.0)
            speeds = runs["mean_speed_kmh"].to_numpy()
            speed, mean = mean_limits(speeds), float(speeds.mean())
            pm = "" if speed is None else f" ({speed.low:.1f} to {speed.high:.1f})"
            rows.append(
                [weather, name, f"{mean:.1f}{pm}", f"{km:.0f}",
                 str(runs["serious_contacts"].sum()), str(runs["road_departures"].sum()),
                 f"{100.0 * n / km:.1f} ({limits.low:.1f} to {limits.high:.1f})",
                 times_fewer(drivers[BARE], runs) if name == ENVELOPE else "",
                 str(runs["rear_ended"].sum()), p_values.get(weather, "") if name == ENVELOPE else ""]
            )  # fmt: skip
    head = ["weather", "driver", "mean speed, km/h", "km", "contacts of 5 km/h", "departures",
            "both per 100 km (95 %)", "times fewer than bare (95 % bound)", "struck from behind",
            "against the table, p (Holm)"]  # fmt: skip
    return markdown(head, rows)


def goals(folder: Path) -> str:
    """Returns one row per surface over the maps that are driven, and one per map: are the goals reached?

    folder: of any map of the proof. Units of the tests are seeds of a map.
    """
    maps = {
        name.removeprefix("envelope-"): read_drivers(path)
        for name in MAPS
        if (path := folder.with_name(name)).is_dir()
    }
    maps = {name: m for name, m in maps.items() if {ENVELOPE, TABLE, ORACLE} <= set(m)}
    if not maps:
        return "No map has all rivals yet.\n"
    every = list(maps.values())
    cells: dict[str, tuple[list[dict[str, pl.DataFrame]], tuple[str, ...]]] = {
        "rain, snow and ice": (every, SLIPPERY)
    }
    cells |= {f"the same on {name}": ([m], SLIPPERY) for name, m in maps.items()}
    cells |= {name: (every, (name,)) for name in SURFACES}
    rows: list[list[str]] = []
    p_values: list[float] = []
    for title, (drivers, surfaces) in cells.items():
        seen = {
            n: [on_surfaces(m[n], surfaces) for m in drivers]
            for n in (BARE, TABLE, ENVELOPE, ORACLE)
        }
        runs = {n: pl.concat(t, how="diagonal") for n, t in seen.items()}
        if runs[BARE].is_empty():
            continue
        p_values += [fewer_by_seed(seen[n], seen[ENVELOPE]) for n in (BARE, TABLE)]
        rows.append([
            title,
            *(count_text(runs[n]) for n in (BARE, TABLE, ENVELOPE)),
            times_fewer(runs[BARE], runs[ENVELOPE]),
            contacts_fewer(runs[BARE], runs[ENVELOPE]),
            times_fewer(runs[TABLE], runs[ENVELOPE]),
            f"{100.0 * mean_speed(runs[ENVELOPE]) / mean_speed(runs[ORACLE]):.0f} %",
            speed_text(seen[ENVELOPE], seen[TABLE]),
        ])  # fmt: skip
    adjusted = [f"{p:.2g}" if p >= 0.001 else "< 0.001" for p in holm(p_values)]
    rows = [row + adjusted[2 * i : 2 * i + 2] for i, row in enumerate(rows)]
    head = ["surface", "bare", TABLE, ENVELOPE, "times fewer than bare (95 % bound)",
            "contacts alone", "times fewer than the table (95 % bound)", "of the speed with true grip",
            "km/h more than the table (95 %)", "p against bare (Holm)",
            "p against the table (Holm)"]  # fmt: skip
    text = f"{len(maps)} of {len(MAPS)} maps. Contacts of 5 km/h + departures.\n\n"
    return text + markdown(head, rows)


def in_sum(folder: Path) -> str:
    """Returns one row per driver of a map over rain, snow and ice."""
    drivers = {n: on_surfaces(runs, SLIPPERY) for n, runs in read_drivers(folder).items()}
    bare = drivers[BARE]
    rows = [
        [name, count_text(runs), f"{mean_speed(runs):.1f}",
         *(of(bare, runs) if name == ENVELOPE else "" for of in (times_fewer, contacts_fewer))]
        for name, runs in drivers.items()
    ]  # fmt: skip
    head = ["driver", "contacts of 5 km/h + departures", "mean speed, km/h",
            "times fewer than bare (95 % bound)", "contacts alone"]  # fmt: skip
    return markdown(head, rows)


def worse(folder: Path) -> str:
    """Returns one row per map and weather: has the envelope more events than the bare stack, by WORSE_BY?

    folder: of any map of the proof. Paired by seed; p values of all cells are adjusted together (Holm).
    """
    found = [
        (name.removeprefix("envelope-"), weather, drivers)
        for name in MAPS
        if (path := folder.with_name(name)).is_dir()
        for weather, drivers in cells(path)
        if ENVELOPE in drivers
    ]
    more = [
        100.0 * np.subtract(*(by_seed([d[n]], EVENTS_PER_KM) for n in (ENVELOPE, BARE)))
        for _, _, d in found
    ]
    fewer = holm([compare_pairs(WORSE_BY - m).p_greater for m in more])
    larger = holm([compare_pairs(m - WORSE_BY).p_greater for m in more])
    rows = []
    for (name, weather, d), m, p, q in zip(found, more, fewer, larger, strict=True):
        verdict = "not worse" if p < LEVEL else "worse" if q < LEVEL else "too few to say"
        rows.append(
            [name, weather, count_text(d[BARE]), count_text(d[ENVELOPE]), compared_text(m, 1), f"{p:.2g}",
             verdict]
        )  # fmt: skip
    head = ["map", "weather", BARE, ENVELOPE, "more events per 100 km, mean of seeds (95 %)",
            f"p of {WORSE_BY:.0f} more (Holm)", "verdict"]  # fmt: skip
    return markdown(head, rows)


def count_text(runs: pl.DataFrame) -> str:
    """Returns contacts, departures and km of runs: "2 + 9 in 102 km"."""
    contacts, departures = (int(runs[c].sum()) for c in ("serious_contacts", "road_departures"))
    return f"{contacts} + {departures} in {runs['distance_km'].sum():.0f} km"


def mean_speed(runs: pl.DataFrame) -> float:
    """Returns the mean of the runs' mean speeds in km/h."""
    return float(runs["mean_speed_kmh"].to_numpy().mean())


def on_surfaces(runs: pl.DataFrame, surfaces: tuple[str, ...]) -> pl.DataFrame:
    """Returns the runs in weathers of these surfaces."""
    weathers = [w for name in surfaces for w in SURFACES[name]]
    return runs.filter(pl.col("weather").str.split(", ").list.first().is_in(weathers))


def times_fewer(rival: pl.DataFrame, governed: pl.DataFrame) -> str:
    """Returns how many times fewer events per km the governed runs have, or that there are too few."""
    return factor_text(events(rival), events(governed), way_ratio(rival, governed))


def contacts_fewer(rival: pl.DataFrame, governed: pl.DataFrame) -> str:
    """Returns how many times fewer contacts per km the governed runs have, or that there are too few."""
    contacts = [int(runs["serious_contacts"].sum()) for runs in (rival, governed)]
    return factor_text(contacts[0], contacts[1], way_ratio(rival, governed))


def way_ratio(rival: pl.DataFrame, governed: pl.DataFrame) -> float:
    """Returns the way of the governed runs as a share of the rival's."""
    return float(governed["distance_km"].sum()) / float(rival["distance_km"].sum())


def by_seed(tables: list[pl.DataFrame], of: pl.Expr) -> Floats:
    """Returns the value of each seed of each map, the maps in turn and their seeds in order."""
    return np.concatenate(
        [t.group_by("seed").agg(of).sort("seed").to_series(1).to_numpy() for t in tables]
    )


def speed_text(governed: list[pl.DataFrame], rivals: list[pl.DataFrame]) -> str:
    """Returns how much faster the governed runs are on average, with limits over the seeds of all maps."""
    speed = pl.col("mean_speed_kmh").mean()
    return compared_text(by_seed(governed, speed) - by_seed(rivals, speed), 1)


def compared_text(differences: Floats, digits: int) -> str:
    """Returns the mean of paired differences with its limits: "+1.2 (+0.4 to +2.0)"."""
    found = compare_pairs(differences)
    if found.interval is None:
        return f"{found.mean:+.{digits}f} (no limits)"
    low, high = found.interval
    return f"{found.mean:+.{digits}f} ({low:+.{digits}f} to {high:+.{digits}f})"


def fewer_by_seed(rivals: list[pl.DataFrame], governed: list[pl.DataFrame]) -> float:
    """Returns the one-sided p value that the governed runs have fewer events per km; unit: a map's seed."""
    return compare_pairs(
        by_seed(rivals, EVENTS_PER_KM) - by_seed(governed, EVENTS_PER_KM)
    ).p_greater


def factor_text(bare: int, governed: int, way: float = 1.0) -> str:
    """Returns how many times fewer events there were; too few of them are said to be.

    way: of the governed runs as a share of the bare stack's.
    """
    if bare < ENOUGH:
        return f"too few ({bare})"
    bound = factor_bound(bare, governed) * way
    return f"{bare * way / governed:.1f} (above {bound:.1f})" if governed else f"above {bound:.1f}"


def against_table(folder: Path) -> dict[str, str]:
    """Returns the p value of each weather that the envelope has fewer events per km than the table."""
    found: dict[str, float | None] = {}
    for weather, drivers in cells(folder):
        if ENVELOPE not in drivers or TABLE not in drivers:
            continue
        differences = np.subtract(
            *(by_seed([drivers[name]], EVENTS_PER_KM) for name in (ENVELOPE, TABLE))
        )
        found[weather] = 1.0 if not np.any(differences) else compare_pairs(differences).p
    adjusted = iter(holm([p for p in found.values() if p is not None]))
    return {w: "too few seeds" if p is None else f"{next(adjusted):.2f}" for w, p in found.items()}


def routes(folder: Path) -> str:
    """Returns one row per weather and driver of routes with an end: do they arrive, and how?"""
    rows = []
    for weather, drivers in cells(folder):
        for name, runs in drivers.items():
            if runs.is_empty():
                continue
            rows.append([
                weather, name, str(len(runs)),
                *(share_text(runs, column) for column in (COMPLETION, UNAIDED)),
                "" if name == BARE else difference_text(drivers[BARE], runs, UNAIDED),
                f"{mean_speed(runs):.1f}", count_text(runs),
                times_fewer(drivers[BARE], runs) if name == ENVELOPE else "",
            ])  # fmt: skip
    head = ["weather", "driver", "runs", "route driven, % (arrived)", "until first put back, % (arrived)",
            "the latter, more than bare (95 %)", "mean speed, km/h", "contacts of 5 km/h + departures",
            "times fewer than bare (95 % bound)"]  # fmt: skip
    return markdown(head, rows)


def share_text(runs: pl.DataFrame, column: str) -> str:
    """Returns the mean of a share in % and how many runs have all of it: "93 (8)"."""
    shares = runs[column].fill_null(0.0).to_numpy()
    return f"{shares.mean():.0f} ({int((shares >= 100.0).sum())})"


def difference_text(rival: pl.DataFrame, governed: pl.DataFrame, column: str) -> str:
    """Returns how much more of a column governed runs have, with limits over the seeds they share."""
    both = rival.join(governed, on="seed", suffix="_governed").sort("seed")
    differences = both[f"{column}_governed"].fill_null(0.0) - both[column].fill_null(0.0)
    return compared_text(differences.to_numpy(), 0)


def pareto(folder: Path) -> str:
    """Draws events per 100 km against mean speed beside the results, and returns the link to it."""
    points = []
    for name, runs in read_drivers(folder).items():
        km = float(runs["distance_km"].sum())
        points.append((name, [float(runs["mean_speed_kmh"].mean())], [100.0 * events(runs) / km]))  # type: ignore[arg-type]
    svg = scatter(points, "mean speed, km/h, all weathers", "contacts and departures per 100 km")
    (folder / PICTURE).write_text(svg, encoding="utf-8")
    return f"![Contacts and departures against mean speed](results/{folder.name}/{PICTURE})\n"
