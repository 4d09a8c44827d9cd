"""Reference trajectories of esmini, and how far ours are from them. Fetches and builds nothing.

    python tools/scenario_oracle.py references --esmini DIR [NAME...]
    python tools/scenario_oracle.py record CORPUS --esmini DIR
    python tools/scenario_oracle.py compare CORPUS

`references` plays our own cases (tests/support/oracle/cases.py) with the programs `esmini` and
`dat2csv` in DIR. `record` does so for files of others, `compare` plays those and prints a table;
their references are stored by the file's hash, the files themselves are not. `compare` fails where a
file of a stored reference is missing from CORPUS.
"""

from __future__ import annotations

import argparse
import csv
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable, Sequence
from math import inf, pi
from pathlib import Path
from unittest.mock import patch

ROOT = Path(__file__).parents[1]
sys.path[:0] = [str(ROOT / "tests")]

from skidpad.core.errors import SkidpadError  # noqa: E402
from skidpad.scenarios import registry  # noqa: E402
from skidpad.scenarios.playing.stage import PlayedScenario, play_ideal  # noqa: E402
from skidpad.scenarios.scenario import compile_scenario  # noqa: E402
from support.oracle.cases import CASES  # noqa: E402
from support.oracle.reference import (  # noqa: E402
    OTHERS,
    OWN,
    Reference,
    State,
    deviations,
    file_hash,
    read_reference,
    write_case,
)

STEP, SAMPLE = 0.05, 0.2  # s, of the players and of what is stored
OPTIONS = f"--fixed_timestep {STEP} --disable_controllers"
LEAST_WAY = 5.0  # m that an entity of a corpus moves to be counted
CORPUS_END = 40.0  # s of a file of others
RECORD_MAX = 3_000_000  # bytes that esmini writes before it is interrupted: minutes of a file
WALL_MAX = 30.0  # s after which it is interrupted, too
NOT_COMPARABLE = {  # by the file's hash: why its motion is nothing to compare
    "5238302359bb20b98c5061f5c501e6829825afed8a79a40e6f18ad3c5640236e": (
        "swarm.xosc of esmini: a TrafficSwarmAction, whose vehicles esmini draws at random"
    ),
}


def run_esmini(programs: Path, file: Path, roads: Path | None = None) -> Reference:
    """Returns what esmini makes of a file; RuntimeError where it does not play it.

    `roads` is a folder in which it looks for roads, too.
    """
    with tempfile.TemporaryDirectory() as folder:
        record = Path(folder) / "run.dat"
        command = [str((programs / "esmini").resolve()), "--osc", str(file.resolve()), "--headless"]
        command += [*OPTIONS.split(), "--record", str(record), "--disable_stdout", "--disable_log"]
        if roads is not None:
            command += ["--path", str(roads.resolve())]
        code = _run_until_recorded(command, record)
        if not record.exists() or code not in (0, 255):
            raise RuntimeError(f"esmini does not play {file.name} (exit {code})")
        rows = [str((programs / "dat2csv").resolve()), "--file", str(record), "--precision", "6"]
        subprocess.run(rows, cwd=folder, timeout=60, check=True, capture_output=True)
        lines = record.with_suffix(".csv").read_text().splitlines()
    head = next(k for k, line in enumerate(lines) if line.startswith("time"))
    entities: dict[str, dict[int, State]] = {}
    for row in csv.DictReader(lines[head:], skipinitialspace=True):
        ms = round(float(row["time"]) * 1000.0)
        if ms % round(SAMPLE * 1000.0) == 0 and ms <= CORPUS_END * 1000.0:
            state = State(*(float(row[k]) for k in ("x", "y", "h", "speed")))
            entities.setdefault(row["name"], {})[ms] = state
    return Reference(_version(programs), OPTIONS, file_hash(file), entities)


def _run_until_recorded(command: Sequence[str], record: Path) -> int:
    """Runs esmini until it ends, or interrupts it after a long record or time; returns its exit status.

    Many files never end by themselves; of what stands still esmini records nothing more.
    """
    quiet = subprocess.DEVNULL
    end = time.monotonic() + WALL_MAX
    with subprocess.Popen(command, cwd=record.parent, stdout=quiet, stderr=quiet) as running:
        while running.poll() is None:
            time.sleep(0.05)
            long = record.exists() and record.stat().st_size > RECORD_MAX
            if long or time.monotonic() > end:
                running.send_signal(signal.SIGINT)
                try:
                    return running.wait(WALL_MAX)
                except subprocess.TimeoutExpired:
                    running.kill()
                    raise
    return running.returncode


def _version(programs: Path) -> str:
    command = [str((programs / "esmini").resolve()), "--version"]
    out = subprocess.run(command, capture_output=True, text=True, check=False, cwd="/").stdout
    line = next(line for line in out.splitlines() if "GIT REV" in line)
    return "esmini " + line.split()[-1]


def references(programs: Path, names: Sequence[str]) -> int:
    """Stores esmini's trajectories of our own cases."""
    OWN.mkdir(exist_ok=True)
    if not names:
        shutil.rmtree(OWN)
        OWN.mkdir()
    failed = 0
    for name in names or CASES:
        with tempfile.TemporaryDirectory() as folder:
            try:
                reference = run_esmini(programs, write_case(name, Path(folder)))
            except (RuntimeError, subprocess.SubprocessError) as error:
                print(f"{name}: {error}")
                failed += 1
                continue
        (OWN / f"{name}.csv").write_text(reference.text(), encoding="utf-8")
    return failed


def corpus_files(folders: Iterable[Path]) -> dict[str, Path]:
    """Returns scenario files, not catalogs, by their hashes, the first of equals."""
    found: dict[str, Path] = {}
    for folder in folders:
        for file in sorted(folder.rglob("*.xosc")):
            if b"<Storyboard" in file.read_bytes():
                found.setdefault(file_hash(file), file)
    return found


def record(programs: Path, folders: Sequence[Path]) -> int:
    """Stores esmini's trajectories of files of others, by hash."""
    OTHERS.mkdir(exist_ok=True)
    for hashed, file in corpus_files(folders).items():
        try:
            reference = run_esmini(programs, file)
        except (RuntimeError, subprocess.SubprocessError, StopIteration) as error:
            print(f"{file}: {error}")
            continue
        (OTHERS / f"{hashed[:16]}.csv").write_text(reference.text(), encoding="utf-8")
    return 0


def play_without_controllers(
    file: Path, end: float = CORPUS_END, maps: Sequence[Path] = ()
) -> PlayedScenario:
    """Plays a file as esmini does with --disable_controllers: no name of a controller is known.

    What has no stop trigger goes on to the end. end: s after which it stops; maps: folders with roads.
    """
    with patch.object(registry.Names, "find", return_value=None):
        scenario = compile_scenario(file, maps=maps)
        return play_ideal(scenario, end, STEP, ends_with_acts=False)


def compare(folders: Sequence[Path]) -> int:
    """Prints how far our trajectories of files of others are from the stored ones."""
    files, places, bad = corpus_files(folders), [], 0
    stored = [read_reference(f) for f in sorted(OTHERS.glob("*.csv"))]
    if not stored:
        print(f"no trajectories are stored in {OTHERS.name}: `record` them first")
        return 1
    for reference in stored:
        if reference.file_hash in NOT_COMPARABLE:
            print(f"left out: {NOT_COMPARABLE[reference.file_hash]}")
            continue
        file = files.get(reference.file_hash)
        if file is None:
            print(f"missing: no file with sha256 {reference.file_hash} in the corpus")
            bad += 1
            continue
        try:
            told = play_without_controllers(file)
        except SkidpadError as error:
            print(f"{file.name}: {str(error).splitlines()[0]}")
            places += [inf] * len(reference.entities)
            continue
        for name, d in deviations(told, reference).items():
            if d.way >= LEAST_WAY:
                places.append(d.place)
                if not d.is_within:
                    print(f"{file.name} {name}: {d.place:.2f} m, {d.heading * 180.0 / pi:.1f} deg, "
                          f"{d.speed:.2f} m/s, first at {d.since} s")  # fmt: skip
    for bound in (0.1, 0.5, 2.0):
        share = sum(p <= bound for p in places) / max(len(places), 1)
        print(f"within {bound:g} m: {share:.1%} of {len(places)} entities")
    return bad


def main() -> int:
    """Runs the command."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", choices=("references", "record", "compare"))
    parser.add_argument("names", nargs="*", help="cases, or folders of files")
    parser.add_argument("--esmini", type=Path, help="folder with esmini and dat2csv")
    given = parser.parse_intermixed_args()
    if given.what != "compare" and given.esmini is None:
        parser.error(
            f"{given.what} needs --esmini DIR, a folder with the programs esmini and dat2csv"
        )
    if given.what == "references":
        return references(given.esmini, given.names)
    folders = [Path(name) for name in given.names]
    return record(given.esmini, folders) if given.what == "record" else compare(folders)


if __name__ == "__main__":
    sys.exit(main())
