"""Runs the console and Python blocks of README and docs, as a reader would who types them.

    python tools/docs_run.py                 # all pages in full; writes docs/results/docs-run.csv
    python tools/docs_run.py README.md       # one page, nothing written

A comment before a block says how it is run:

    <!-- quick: --seeds 24 => --seeds 1; --duration 60 => --duration 2 -->   in CI with smaller values
    <!-- not run: needs Docker -->                                           never, and why

Blocks of one page share a folder and run in order. Lines without `$` are what the commands print; a
block with a title is a file of that name. `pip install ./NAME` installs a package of the page, without
network, into a folder of its own. docs/extending.md is run by tests of its own.
"""

from __future__ import annotations

import csv
import os
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from configparser import ConfigParser
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime, timezone
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
RECORD = ROOT / "docs" / "results" / "docs-run.csv"
COLUMNS = ("page", "block", "begins", "processor_s", "date", "commit")
BLOCK = re.compile(
    r"(?:^<!-- (?P<word>quick|not run): (?P<note>[^\n]*?) -->\n\s*)?"
    r"^```(?:(?P<language>console|python)|\w+(?= title=))(?: title=\"(?P<title>[\w./-]+)\")?\n"
    r"(?P<text>.*?)^```",
    re.DOTALL | re.MULTILINE,
)
ELSEWHERE = ("extending.md",)
INSTALL = re.compile(r"^\$ pip install \./([\w-]+)$", re.MULTILINE)  # a package that the page holds
PACKAGES = "packages"  # folder that such packages are installed to
ENTRY_POINTS = 'project.entry-points."'
SET_UP = re.compile(r"^(make run|source |pip install)")  # what the environment has been through
LONGEST_S = 3600.0


@dataclass(frozen=True)
class Block:
    """One block of a page: its text, and what the comment before it says."""

    page: str
    number: int
    language: str
    text: str
    word: str | None
    note: str
    title: str = ""  # of a file that the block holds

    @property
    def is_run(self) -> bool:
        """Whether it is run at all."""
        return self.word != "not run"

    def script(self, quick: bool) -> tuple[str, list[str]]:
        """Return what is run, and lines that it must print."""
        text = self.text
        for change in self.note.split(";") if quick and self.word == "quick" else ():
            old, new = (part.strip() for part in change.split("=>"))
            if old not in text:
                raise ValueError(f"{self.page}, block {self.number}: there is no {old!r} to change")
            text = text.replace(old, new)
        if self.language != "console":
            return text, []
        return split_console(text)


def split_console(text: str) -> tuple[str, list[str]]:
    """Return the commands of a console block as one script, and the lines printed beside them."""
    commands: list[str] = []
    printed: list[str] = []
    goes_on = False
    for line in text.splitlines():
        if line.startswith("$ ") or goes_on:
            command = line.removeprefix("$ ")
            goes_on = command.endswith("\\")
            commands.append(command)
        elif line.strip():
            printed.append(line.rstrip())
    script = "\n".join(c for c in commands if not SET_UP.match(c))
    return script, printed


def pages() -> list[Path]:
    """Return README and the pages of docs/ whose blocks are run here."""
    docs = sorted((ROOT / "docs").rglob("*.md"))
    return [ROOT / "README.md", *(p for p in docs if not any(e in str(p) for e in ELSEWHERE))]


def blocks_of(page: Path) -> Iterator[Block]:
    """Yield the console and Python blocks of a page, and the files that it holds, in order."""
    text = page.read_text(encoding="utf-8")
    for number, found in enumerate(BLOCK.finditer(text), start=1):
        yield Block(
            page.relative_to(ROOT).as_posix(), number,
            found["language"] or "", found["text"], found["word"], found["note"] or "",
            found["title"] or "",
        )  # fmt: skip


def run_block(block: Block, folder: Path, quick: bool) -> float:
    """Run a block in a folder and return the seconds of processor time.

    Raises:
        RuntimeError: it failed, or did not print what the page says.
    """
    script, printed = block.script(quick)
    if block.title:
        (folder / block.title).parent.mkdir(parents=True, exist_ok=True)
        (folder / block.title).write_text(script, encoding="utf-8")
    for name in INSTALL.findall(block.text) if block.language == "console" else ():
        install(folder / name, folder / PACKAGES)
    if block.title or not script.strip():
        return 0.0
    if block.language == "python":
        name = "test_block.py" if "def test_" in script else "block.py"
        (folder / name).write_text(script, encoding="utf-8")
        words = [sys.executable, *(("-m", "pytest", "-q") if name.startswith("test") else ()), name]
    else:
        words = ["bash", "-e", "-o", "pipefail", "-c", script]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    code, said = call(words, folder)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    missing = [line for line in printed if line not in said]
    if code or missing:
        raise RuntimeError(
            f"{block.page}, block {block.number} ended with code {code}; not printed: {missing}\n"
            f"{script}\n{said[-3000:]}"
        )
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def call(words: list[str], folder: Path) -> tuple[int, str]:
    """Run a command, end what it left running, and return its code and what it printed."""
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")])
    python = os.pathsep.join(filter(None, [os.environ.get("PYTHONPATH"), str(folder / PACKAGES)]))
    environment = {**os.environ, "PATH": path, "PYTHONPATH": python, "COLUMNS": "120"}
    with (folder / "said.txt").open("w+", encoding="utf-8") as said:
        process = subprocess.Popen(
            words, cwd=folder, env=environment, stdout=said, stderr=subprocess.STDOUT,
            stdin=subprocess.DEVNULL, start_new_session=True,
        )  # fmt: skip
        try:
            code = process.wait(LONGEST_S)
        finally:
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGTERM)
        said.seek(0)
        return code, said.read()


def install(package: Path, packages: Path) -> None:
    """Installs a package into a folder by pip, without network.

    The setuptools that Python 3.11 brings along cannot build alone; there it is unpacked instead.
    """
    if not has_builder():
        unpack(package, packages)
        return
    options = ("--no-index", "--no-build-isolation", "--no-deps", "--disable-pip-version-check")
    words = ["pip", "install", "-q", *options, "--upgrade", "--target", str(packages), str(package)]
    subprocess.run([sys.executable, "-m", *words], check=True)


def has_builder() -> bool:
    """Tells whether setuptools is there and can build a wheel."""
    try:
        import_module("setuptools.command.bdist_wheel")  # since setuptools 70.1
    except ImportError:
        return find_spec("setuptools") is not None and find_spec("wheel") is not None
    return True


def unpack(package: Path, packages: Path) -> None:
    """Installs a package of plain modules as pip does.

    Modules are copied, and names, version and entry points go into a .dist-info folder.
    """
    toml = ConfigParser()
    toml.read(package / "pyproject.toml", encoding="utf-8")
    name, version = (toml["project"][key].strip('"') for key in ("name", "version"))
    about = packages / f"{name.replace('-', '_')}-{version}.dist-info"
    about.mkdir(parents=True)
    for module in package.glob("*.py"):
        (packages / module.name).write_bytes(module.read_bytes())
    (about / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n")
    lines = []
    for section in toml.sections():
        if section.startswith(ENTRY_POINTS):
            lines.append(f"[{section[len(ENTRY_POINTS) : -1]}]")
            lines += [f"{key} = {value[1:-1]}" for key, value in toml[section].items()]
    (about / "entry_points.txt").write_text("\n".join(lines) + "\n")


def prepare(folder: Path) -> None:
    """Lay out what a reader's folder has: the examples of a clone."""
    shutil.copytree(ROOT / "examples", folder / "examples", dirs_exist_ok=True)


def main(names: list[str]) -> int:
    """Run pages in full; 1 when a block does not do what its page says."""
    commit = subprocess.run(
        ["git", "rev-parse", "--short", "HEAD"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    ).stdout.strip()
    day = f"{datetime.now(timezone.utc):%Y-%m-%d}"
    rows, failed = [], 0
    for page in [ROOT / name for name in names] or pages():
        with tempfile.TemporaryDirectory() as name:
            prepare(Path(name))
            for block in blocks_of(page):
                if not block.is_run:
                    print(f"{block.page}, block {block.number}: not run, {block.note}")
                    continue
                try:
                    seconds = run_block(block, Path(name), quick=False)
                except RuntimeError as error:
                    failed += 1
                    print(error)
                    continue
                begins = block.text.strip().splitlines()[0]
                print(f"{block.page}, block {block.number}: {seconds:.0f} s", flush=True)
                rows.append((block.page, block.number, begins, f"{seconds:.0f}", day, commit))
    if not names and not failed:
        with RECORD.open("w", newline="", encoding="utf-8") as stream:
            csv.writer(stream, lineterminator="\n").writerows([COLUMNS, *rows])
    return int(failed > 0)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
