"""Lists of scenario files of authors not used before: chosen once, then counted. Fetches nothing.

    python tools/unseen_files.py choose FOLDER... --known FOLDER... --list FILE.csv
    python tools/unseen_files.py count FILE.csv FOLDER... [--esmini DIR]

Each folder inside FOLDER is one repository, named OWNER+NAME, with its scenarios and roads. `choose`
takes the files that are valid (see openscenario_corpus) and whose content is not in `--known`, of
files whose names differ in numbers alone the first eight; it plays nothing. `count` plays the files of
a list, each for 20 s, and compares those that play with esmini, both without controllers.
"""

from __future__ import annotations

import argparse
import csv
import re
import subprocess
import sys
import traceback
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import replace
from math import isfinite
from pathlib import Path

ROOT = Path(__file__).parents[1]
sys.path[:0] = [str(ROOT / "tests"), str(ROOT / "tools")]

from openscenario_corpus import breaks, content, lacking  # noqa: E402
from scenario_oracle import LEAST_WAY, play_without_controllers, run_esmini  # noqa: E402
from skidpad.core.errors import SkidpadError  # noqa: E402
from skidpad.scenarios.playing.stage import play_ideal  # noqa: E402
from skidpad.scenarios.reading.document import parse  # noqa: E402
from skidpad.scenarios.reading.findings import HARMLESS  # noqa: E402
from skidpad.scenarios.scenario import check  # noqa: E402
from support.oracle.reference import Deviation, deviations, file_hash  # noqa: E402

STEP, END = 0.05, 20.0  # s
MOST = 60  # files of one repository
SERIES = 8  # of them, whose names differ in numbers alone
COLUMNS = ("repository", "path", "commit", "sha256")


def scenario_content(file: Path) -> str | None:
    """Returns a hash of a scenario's elements; None for what is no scenario."""
    try:
        root = parse(file)
    except SkidpadError:
        return None
    return None if root.find("Storyboard") is None else content(root)


def is_valid(file: Path, maps: Sequence[Path]) -> bool:
    """Tells whether the schema accepts a file and its road and catalogs are there."""
    try:
        findings = check(file, maps=maps).findings
        further = check(file, maps=maps, lenient=True).findings  # beyond what stops the reading
    except SkidpadError:
        return False
    except Exception:
        return True  # ours to mend, so it is counted
    serious = [f for f in (*findings, *further) if f.kind not in HARMLESS]
    return not any(map(breaks, findings)) and not lacking(serious) and not names_empty_road(file)


def names_empty_road(file: Path) -> bool:
    """Tells whether a file's road has no bytes, as where a stored copy leaves out large files."""
    logic = parse(file).find("RoadNetwork", "LogicFile")
    road = file.parent / (logic.element.get("filepath", "") if logic is not None else "")
    return road.is_file() and road.stat().st_size == 0


def road_folders(repository: Path, maps: Sequence[Path]) -> list[Path]:
    """Returns where the roads of a repository's files are looked for."""
    return [*sorted({road.parent for road in repository.rglob("*.xodr")}), *maps]


def choose(given: argparse.Namespace) -> None:
    """Writes the list."""
    seen = {scenario_content(f) for folder in given.known for f in folder.rglob("*.xosc")}
    listed = {r["sha256"] for table in given.listed for r in csv.DictReader(table.open())}
    rows = []
    repositories = [r for f in given.folders for r in sorted(f.iterdir())]
    for repository in repositories:
        chosen, maps = 0, road_folders(repository, given.maps)
        series: Counter[str] = Counter()
        commit = given.commits.get(repository.name, "")
        for file in sorted(repository.rglob("*.xosc")):
            text = scenario_content(file)
            if text is None or text in seen or file_hash(file) in listed:
                continue
            seen.add(text)
            name = re.sub(r"\d+", "", file.stem)
            if chosen < MOST and series[name] < SERIES and is_valid(file, maps):
                chosen += 1
                series[name] += 1
                rows.append((repository.name.replace("+", "/", 1),
                             file.relative_to(repository).as_posix(), commit, file_hash(file)))  # fmt: skip
        print(repository.name, chosen, flush=True)
    with given.list.open("w", newline="", encoding="utf-8") as out:
        csv.writer(out, lineterminator="\n").writerows([COLUMNS, *rows])
    print(f"{len(rows)} files of {len({r[0] for r in rows})} repositories")


def listed_files(table: Path, folders: Iterable[Path]) -> list[tuple[str, Path]]:
    """Returns the files of a list; exits where one is missing or another file."""
    places = [Path(f) for f in folders]
    found = []
    with table.open(encoding="utf-8") as rows:
        for row in csv.DictReader(rows):
            name = row["repository"].replace("/", "+", 1)
            file = next((f for p in places if (f := p / name / row["path"]).is_file()), None)
            if file is None or file_hash(file) != row["sha256"]:
                raise SystemExit(f"{row['repository']} {row['path']} is not there, or changed")
            found.append((row["repository"], file))
    return found


def folder_of(file: Path, folders: Iterable[Path]) -> Path:
    """Returns the folder of the repository that a file is of."""
    above = next(f for f in folders if file.is_relative_to(f))
    return above / file.relative_to(above).parts[0]


def play(file: Path, maps: Sequence[Path]) -> str:
    """Plays a file with its controllers; returns `played`, or what became of it after a colon."""
    try:
        compiled = check(file, maps=maps)
        if compiled.scenario is None:
            first = next(f for f in compiled.findings if f.kind not in HARMLESS)
            return f"refused: {first}"
        play_ideal(compiled.scenario, END, STEP)
    except SkidpadError as error:
        return f"failed: {str(error).splitlines()[0]}"
    except Exception:
        return f"traceback: {traceback.format_exc(limit=-1)}"
    return "played"


def beside_esmini(
    file: Path, maps: Sequence[Path], given: argparse.Namespace
) -> dict[str, Deviation] | None:
    """Returns how far each entity of a file is from esmini's; None where esmini does not play it.

    Both play the first 20 s without controllers.
    """
    try:
        reference = run_esmini(given.esmini, file, given.towns)
    except (RuntimeError, subprocess.SubprocessError, StopIteration, ValueError):
        return None
    states = {n: {t: s for t, s in e.items() if t <= END * 1000.0}
              for n, e in reference.entities.items()}  # fmt: skip
    try:
        told = play_without_controllers(file, END, maps)
    except SkidpadError as error:
        print(f"{file}: without controllers: {error}")
        return None
    return deviations(told, replace(reference, entities=states))


def count(given: argparse.Namespace) -> None:
    """Prints how many play, and how far their entities are from esmini's."""
    outcomes: Counter[str] = Counter()
    by_owner: dict[str, Counter[str]] = {}
    places: list[float] = []
    compared = 0
    for repository, file in listed_files(given.table, given.folders):
        if names_empty_road(file):
            outcomes["road missing"] += 1
            continue
        maps = road_folders(folder_of(file, given.folders), given.maps)
        outcome = play(file, maps)
        kind = outcome.partition(":")[0]
        print(f"{kind}: {repository} {file.name}", flush=True)
        outcomes[kind] += 1
        by_owner.setdefault(repository, Counter())[kind] += 1
        if kind != "played":
            print(f"{repository} {file.name}: {outcome}", flush=True)
            continue
        found = beside_esmini(file, maps, given) if given.esmini is not None else None
        if found is None:
            continue
        compared += 1
        for name, d in found.items():
            if d.way >= LEAST_WAY:
                places.append(d.place)
                if not d.place <= 0.1:
                    print(f"{repository} {file.name} {name}: {d.place:.2f} m from {d.since} s",
                          flush=True)  # fmt: skip
    missing = outcomes.pop("road missing", 0)
    total = sum(outcomes.values())
    for repository, counts in by_owner.items():
        print(f"| {repository} | {sum(counts.values())} | {counts['played']} |")
    print(f"played {outcomes['played']} of {total}; not valid, as their road is missing: {missing}")
    near = [p for p in places if isfinite(p)]
    shares = [sum(p <= b for p in near) / max(len(places), 1) for b in (0.1, 0.5, 2.0)]
    print(f"esmini plays {compared} of them; {len(places)} entities; within 0.1, 0.5, 2 m: "
          + ", ".join(f"{s:.1%}" for s in shares))  # fmt: skip


def main() -> None:
    """Runs the command."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("what", choices=("choose", "count"))
    parser.add_argument(
        "folders", nargs="+", type=Path, help="of repositories; count: the list first"
    )
    parser.add_argument("--known", type=Path, nargs="+", default=[])
    parser.add_argument("--listed", type=Path, nargs="+", default=[], help="earlier lists")
    parser.add_argument("--maps", type=Path, action="append", default=[])
    parser.add_argument("--commits", type=Path, help="lines of: OWNER+NAME COMMIT")
    parser.add_argument("--list", type=Path, default=Path("unseen.csv"))
    parser.add_argument("--esmini", type=Path)
    parser.add_argument(
        "--towns", type=Path, help="count: a folder of roads by bare name for esmini"
    )
    given = parser.parse_args()
    if given.what == "choose":
        lines = given.commits.read_text().splitlines() if given.commits else []
        given.commits = dict(line.split() for line in lines)
        choose(given)
    else:
        given.table, *given.folders = given.folders
        count(given)


if __name__ == "__main__":
    main()
