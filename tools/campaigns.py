"""Drives the campaigns of docs/results/preregistration.yaml: `make campaigns`.

Each goes on where it was left, one after the other, in its own folder under --out. What a page needs is
then copied to docs/results/NAME; `make tables` writes the pages. A campaign whose results lie there
already is left alone, so that frozen numbers stay frozen. `make results` (--again) drives those too, in
folders of their own, and prints what moved; with --replace it puts the new results in their place.
"""

from __future__ import annotations

import argparse
import datetime
import json
import os
import platform
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

from moved import read_rows, what_moved
from result_grip import keep_delays
from result_tables import RESULTS, ROOT, plan
from skidpad.recording.fingerprint import fingerprint

KEPT = ("results.parquet", "campaign.json")
MOST = 1_000_000  # bytes of a description; a longer one repeats what the command says


def words_of(command: str, maps: Path | None) -> list[str] | None:
    """The command in words; None when it asks for somebody else's maps and there are none."""
    if "{maps}" not in command:
        return shlex.split(command)
    return None if maps is None else shlex.split(command.format(maps=maps))


def drive(name: str, words: list[str], out: Path, workers: int) -> Path | None:
    """Drive or finish one campaign; its results, None when it failed."""
    folder = out / name
    folder.parent.mkdir(parents=True, exist_ok=True)
    is_study = words[0] == "study"
    target = out / f"{name}.csv" if is_study else folder
    if is_study and target.is_file():
        return target
    call = [
        sys.executable,
        "-m",
        "skidpad",
        *words,
        "--workers",
        str(workers),
        "--out",
        str(target),
    ]
    call += [] if is_study else ["--resume"]
    print(f"{name}: skidpad {shlex.join(words)}", flush=True)
    done = subprocess.run(call, check=False, cwd=ROOT)
    return target if done.returncode == 0 else None


def freeze(name: str, target: Path) -> None:
    """Copy what pages are made of, and say what drove it."""
    folder = RESULTS / name
    part = folder.with_name(f"{name}.part")
    shutil.rmtree(part, ignore_errors=True)
    part.mkdir(parents=True)
    if target.is_file():
        shutil.copy(target, part / "rows.csv")
    else:
        for file in KEPT:
            if file == "results.parquet" or (target / file).stat().st_size <= MOST:
                shutil.copy(target / file, part / file)
        if (target / "series").is_dir():
            keep_delays(target, part)
    commit = subprocess.run(
        ["git", "describe", "--always"], check=True, capture_output=True, text=True, cwd=ROOT,
    ).stdout.strip()  # fmt: skip
    changed = ["git", "diff", "--quiet", "HEAD", "--", "src", "pyproject.toml"]
    commit += "-dirty" if subprocess.run(changed, check=False, cwd=ROOT).returncode else ""
    told = {
        "commit": commit,
        "date": datetime.datetime.now(datetime.timezone.utc).strftime("%Y-%m-%d"),
        "machine": f"{platform.machine()}, {os.cpu_count()} cores",
        "fingerprint": fingerprint().short,
    }
    (part / "driven.json").write_text(json.dumps(told, indent=1) + "\n", encoding="utf-8")
    shutil.rmtree(folder, ignore_errors=True)
    part.rename(folder)


def again(name: str, words: list[str], ask: argparse.Namespace) -> bool:
    """Drive a campaign whose results lie in docs/results and print what moved; False when it failed."""
    target = drive(name, words, ask.out / "again", ask.workers)
    if target is None:
        return False
    lines = what_moved(read_rows(RESULTS / name), read_rows(target))
    print(f"{name}: " + "\n".join(lines), flush=True)
    if ask.replace:
        freeze(name, target)
    return True


def main(arguments: list[str] | None = None) -> int:
    """Drive what is asked for; 1 when something failed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("names", nargs="*", help="campaigns; default: all")
    parser.add_argument("--out", type=Path, default=ROOT / "out" / "campaigns")
    parser.add_argument("--maps", type=Path, help="folder of OpenDRIVE files of somebody else")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--again", action="store_true", help="drive those with results too")
    parser.add_argument("--replace", action="store_true", help="and put the new results in place")
    parser.add_argument("--list", action="store_true", help="print the commands, drive nothing")
    ask = parser.parse_args(arguments)
    known = {c["name"]: c["command"] for c in plan()["campaigns"]}
    if unknown := [n for n in ask.names if n not in known]:
        parser.error(f"unknown campaign {unknown[0]!r}; known: {', '.join(known)}")
    failed = []
    for name in ask.names or known:
        words = words_of(known[name], ask.maps)
        if ask.list:
            print(f"{name}: skidpad {known[name]}")
        elif words is None:
            print(f"{name}: left out, it needs --maps DIR")
        elif (RESULTS / name).is_dir() and ask.again:
            if not again(name, words, ask):
                failed.append(name)
        elif (RESULTS / name).is_dir():
            print(f"{name}: frozen already in {RESULTS / name}")
        elif ask.again:
            print(f"{name}: not driven yet, `make campaigns` does")
        elif (target := drive(name, words, ask.out, ask.workers)) is None:
            failed.append(name)
        else:
            freeze(name, target)
    if failed:
        print(f"failed: {', '.join(failed)}; run again to go on", file=sys.stderr)
    return 1 if failed else 0


if __name__ == "__main__":
    raise SystemExit(main())
