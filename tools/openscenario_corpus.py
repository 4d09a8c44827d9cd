"""Other people's OpenSCENARIO files: how many load, are clean, and play. Fetches nothing.

    python tools/openscenario_corpus.py FOLDER [--maps DIR] [--ticks N] [--list]

Each folder inside FOLDER is one author. Prints a table per author and the elements that are missing
most. A file counts as valid when the published schema accepts it (before 1.0: when it can be read).
"""

from __future__ import annotations

import argparse
import time
import traceback
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from skidpad.core.errors import SkidpadError
from skidpad.core.setup import DT
from skidpad.scenarios.document import parse
from skidpad.scenarios.findings import HARMLESS, Finding, Kind
from skidpad.scenarios.scenario import check
from skidpad.scenarios.stage import played


@dataclass
class Tally:
    """Counts of one author."""

    files: int = 0
    others: int = 0  # catalogs, distributions and what is no XML
    scenarios: int = 0
    valid: int = 0  # by the schema
    clean: int = 0
    valid_clean: int = 0
    played: int = 0
    refused: int = 0  # at run time: must be 0
    tracebacks: int = 0  # must be 0
    missing: Counter[str] = field(default_factory=Counter)


def look(file: Path, tally: Tally, ticks: int, maps: Sequence[Path]) -> list[str]:
    """Count one file; returns what is wrong with it."""
    tally.files += 1
    try:
        root = parse(file)
    except SkidpadError as error:
        tally.others += 1
        return [str(error)]
    if root.find("Storyboard") is None:
        tally.others += 1
        return []
    tally.scenarios += 1
    try:
        compiled = check(file, maps=maps)
    except SkidpadError as error:
        return [str(error)]
    except Exception:
        tally.tracebacks += 1
        return [traceback.format_exc()]
    valid = not any(f.kind is Kind.SCHEMA for f in compiled.findings)
    tally.valid += valid
    serious = [f for f in compiled.findings if f.kind not in HARMLESS]
    tally.missing.update({reason(f) for f in serious})
    if compiled.scenario is None:
        return [str(f) for f in serious]
    tally.clean += 1
    tally.valid_clean += valid
    try:
        played(compiled.scenario, ticks * DT)
    except SkidpadError as error:
        tally.refused += 1
        return [f"at run time: {error}"]
    except Exception:
        tally.tracebacks += 1
        return [traceback.format_exc()]
    tally.played += 1
    return []


def reason(finding: Finding) -> str:
    """A finding without the names that differ from file to file."""
    words = [w for w in finding.what.split() if not any(c in w for c in "'\"0123456789")]
    return f"{finding.kind.value} <{finding.element}> {' '.join(words[:9])}"


def main() -> None:
    """The table."""
    options = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    options.add_argument("folder", type=Path)
    options.add_argument("--ticks", type=int, default=600)
    options.add_argument("--maps", type=Path, action="append", default=[], help="folders of roads")
    options.add_argument("--list", action="store_true", help="say what is wrong, file by file")
    given = options.parse_args()
    total = Counter[str]()
    columns = ("files", "others", "scenarios", "valid", "clean", "valid_clean", "played", "refused",
               "tracebacks")  # fmt: skip
    print("| author |", " | ".join(columns), "| s |")
    print("|---|" + "---|" * (len(columns) + 1))
    sums = Counter[str]()
    for author in sorted(p for p in given.folder.iterdir() if p.is_dir()):
        tally, begin = Tally(), time.perf_counter()
        for file in sorted(author.rglob("*.xosc")):
            wrong = look(file, tally, given.ticks, given.maps)
            if given.list:
                for text in wrong:
                    print(f"{file.relative_to(given.folder)}: {text}")
        total.update(tally.missing)
        sums.update({c: getattr(tally, c) for c in columns})
        counts = " | ".join(str(getattr(tally, c)) for c in columns)
        print(f"| {author.name} | {counts} | {time.perf_counter() - begin:.1f} |", flush=True)
    print("| all |", " | ".join(str(sums[c]) for c in columns), "| |")
    print("\nfiles, and what keeps them from playing:")
    for text, count in total.most_common(25):
        print(f"{count:5d}  {text}")


if __name__ == "__main__":
    main()
