"""Drives background traffic for 2500 km in four weathers and looks at it from outside.

No two vehicles may overlap, and nobody may be moved with anybody within 3 s. Headways in steady
following and everyone who stood for more than 120 s are written down as they are. The result is
docs/results/traffic/gate.json; it takes about three minutes of processor time.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

from skidpad.campaign.bench.traffic import TrafficRow, measure
from skidpad.campaign.bench.traffic_options import TrafficBench

RESULT = Path(__file__).parents[1] / "docs" / "results" / "traffic" / "gate.json"
WEATHERS = ("clear-noon", "rain-noon", "snow", "icy_30")
MAPS = {"figure8": 0.4, "motorway": 0.4, "town": 0.2}  # shares of the distance
KM, VEHICLES = 2500.0, 60


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


def main() -> int:
    """Drive, write the result; 1 when vehicles overlapped or were moved beside others."""
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
            print(map, weather, *(f"{k} {rows[-1][k]}" for k in ("km", "overlaps", "moved_close")))
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
    return int(any(r["overlaps"] or r["contacts"] or r["moved_close"] for r in rows))


if __name__ == "__main__":
    sys.exit(main())
