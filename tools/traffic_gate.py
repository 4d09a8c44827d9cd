"""Drives background traffic for 2500 km in four weathers and looks at it from outside.

In addition it drives an hour of town in each weather. No two vehicles may overlap, none may be moved
with another within 3 s, and no circle of vehicles may wait for each other. Headways in steady following
and each stand of more than 120 s are written down as they are. The result is
docs/results/traffic/gate.json; it takes about ten minutes of processor time.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

from skidpad.campaign.bench.traffic import TrafficRow, measure, measure_drive
from skidpad.campaign.bench.traffic_options import TrafficBench

RESULT = Path(__file__).parents[1] / "docs" / "results" / "traffic" / "gate.json"
WEATHERS = ("clear-noon", "rain-noon", "snow", "icy_30")
MAPS = {"figure8": 0.4, "motorway": 0.4, "town": 0.2}  # shares of the distance
KM, VEHICLES = 2500.0, 60
HOUR, TOWN_SEED = 3600.0, 907_000  # s of town and its seed


def described(map: str, row: TrafficRow) -> dict[str, Any]:
    """A row of the result."""
    return {
        "map": map,
        "weather": row.weather,
        "km": round(row.km, 1),
        "contacts": row.contacts,
        "off_road": row.static,
        "put_back": row.put_back,
        "mean_speed_kmh": round(row.mean_speed_kmh, 2),
        "changes_per_km": round(row.changes / row.km, 3),
        **row.seen.summary(),
    }


def show(row: dict[str, Any]) -> None:
    """Print what a row of the result says of the gate."""
    names = ("km", "overlaps", "moved_close", "longest_stand_s")
    print(row["map"], row["weather"], *(f"{name} {row[name]}" for name in names), flush=True)


def main() -> int:
    """Drive, write the result; 1 when vehicles overlapped, were moved beside others or waited in a circle."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--km", type=float, default=KM, help="all vehicles, weathers and maps together"
    )
    parser.add_argument("--out", type=Path, default=RESULT)
    asked = parser.parse_args()
    rows = []
    for map, share in MAPS.items():
        for weather in WEATHERS:
            km = max(asked.km * share / len(WEATHERS), 1.0)
            row = measure(TrafficBench(map=map, vehicles=VEHICLES, km=km), weather)
            rows.append(described(map, row))
            show(rows[-1])
    for weather in WEATHERS:
        row = measure_drive(TrafficBench(map="town", vehicles=VEHICLES), weather, TOWN_SEED, HOUR)
        rows.append(described("town, an hour", row))
        show(rows[-1])
    commit = subprocess.run(
        ["git", "describe", "--always", "--dirty"], capture_output=True, text=True, check=False
    )
    asked.out.parent.mkdir(parents=True, exist_ok=True)
    result = {
        "date": datetime.now(timezone.utc).date().isoformat(),
        "commit": commit.stdout.strip(),
        "rows": rows,
    }
    asked.out.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
    forbidden = ("overlaps", "contacts", "moved_close", "circles")
    return int(any(row[name] for row in rows for name in forbidden))


if __name__ == "__main__":
    sys.exit(main())
