"""Makes the fleet that `skidpad fleet demo --recorded` opens, from a finished demo folder.

    skidpad fleet demo --out DIR --vehicles 6 --no-stay
    python tools/fleet_recording.py DIR --commit COMMIT

COMMIT is what drove the demo; date and numbers are read from its store.

Keys are left out; the store is written anew without its journal.
"""

from __future__ import annotations

import argparse
import json
import shutil
import sqlite3
import tarfile
import tempfile
from datetime import datetime, timezone
from pathlib import Path

from skidpad.cli.fleet.demo import SEED
from skidpad.fleet.recorded import ARCHIVE, PROVENANCE

MOST = 1_500_000  # bytes of the archive


def main() -> int:
    """Write archive and provenance; 1 when the archive is too large."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="of a finished demo")
    parser.add_argument("--commit", required=True, help="that the demo was driven at")
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        copy = Path(name) / "data"
        left_out = shutil.ignore_patterns("keys", "fleet.sqlite*")
        shutil.copytree(asked.folder / "data", copy, ignore=left_out)
        with sqlite3.connect(asked.folder / "data" / "fleet.sqlite") as store:
            store.execute("VACUUM INTO ?", (str(copy / "fleet.sqlite"),))
            vehicles, drives, hazards = (
                store.execute(f"SELECT count(*) FROM {table}").fetchone()[0]
                for table in ("vehicles", "drives", "hazards")
            )
            last = store.execute("SELECT max(at) FROM drives").fetchone()[0]
        with tarfile.open(ARCHIVE, "w:gz") as archive:
            for path in sorted(copy.iterdir()):
                archive.add(path, path.name, filter=_without_owner)
    about = {
        "date": f"{datetime.fromtimestamp(last, timezone.utc):%Y-%m-%d}",
        "commit": asked.commit,
        "command": f"skidpad fleet demo --out DIR --vehicles {vehicles} --no-stay",
        "vehicles": vehicles,
        "drives": drives,
        "hazards": hazards,
        "first_seed": SEED,
    }
    PROVENANCE.write_text(json.dumps(about, indent=1) + "\n", encoding="utf-8")
    size = ARCHIVE.stat().st_size
    print(f"{ARCHIVE}: {size} bytes; {about}")
    return 1 if size > MOST else 0


def _without_owner(member: tarfile.TarInfo) -> tarfile.TarInfo:
    member.uid = member.gid = 0
    member.uname = member.gname = ""
    return member


if __name__ == "__main__":
    raise SystemExit(main())
