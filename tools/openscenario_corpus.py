"""Other people's OpenSCENARIO files: how many load, are clean, and play. Fetches nothing.

    python tools/openscenario_corpus.py FOLDER... [--maps DIR] [--ticks N] [--list]

Each folder inside FOLDER is one author. Prints a table per author and the elements that are missing
most. A file counts as valid when the published schema accepts it (before 1.0: when it can be read)
and its road and catalogs are there; a file that was seen before, under any author, counts once.
"""

from __future__ import annotations

import argparse
import time
import traceback
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from hashlib import sha256
from pathlib import Path

from skidpad.core.errors import SkidpadError
from skidpad.core.setup import DT
from skidpad.scenarios.playing.stage import play_ideal
from skidpad.scenarios.reading.document import Node, parse
from skidpad.scenarios.reading.findings import HARMLESS, Finding, Kind
from skidpad.scenarios.scenario import check

COLUMNS = (
    "files", "excluded", "copies", "others", "scenarios", "invalid", "lacking", "valid", "clean", "played",
    "more", "refused", "tracebacks",
)  # fmt: skip
ABSENT = (("LogicFile", "there is no road file"), ("CatalogReference", "there is no catalog"))


@dataclass
class Tally:
    """Counts of one author."""

    counts: Counter[str] = field(default_factory=Counter)
    missing: Counter[str] = field(default_factory=Counter)

    def share(self) -> float | None:
        """Of the valid files those that played."""
        valid = self.counts["valid"]
        return self.counts["played"] / valid if valid else None


class Corpus:
    """A look at many files, each content once."""

    def __init__(self, ticks: int, maps: Sequence[Path], without: Sequence[str]) -> None:
        self.ticks, self.maps, self.without = ticks, maps, without
        self.seen: set[str] = set()

    def look(self, file: Path, tally: Tally) -> list[str]:
        """Count one file; returns what is wrong with it."""
        count = tally.counts
        count["files"] += 1
        if any(letters in file.name for letters in self.without):
            count["excluded"] += 1
            return []
        try:
            root = parse(file)
        except SkidpadError as error:
            count["others"] += 1
            return [str(error)]
        if root.find("Storyboard") is None:
            count["others"] += 1  # catalogs and distributions
            return []
        text = content(root)
        if text in self.seen:
            count["copies"] += 1
            return []
        self.seen.add(text)
        count["scenarios"] += 1
        return self.checked(file, tally)

    def checked(self, file: Path, tally: Tally) -> list[str]:
        """Compile it, then play it."""
        count = tally.counts
        try:
            compiled = check(file, maps=self.maps)
        except SkidpadError as error:
            return [str(error)]
        except Exception:
            count["tracebacks"] += 1
            return [traceback.format_exc()]
        findings = compiled.findings
        serious = [f for f in findings if f.kind not in HARMLESS]
        invalid, lacks = any(map(breaks, findings)), lacking(serious)
        count["invalid"] += invalid
        count["lacking"] += lacks and not invalid
        valid = not invalid and not lacks
        count["valid"] += valid
        if valid:
            tally.missing.update({reason(f) for f in serious})
        if compiled.scenario is None:
            return [f"{'' if valid else 'not valid: '}{f}" for f in serious]
        count["clean"] += valid
        try:
            play_ideal(compiled.scenario, self.ticks * DT)
        except SkidpadError as error:
            count["refused"] += 1
            return [f"at run time: {error}"]
        except Exception:
            count["tracebacks"] += 1
            return [traceback.format_exc()]
        count["played" if valid else "more"] += 1
        return []


def content(root: Node) -> str:
    """A hash of its elements and attributes."""
    text = "".join(f"{e.tag}{sorted(e.attrib.items())}" for e in root.element.iter("*"))
    return sha256(text.encode()).hexdigest()


def breaks(finding: Finding) -> bool:
    """The schema is against it, or there is none of its version."""
    return finding.kind is Kind.SCHEMA or finding.element == "FileHeader"


def lacking(findings: Iterable[Finding]) -> bool:
    """Its road or a catalog did not come with it."""
    return any(f.element == e and f.what.startswith(w) for f in findings for e, w in ABSENT)


def reason(finding: Finding) -> str:
    """A finding without the names that differ from file to file."""
    words = [w for w in finding.what.split() if not any(c in w for c in "'\"0123456789")]
    return f"{finding.kind.value} <{finding.element}> {' '.join(words[:9])}"


def table(corpus: Corpus, authors: Iterable[Path], listed: bool) -> list[Tally]:
    """A line per author."""
    tallies = []
    print("| author |", " | ".join(COLUMNS), "| s |")
    print("|---|" + "---|" * (len(COLUMNS) + 1))
    for author in authors:
        tally, begin = Tally(), time.process_time()
        for file in sorted(author.rglob("*.xosc")):
            wrong = corpus.look(file, tally)
            for text in wrong if listed else ():
                print(f"{author.name}/{file.relative_to(author)}: {text}")
        tallies.append(tally)
        counts = " | ".join(str(tally.counts[c]) for c in COLUMNS)
        print(f"| {author.name} | {counts} | {time.process_time() - begin:.1f} |", flush=True)
    return tallies


def main() -> None:
    """The table, and what is missing most."""
    options = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    options.add_argument("folders", type=Path, nargs="+")
    options.add_argument("--ticks", type=int, default=400)
    options.add_argument("--maps", type=Path, action="append", default=[], help="folders of roads")
    options.add_argument(
        "--without", action="append", default=[], help="names with these letters are left out"
    )
    options.add_argument("--list", action="store_true", help="say what is wrong, file by file")
    given = options.parse_args()
    authors = [a for f in given.folders for a in sorted(f.iterdir()) if a.is_dir()]
    tallies = table(Corpus(given.ticks, given.maps, given.without), authors, given.list)
    sums: Counter[str] = sum((t.counts for t in tallies), Counter())
    print("| all |", " | ".join(str(sums[c]) for c in COLUMNS), "| |")
    shares = [share for t in tallies if (share := t.share()) is not None]
    if not shares:
        print("\nno file is valid")
        return
    print(f"\nplayed of valid: {sums['played'] / sums['valid']:.1%}; ", end="")
    print(f"each of {len(shares)} authors weighing the same: {sum(shares) / len(shares):.1%}")
    missing: Counter[str] = sum((t.missing for t in tallies), Counter())
    print("\nvalid files, and what keeps them from playing:")
    for text, count in missing.most_common(40):
        print(f"{count:5d}  {text}")


if __name__ == "__main__":
    main()
