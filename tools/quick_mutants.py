"""Measures which faults `make test` notices of those that `make test-all` notices.

    python tools/quick_mutants.py                    # four mutants of each package, then the table
    python tools/quick_mutants.py --per-package 2
    python tools/quick_mutants.py --table            # the table of what is there
    python tools/quick_mutants.py --kernels          # its row of kernels alone

A mutant is one small change of one line of the package, drawn by seed. The quick tests are run with it:
those that import the changed module first, then the others of its package's folder in tests/. Where they
all pass, the slow ones of the same files follow. A test counts that fails again by itself with the change,
and passes without it.
A mutant that no test of these files notices says nothing about the share and is only counted.

Not drawn: texts, annotations, kernels and every file that kernels are compiled from, for which machine
code would be made anew. A test that hangs has noticed the change; a run that is cut off at its limit of
processor time has not. Mutants that are in OUT are not run again at the same commit. The
tree that is changed is a copy.

Kernels have a row of their own, which is not part of "all": their tests plant a fault of one bit into each
kernel that the compiled loop calls, and into the table of a story, and pass when it is found.
"""

from __future__ import annotations

import argparse
import csv
import os
import random
import re
import resource
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator, Sequence
from datetime import datetime, timezone
from functools import cache, partial
from pathlib import Path
from typing import Any

import dated_lines
from mutants import KERNEL, Mutant, find_mutants
from nightly import commit

ROOT = Path(__file__).resolve().parents[1]
TABLE = ROOT / "docs" / "results" / "quick-mutants.csv"
SEED = 28
TEST_S = {"quick": 90, "slow": 400}  # a test that takes longer hangs
RUN_S = {"quick": 90, "slow": 150}  # of processor time; six times as long by the clock
SUITES = {"quick": ("-m", "not slow", "--hypothesis-profile", "quick"), "slow": ("-m", "slow")}
IMPORT = re.compile(r"^ *from (skidpad(?:\.\w+)*) import (\([^)]*\)|[^\n]*)", re.MULTILINE)
PLANTED = ("tests/campaign/test_planted_faults.py", "tests/scenarios/test_story_table.py")
COLUMNS = ("package", "mutants", "quick", "full", "share", "date", "commit")


def list_files(root: Path) -> dict[str, list[Path]]:
    """Returns the files of each package that may be changed: no kernel depends on them."""
    package = root / "src" / "skidpad"
    files = {path for path in package.rglob("*.py") if "_pb2" not in path.name}
    waiting = [path for path in files if KERNEL.search(path.read_text(encoding="utf-8"))]
    compiled = set(waiting)
    while waiting:
        new = {p for p in _imports(waiting.pop(), package) if p not in compiled}
        compiled |= new
        waiting += [p for p in new if KERNEL.search(p.read_text(encoding="utf-8"))]
    free: dict[str, list[Path]] = {}
    for path in sorted(files - compiled):
        parts = path.relative_to(package).parts
        if len(parts) > 1:
            free.setdefault(parts[0], []).append(path)
    return free


def _imports(file: Path, package: Path) -> Iterator[Path]:
    """Yields the files of the package that a file imports from."""
    for module, names in IMPORT.findall(file.read_text(encoding="utf-8")):
        base = package.parent.joinpath(*module.split("."))
        for path in (base, *(base / name for name in re.findall(r"\w+", names))):
            if path.with_suffix(".py").is_file():
                yield path.with_suffix(".py")


def draw(root: Path, per_package: int) -> list[tuple[str, Path, Mutant]]:
    """Returns mutants with their packages and files, drawn by seed, in rounds over the packages."""
    drawn: list[list[tuple[str, Path, Mutant]]] = []
    for package, files in list_files(root).items():
        every = [
            (package, f, m) for f in files for m in find_mutants(f.read_text(encoding="utf-8"))
        ]
        random.Random(f"{SEED} {package}").shuffle(every)
        drawn.append(every[:per_package])
    return [row[k] for k in range(per_package) for row in drawn if k < len(row)]


def order_tests(root: Path, package: str, file: Path) -> list[str]:
    """Returns the test files for a changed file: those that import it, then its package's others."""
    name = ".".join(file.relative_to(root / "src").with_suffix("").parts)
    near = [f for f, modules in _imported_by_tests(root).items() if name in modules]
    others = [f for f in _imported_by_tests(root) if f.startswith(f"tests/{package}/")]
    inside = sorted(near, key=lambda f: (not f.startswith(f"tests/{package}/"), f))
    return [*inside, *(f for f in others if f not in near)]


@cache
def _imported_by_tests(root: Path) -> dict[str, set[str]]:
    """Returns the modules that each test file imports from, by path below the root."""
    src = root / "src"
    return {
        path.relative_to(root).as_posix(): {
            ".".join(f.relative_to(src).with_suffix("").parts)
            for f in _imports(path, src / "skidpad")
        }
        for path in sorted((root / "tests").rglob("test_*.py"))
    }


def run_tests(root: Path, suite: str, tests: Sequence[str]) -> str:
    """Returns the id of the first test that fails; "" when all pass, "limit" when time is over.

    Where pytest itself ends otherwise, a sentence says so, and nothing was noticed.
    """
    words = [
        "-m",
        "pytest",
        "-x",
        "-p",
        "no:cacheprovider",
        "-p",
        "quick_mutants",
        "-rfE",
        "--no-header",
    ]
    paths = (root / "src", root / "tools")
    environ = os.environ | {
        "PYTHONPATH": os.pathsep.join(map(str, paths)),
        "MUTANT_TEST_S": str(TEST_S[suite]),
        "PYTHONDONTWRITEBYTECODE": "1",
    }
    process = subprocess.Popen(
        [sys.executable, *words, *SUITES[suite], *tests],
        cwd=root, env=environ, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
        preexec_fn=partial(_limit_process, RUN_S[suite]),  # noqa: PLW1509 - no thread runs here
    )  # fmt: skip
    try:
        said, _ = process.communicate(timeout=6 * RUN_S[suite])
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        process.communicate()
        return "limit"
    if process.returncode in (-signal.SIGXCPU, -signal.SIGKILL):
        return "limit"
    if process.returncode in (0, 5):  # 5: nothing collected
        return ""
    failed = re.search(r"^(?:FAILED|ERROR) (\S+?(?:\[.*\])?)(?: - .*)?$", said, re.MULTILINE)
    return failed.group(1) if failed else f"pytest ended with {process.returncode}"


def _limit_process(seconds: int) -> None:
    """Gives a process a group of its own, which can be ended as a whole, and a limit of processor time."""
    os.setpgrp()
    resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds + 5))


def pytest_runtest_call() -> None:
    """Ends a test that hangs: this module is a plugin of the tests that it runs."""
    if limit := os.environ.get("MUTANT_TEST_S"):
        signal.signal(signal.SIGALRM, _end_test)
        signal.alarm(int(limit))


def pytest_runtest_teardown() -> None:
    """Stops the clock of a test."""
    signal.alarm(0)


def _end_test(_signal: int, _frame: object) -> None:
    raise TimeoutError("the test hangs")


@cache
def fails_unchanged(root: Path, suite: str, test: str) -> bool:
    """Returns whether a test fails without any change."""
    return run_tests(root, suite, (test,)) != ""


def judge(root: Path, package: str, file: Path, mutant: Mutant) -> dict[str, str]:
    """Returns what each suite noticed of a mutant: the test that failed, "" or "limit"."""
    tests, text = order_tests(root, package, file), file.read_text(encoding="utf-8")
    noticed = {"quick": "", "slow": ""}
    for suite in SUITES:
        left: tuple[str, ...] = ()
        while True:
            file.write_text(mutant.apply(text), encoding="utf-8")
            try:
                found = run_tests(root, suite, (*tests, *(f"--deselect={t}" for t in left)))
                is_sure = "::" not in found or run_tests(root, suite, (found,)) != ""
            finally:
                file.write_text(text, encoding="utf-8")
            if "::" not in found or (is_sure and not fails_unchanged(root, suite, found)):
                break
            left = (*left, found)
        noticed[suite] = found
        if is_noticed(found):
            break
    return noticed


def judge_kernels(root: Path) -> list[dict[str, str]]:
    """Returns for each planted fault of a kernel what `judge` says of a mutant."""
    listed = subprocess.run(
        [sys.executable, "-m", "pytest", "--collect-only", "-k", "planted_fault_of", *PLANTED],
        cwd=root, capture_output=True, text=True, check=True,
    ).stdout  # fmt: skip
    faults = [line for line in listed.splitlines() if "::" in line]
    return [
        {"quick": "" if run_tests(root, "quick", (fault,)) else fault, "slow": ""}
        for fault in faults
    ]


def is_noticed(found: str) -> bool:
    """Returns whether a suite noticed a mutant, from what `judge` says of it: a test, or a file."""
    return found.startswith("tests/")


def make_rows(judged: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Returns the table: a row per package and one for all."""
    rows = []
    for package in [*sorted({j["package"] for j in judged}), "all"]:
        own = [j for j in judged if package in (j["package"], "all")]
        quick = sum(is_noticed(j["quick"]) for j in own)
        full = sum(is_noticed(j["quick"]) or is_noticed(j["slow"]) for j in own)
        share = f"{quick / full:.3f}" if full else ""
        made = {"date": max(j["when"] for j in own)[:10], "commit": own[0]["commit"]}
        counts = (package, len(own), quick, full, share)
        rows.append(dict(zip(COLUMNS[:5], counts, strict=True)) | made)
    return rows


def read_table() -> list[dict[str, Any]]:
    """Returns the rows of the table that is there."""
    with TABLE.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def write_table(rows: Sequence[dict[str, Any]]) -> None:
    """Prints the table and writes it."""
    for row in rows:
        print(*row.values(), sep="\t")
    with TABLE.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


def copy_tree(folder: Path) -> Path:
    """Returns a copy of the committed tree in a folder, made anew."""
    root = folder / "tree"
    shutil.rmtree(root, ignore_errors=True)
    root.mkdir(parents=True)
    packed = subprocess.run(
        ["git", "-C", str(ROOT), "archive", "HEAD"], capture_output=True, check=True
    )
    subprocess.run(["tar", "-x", "-C", str(root)], input=packed.stdout, check=True)
    if (ROOT.parent / "shared").is_dir() and not (folder / "shared").exists():
        (folder / "shared").symlink_to(ROOT.parent / "shared")  # maps that some tests read
    return root


def main() -> None:
    """Draws and judges mutants, and writes the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--per-package", type=int, default=4)
    parser.add_argument("--out", type=Path, default=ROOT / "out" / "quick-mutants")
    parser.add_argument("--table", action="store_true", help="run nothing")
    parser.add_argument("--kernels", action="store_true", help="the row of kernels alone")
    asked = parser.parse_args()
    if asked.kernels:
        made = {
            "package": "kernels",
            "commit": commit(),
            "when": datetime.now(timezone.utc).isoformat(),
        }
        row = make_rows([{**made, **found} for found in judge_kernels(ROOT)])[0]
        write_table([*(r for r in read_table() if r["package"] != "kernels"), row])
        return
    asked.out.mkdir(parents=True, exist_ok=True)
    lines, version = asked.out / "mutants.jsonl", commit()
    there = [line for line in dated_lines.read(lines) if line["commit"] == version]
    known = {(line["file"], line["start"], line["new"]) for line in there}
    if not asked.table:
        root = copy_tree(asked.out)
        for package, file, mutant in draw(root, asked.per_package):
            name = file.relative_to(root / "src" / "skidpad").as_posix()
            if (name, mutant.start, mutant.new) in known:
                continue
            found = judge(root, package, file, mutant)
            place = {"package": package, "file": name, "line": mutant.line, "start": mutant.start}
            change = {"old": mutant.old, "new": mutant.new}
            dated_lines.add(lines, {"commit": version, **place, **change, **found})
    judged = [line for line in dated_lines.read(lines) if line["commit"] == version]
    if not judged:
        sys.exit("no mutant was judged at this commit")
    rows = make_rows(judged)
    write_table([*rows, *(r for r in read_table() if r["package"] == "kernels")])


if __name__ == "__main__":
    main()
