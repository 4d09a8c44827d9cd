"""`skidpad bench`: what things cost on this machine, in CPU time."""

from __future__ import annotations

import json as plain_json
import os
import platform
from collections.abc import Iterator
from dataclasses import asdict
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from skidpad.campaign.bench.traffic_options import TrafficBench
from skidpad.cli.options.spread import spread_fields
from skidpad.core.setup import DT

if TYPE_CHECKING:
    from skidpad.campaign.bench.tick import Row
    from skidpad.campaign.bench.traffic_watch import TrafficCounts


class Subject(str, Enum):
    """The speeds that can be measured."""

    TICK = "tick"
    SENSORS = "sensors"
    PHYSICS = "physics"
    MATRIX = "matrix"
    TRAFFIC = "traffic"
    SCENARIOS = "scenarios"


@spread_fields()
def bench(
    traffic: TrafficBench,
    subject: Annotated[Subject, typer.Argument(help="What to measure.")] = Subject.TICK,
    seconds: Annotated[
        float, typer.Option(min=1.0, help="Simulated seconds per measured drive.")
    ] = 60.0,
    json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
    run: Annotated[
        bool, typer.Option("--run", help="matrix: drive all 30 runs instead of estimating.")
    ] = False,
) -> None:
    """Measure CPU time: per tick, sensor, vehicle, of the matrix, of files; or what traffic does."""
    measure = {
        Subject.TICK: lambda: _tick(seconds, json),
        Subject.SENSORS: lambda: _sensors(json),
        Subject.PHYSICS: lambda: _physics(json),
        Subject.MATRIX: lambda: _matrix(seconds, run, json),
        Subject.TRAFFIC: lambda: _traffic(traffic, json),
        Subject.SCENARIOS: lambda: _scenarios(seconds, json),
    }
    figures = measure[subject]()
    about = {"subject": subject.value, "machine": machine(), "cores": os.cpu_count()}
    if json:
        typer.echo(plain_json.dumps({**about, **figures}, indent=2))
    else:
        typer.echo(f"on {about['machine']}, {about['cores']} cores; other load inflates figures")


def machine() -> str:
    """Returns the processor's name as the system tells it."""
    try:
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    except OSError:  # not Linux
        pass
    return platform.processor() or platform.machine()


def _tick(seconds: float, quiet: bool) -> dict[str, Any]:
    """Returns the cost of a tick per configuration and weather in ms; prints it unless quiet."""
    from skidpad.campaign.bench.tick import tick_costs

    rows = []
    if not quiet:
        typer.echo(
            "config  weather      sensors    x real time    mean  median    p99  ms per tick"
        )
    for row in tick_costs(seconds):
        rows.append(asdict(row))
        if not quiet:
            typer.echo(_line(row))
    return {"unit": "ms per tick", "rows": rows}


def _line(row: Row) -> str:
    """Returns a row of tick costs in ms as two lines of text."""
    c = row.cost
    parts = ", ".join(f"{name} {ms:.2f}" for name, ms in sorted(c.parts.items()))
    real = 1000.0 * DT / c.mean
    return (
        f"{row.configuration:<7} {row.weather:<12} {row.sensors:<10} {real:11.0f} {c.mean:7.2f} "
        f"{c.median:7.2f} {c.p99:6.2f}\n        {parts}"
    )


def _sensors(quiet: bool) -> dict[str, Any]:
    """Returns the cost of each sensor in ms per tick; prints it unless quiet."""
    from skidpad.sensors.bench import run

    return _plain(run(), "ms per tick, median", quiet)


def _physics(quiet: bool) -> dict[str, Any]:
    """Returns the cost of the physics in us per vehicle and tick; prints it unless quiet."""
    from skidpad.physics.bench import run

    return _plain(run(), "us per vehicle and tick, median", quiet)


def _plain(figures: dict[str, float], unit: str, quiet: bool) -> dict[str, Any]:
    """Returns figures with their unit as plain data; prints them unless quiet."""
    if not quiet:
        typer.echo(unit)
        for stage, value in figures.items():
            typer.echo(f"  {stage:<20} {value:7.3f}")
    return {"unit": unit, "figures": figures}


def _matrix(seconds: float, run: bool, quiet: bool) -> dict[str, Any]:
    """Returns the minutes that the matrix takes, driven or estimated; prints them unless quiet."""
    from skidpad.campaign.bench import matrix

    minutes = matrix.driven_minutes() if run else matrix.estimated_minutes(seconds)
    how = "wall time, driven" if run else "estimated from tick costs"
    if not quiet:
        typer.echo(
            f"30 runs of 500 s with all sensors: {minutes:.1f} min on {matrix.CORES} cores ({how})"
        )
    return {"unit": "min", "minutes": minutes, "how": how, "target": matrix.TARGET}


def _describe_seen(seen: TrafficCounts) -> Iterator[str]:
    """Yields lines on headways in steady following, vehicles that stood long, and circles of such."""
    from skidpad.campaign.bench.headways import headways_of
    from skidpad.campaign.bench.traffic_watch import LONG

    for road, headways in (
        ("from 80 km/h on", seen.fast),
        ("from 80 km/h on, followers alone", seen.followers_fast),
        ("below 80 km/h", seen.slow),
        ("below 80 km/h, followers alone", seen.followers_slow),
    ):
        if headways:
            found = headways_of(headways)
            quantiles = ", ".join(f"{q:.2f}" for q in found["quantiles_s"])
            yield (
                f"headway where the limit is {road}: {quantiles} s (5, 25, 50, 75, 95 %), "
                f"{100.0 * found['share_below_1_s']:.1f} % below 1 s"
            )
    for s in seen.stands:
        yield (
            f"vehicle {s.actor} of seed {s.seed} stood {s.seconds:.0f} s (more than {LONG:.0f}) at "
            f"({s.x:.0f}, {s.y:.0f}): {s.cause}"
        )
    for circle in seen.circles:
        yield f"vehicles that wait for each other: {'; '.join(circle)}"


def _scenarios(seconds: float, quiet: bool) -> dict[str, Any]:
    """Returns the cost of playing and checking scenario files; prints it unless quiet."""
    from skidpad.campaign.bench.scenarios import measure

    rows = measure(seconds)
    if not quiet:
        typer.echo("two cars, everything ideal, step 0.05 s; medians")
        for row in rows:
            typer.echo(f"  {row.what:<22} {row.value:8.2f} {row.unit}")
    return {"rows": [{**asdict(row), "met": row.is_met} for row in rows]}


def _traffic(asked: TrafficBench, quiet: bool) -> dict[str, Any]:
    """Returns the contacts and flow of background traffic by weather; prints them unless quiet."""
    from skidpad.campaign.bench.traffic import measure

    rows = []
    if not quiet:
        typer.echo(
            "weather          km  contacts  per 100 km [95 %]     km/h  changes/km  off road  put back"
            "  moved"
        )
    for weather in asked.weather:
        row = measure(asked, weather)
        low, high = row.interval.low, row.interval.high
        changes = row.changes / row.km
        rows.append(
            {
                **{name: value for name, value in asdict(row).items() if name != "seen"},
                **row.seen.summary(),
                "per_100_km": row.per_100_km,
                "low": low,
                "high": high,
                "mean_speed_kmh": row.mean_speed_kmh,
                "changes_per_km": changes,
            }
        )
        if not quiet:
            rate = f"{row.per_100_km:.2f} [{low:.2f}, {high:.2f}]"
            typer.echo(
                f"{weather:<12} {row.km:6.0f} {row.contacts:9} {rate:>20} "
                f"{row.mean_speed_kmh:8.1f} {changes:11.2f} {row.static:9} {row.put_back:9}"
                f"{row.seen.moved:7}"
            )
            for line in _describe_seen(row.seen):
                typer.echo(f"  {line}")
    return {"map": asked.map, "vehicles": asked.vehicles, "rows": rows}
