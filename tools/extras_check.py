"""Resolves the package with each extra alone on each Python, from wheels only, and prints a table.

    python tools/extras_check.py              # all extras; needs uv (pip install uv) and the package index
    python tools/extras_check.py osi carla    # some of them

Nothing is installed: uv asks the index which versions have wheels for this platform and the other Python.
A cell is the number of distributions of the whole installation, base included; where a requirement of the
extra is left out by its marker, its name follows.
"""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from versions_check import MINORS, ROOT

PROJECT = ROOT / "pyproject.toml"
BASE = ""  # no extra
AFTER_NAME = re.compile(r"[^A-Za-z0-9._-]")  # brackets, comparisons, markers


def extras_of(project: str) -> dict[str, list[str]]:
    """Returns the names of the distributions that each extra of a pyproject.toml asks for, by its name."""
    block = project.split("[project.optional-dependencies]\n")[1].split("\n[")[0]
    found = re.findall(r"^(\w+) = \[(.*?)\](?=$|  #|\n)", block, re.DOTALL | re.MULTILINE)
    return {
        name: [normalize(AFTER_NAME.split(text)[0]) for text in re.findall(r'"([^"]+)"', body)]
        for name, body in found
    }


def normalize(name: str) -> str:
    """Returns the name of a distribution as an index writes it."""
    return re.sub(r"[-_.]+", "-", name).lower()


def resolve(extra: str, minor: int, project: Path = PROJECT) -> subprocess.CompletedProcess[str]:
    """Asks the index for versions of everything that the package with this extra needs on Python 3.minor."""
    words = ["uv", "pip", "compile", "--quiet", "--no-header", "--no-annotate", "--no-build"]
    words += [
        "--python-version",
        f"3.{minor}",
        *(["--extra", extra] if extra else []),
        str(project),
    ]
    return subprocess.run(words, capture_output=True, text=True, check=False)


def describe(done: subprocess.CompletedProcess[str], named: Sequence[str]) -> str:
    """Returns the cell of a table: how many distributions, which are left out, or why there are none."""
    if done.returncode:
        reason = " ".join(line.strip() for line in done.stderr.splitlines())
        return f"**no**: {reason[-300:]}"
    got = {normalize(line.partition("==")[0]) for line in done.stdout.splitlines() if "==" in line}
    missing = [name for name in named if name not in got]
    return f"{len(got)}" + (f", without {', '.join(missing)}" if missing else "")


def main(words: list[str]) -> int:
    """Prints a row for each extra; returns 1 where one of them cannot be installed on one Python."""
    extras = {BASE: [], **extras_of(PROJECT.read_text(encoding="utf-8"))}
    unknown = [word for word in words if word not in extras]
    if unknown:
        print(f"no extra of {PROJECT.name}: {', '.join(unknown)}", file=sys.stderr)
        return 2
    print(
        f"| extra | {' | '.join(f'3.{minor}' for minor in MINORS)} |\n|---{'|---' * len(MINORS)}|"
    )
    failed = False
    with ThreadPoolExecutor(2) as pool:
        for extra in words or extras:
            asked = [pool.submit(resolve, extra, minor) for minor in MINORS]
            cells = [describe(one.result(), extras[extra]) for one in asked]
            failed |= any(one.result().returncode for one in asked)
            print(f"| {f'`{extra}`' if extra else 'none'} | {' | '.join(cells)} |", flush=True)
    return int(failed)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
