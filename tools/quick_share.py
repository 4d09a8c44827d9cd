"""Measures what `make test` reaches of what `make test-all` reaches: lines by package, processor time.

    python tools/quick_share.py                      # every piece of the tests, then the table
    python tools/quick_share.py --only roads physics # some pieces; two calls may run side by side
    python tools/quick_share.py --only               # no piece: the table of what is there

A piece is a folder of tests/; `tests` are the files beside the folders. Each is run as `make test` runs it
and as `make test-all` does, by coverage.py with its subprocesses. A piece that is there for this commit is
not run again, so that a measurement that was stopped goes on. When all pieces are there, the table goes to
docs/results/quick-share.csv.

Compiled kernels are not counted: coverage.py sees no line of machine code. Without compilation
(NUMBA_DISABLE_JIT) drives take hundreds of times as long, so their lines are absent from both sides.
"""

from __future__ import annotations

import argparse
import csv
import json
import os
import resource
import subprocess
import sys
import tempfile
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

from nightly import commit

ROOT = Path(__file__).resolve().parents[1]
TESTS, PACKAGE = ROOT / "tests", ROOT / "src" / "skidpad"
TABLE = ROOT / "docs" / "results" / "quick-share.csv"
SUITES = {"quick": ("-m", "not slow", "--hypothesis-profile", "quick"), "full": ()}
RUN = """[run]
source_pkgs = skidpad
parallel = true
concurrency = multiprocessing,thread
patch = subprocess
data_file = {data}
"""
NOTHING_COLLECTED, FAILED = 5, 1  # exit codes of pytest that leave a measurement

Lines = dict[str, list[int]]  # by file below src/skidpad


def list_pieces() -> list[str]:
    """Returns the pieces of the tests by name."""
    folders = (p for p in TESTS.iterdir() if p.is_dir() and any(p.rglob("test_*.py")))
    return sorted([*(p.name for p in folders), TESTS.name])


def files_of(piece: str) -> list[str]:
    """Returns what pytest is given for a piece."""
    if piece == TESTS.name:
        return sorted(str(p.relative_to(ROOT)) for p in TESTS.glob("test_*.py"))
    return [f"tests/{piece}"]


def measure(piece: str, suite: str) -> dict[str, Any]:
    """Runs a piece of a suite; returns the lines that it reached and the processor time that it took."""
    with tempfile.TemporaryDirectory() as folder:
        settings = Path(folder) / "settings"
        settings.write_text(RUN.format(data=Path(folder) / "data"), encoding="utf-8")
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        done = subprocess.run(
            [sys.executable, "-m", "coverage", "run", f"--rcfile={settings}",
             "-m", "pytest", "-p", "no:cacheprovider", *SUITES[suite], *files_of(piece)],
            cwd=ROOT, check=False, env=os.environ | {"PYTHONPATH": search_path()},
        )  # fmt: skip
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        if done.returncode not in (0, FAILED, NOTHING_COLLECTED):
            sys.exit(f"{piece}, {suite}: pytest ended with exit code {done.returncode}")
        return {
            "date": datetime.now(timezone.utc).date().isoformat(),
            "passed": done.returncode != FAILED,
            "seconds": after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime,
            "lines": read_lines(Path(folder)),
        }


def search_path() -> str:
    """Returns PYTHONPATH with this tree first."""
    return os.pathsep.join(p for p in (str(ROOT / "src"), os.environ.get("PYTHONPATH", "")) if p)


def read_lines(folder: Path) -> Lines:
    """Returns the lines of the package that the data files of coverage.py in a folder hold.

    A process that a test killed while it wrote leaves a file that is none; it adds no line. Neither do
    copies of the package that tests make elsewhere.
    """
    from coverage import CoverageData
    from coverage.exceptions import DataError

    reached: defaultdict[str, set[int]] = defaultdict(set)
    for path in folder.glob("data*"):
        data = CoverageData(str(path))
        try:
            data.read()
        except DataError:
            continue
        for file in data.measured_files():
            if not Path(file).is_relative_to(PACKAGE):
                continue
            reached[Path(file).relative_to(PACKAGE).as_posix()] |= set(data.lines(file) or ())
    return {file: sorted(lines) for file, lines in sorted(reached.items())}


def join_lines(parts: Iterable[Mapping[str, Any]]) -> dict[str, set[tuple[str, int]]]:
    """Returns the lines that some pieces reached together, by package."""
    joined: defaultdict[str, set[tuple[str, int]]] = defaultdict(set)
    for part in parts:
        for file, lines in part["lines"].items():
            package = file.split("/")[0] if "/" in file else "skidpad"
            joined[package] |= {(file, line) for line in lines}
    return joined


def make_rows(measured: Mapping[str, Sequence[Mapping[str, Any]]]) -> list[dict[str, Any]]:
    """Returns the table: a row per package with its lines, and one with processor time.

    measured: what the pieces of each suite gave. What the quick suite reaches and the full one does not,
    as examples are drawn at random, counts on both sides.
    """
    quick, full = (join_lines(measured[suite]) for suite in SUITES)
    rows: list[dict[str, Any]] = []
    for package in sorted(quick.keys() | full.keys()):
        ours, all_lines = len(quick[package]), len(quick[package] | full[package])
        if all_lines:
            rows.append({"measure": "lines", "of": package, "quick": ours, "full": all_lines})
    seconds = {suite: round(sum(p["seconds"] for p in measured[suite])) for suite in SUITES}
    rows.append({"measure": "processor seconds", "of": "all", **seconds})
    parts = [part for suite in SUITES for part in measured[suite]]
    made = {"date": max(p["date"] for p in parts), "commit": parts[0]["commit"]}
    return [row | {"share": f"{row['quick'] / max(row['full'], 1):.3f}"} | made for row in rows]


def read_part(path: Path, version: str) -> dict[str, Any] | None:
    """Returns what was measured of a piece at this version, or None."""
    if not path.exists():
        return None
    part: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return part if part["commit"] == version else None


def main() -> None:
    """Runs the pieces that are asked for and prints the table of those that are there."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", nargs="*", choices=list_pieces(), help="pieces to run")
    parser.add_argument("--out", type=Path, default=ROOT / "out" / "quick-share")
    asked = parser.parse_args()
    asked.out.mkdir(parents=True, exist_ok=True)
    pieces, version = list_pieces(), commit()
    for piece in pieces if asked.only is None else asked.only:
        for suite in SUITES:
            path = asked.out / f"{piece}-{suite}.json"
            if read_part(path, version) is None:
                new = {"commit": version, **measure(piece, suite)}
                path.write_text(json.dumps(new), encoding="utf-8")
    parts = {
        (p, s): read_part(asked.out / f"{p}-{s}.json", version) for p in pieces for s in SUITES
    }
    there = [p for p in pieces if all(parts[p, s] is not None for s in SUITES)]
    if not there:
        sys.exit("no piece was measured at this commit")
    measured = {s: [part for p in there if (part := parts[p, s])] for s in SUITES}
    rows = make_rows(measured)
    for row in rows:
        print(*row.values(), sep="\t")
    failed = [p for k, p in enumerate(there) if not all(measured[s][k]["passed"] for s in SUITES)]
    print(f"{len(there)} of {len(pieces)} pieces; with failed tests: {', '.join(failed) or 'none'}")
    if len(there) == len(pieces):
        with TABLE.open("w", encoding="utf-8", newline="") as file:
            writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
            writer.writeheader()
            writer.writerows(rows)


if __name__ == "__main__":
    main()
