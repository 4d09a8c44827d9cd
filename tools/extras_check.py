"""Resolves the package with each extra alone on each Python, from wheels only, and prints a table.

    python tools/extras_check.py                # all extras; needs uv (pip install uv) and the index
    python tools/extras_check.py osi carla      # some of them
    python tools/extras_check.py --install osi  # installed and imported; Pythons of PATH and of pyenv
    python tools/extras_check.py --test osi     # and tested

Without `--install` nothing is installed: uv asks the index which versions have wheels for this platform and
the other Python. A cell is the number of distributions of the whole installation, base included; where a
requirement of the extra is left out by its marker, its name follows.

With it, the wheel and the one extra go into an empty environment, and every module of the package that the
extra allows is imported there: a cell says how many. `--test` then runs the quick tests that name a module
which the extra brings: a cell says how many passed.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from versions_check import IMPORT_ALL, MINORS, ROOT, copy_source, pythons

PROJECT = ROOT / "pyproject.toml"
BASE = ""  # no extra
TOOLS = ("pytest>=8", "hypothesis>=6.100", "pytest-xdist>=3.5")  # what tests themselves need
NO_TEST = 5  # what pytest returns when every test is deselected
MODULES_OF = """
import sys
from importlib.metadata import packages_distributions
for module, names in packages_distributions().items():
    if not module.startswith("_") and {n.lower().replace("_", "-") for n in names} & set(sys.argv[1:]):
        print(module)
"""
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


def files_that_ask(modules: Sequence[str], folder: Path = ROOT / "tests") -> list[str]:
    """Returns the files of tests that import one of the modules, or ask whether it is there."""
    if not modules:
        return []
    names = "|".join(map(re.escape, modules))
    is_asked = re.compile(rf'(?:import|from|importorskip\("|find_spec\(") ?(?:{names})\b')
    files = sorted(folder.rglob("test_*.py"))
    return [str(file) for file in files if is_asked.search(file.read_text(encoding="utf-8"))]


def install(
    extra: str, python: str, wheel: Path, named: Sequence[str], is_tested: bool
) -> tuple[bool, str]:
    """Installs the wheel with an extra alone, imports all of it, and tests it where asked."""
    alone = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "VIRTUAL_ENV")}
    with tempfile.TemporaryDirectory() as folder:
        own = str(Path(folder) / "bin" / "python")
        asked = f"{wheel}[{extra}]" if extra else str(wheel)
        put = ["uv", "pip", "install", "--quiet", "--no-build", "--python", own]
        steps = [
            ["uv", "venv", "--quiet", "--clear", "--python", python, folder],
            [*put, asked],
            ["uv", "pip", "check", "--quiet", "--python", own],
            [own, "-c", IMPORT_ALL],
        ]
        for step in steps:
            done = subprocess.run(
                step, cwd=folder, env=alone, capture_output=True, text=True, check=False
            )
            if done.returncode:
                return False, f"**no**: {' '.join((done.stdout + done.stderr).split())[-300:]}"
        if not is_tested:
            return True, done.stdout.split()[0]
        subprocess.run([*put, *TOOLS], cwd=folder, env=alone, check=True)
        asking = [own, "-c", MODULES_OF, *named]
        brought = subprocess.run(asking, capture_output=True, text=True, check=True).stdout.split()
        files = files_that_ask(brought)
        if not files:
            return True, "imported"
        call = [own, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-m", "not slow"]
        call += [
            "-o",
            "pythonpath=tools tests",
            "--hypothesis-profile",
            "quick",
            *files,
        ]  # the wheel, not src
        done = subprocess.run(
            call, cwd=ROOT, env=alone, capture_output=True, text=True, check=False
        )
        if done.returncode == NO_TEST:
            return True, "imported; its tests are slow"
        if done.returncode:
            print(done.stdout[-3000:], file=sys.stderr)
        lines = [line for line in done.stdout.splitlines() if " in " in line] or ["no test ran"]
        return done.returncode == 0, lines[-1].rpartition(" in ")[0].strip("= ")


def install_all(extras: dict[str, list[str]], chosen: Sequence[str], is_tested: bool) -> int:
    """Prints a row for each extra that is installed on each Python; returns 1 where one of them fails."""
    at_hand = pythons()
    print_head(minor_of(python) for python in at_hand)
    failed = False
    with tempfile.TemporaryDirectory() as folder:
        source = copy_source(Path(folder) / "source")
        building = ["uv", "build", "--quiet", "--wheel", "--out-dir", folder, str(source)]
        subprocess.run(building, check=True)
        (wheel,) = Path(folder).glob("skidpad-*.whl")
        for extra in chosen:
            done = [install(extra, python, wheel, extras[extra], is_tested) for python in at_hand]
            failed |= not all(ok for ok, _ in done)
            row = " | ".join(said for _, said in done)
            print(f"| {f'`{extra}`' if extra else 'none'} | {row} |", flush=True)
    return int(failed)


def minor_of(python: str) -> str:
    """Returns the version of an interpreter as 3.12."""
    ask = "import sys; print('{}.{}'.format(*sys.version_info))"
    done = subprocess.run([python, "-c", ask], capture_output=True, text=True, check=True)
    return done.stdout.strip()


def print_head(versions: Iterable[str]) -> None:
    """Prints the head of a table with a column for each version."""
    columns = list(versions)
    print(f"| extra | {' | '.join(columns)} |\n|---{'|---' * len(columns)}|", flush=True)


def main(words: list[str]) -> int:
    """Prints a row for each extra; returns 1 where one of them cannot be installed on one Python."""
    extras = {BASE: [], **extras_of(PROJECT.read_text(encoding="utf-8"))}
    options = {"--install", "--test"} & set(words)
    words = [word for word in words if word not in options]
    unknown = [word for word in words if word not in extras]
    if unknown:
        print(f"no extra of {PROJECT.name}: {', '.join(unknown)}", file=sys.stderr)
        return 2
    if options:
        return install_all(extras, words or list(extras), "--test" in options)
    print_head(f"3.{minor}" for minor in MINORS)
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
