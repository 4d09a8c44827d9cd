"""Tries the package with the newest versions that it allows on the newest Python, the oldest on the oldest.

    python tools/versions_check.py            # both, each in an empty environment of its own
    python tools/versions_check.py oldest     # one of them

Every module is imported, which reads presets and the types of maps; then commands load a map and print help.
Parts that need an extra are passed over where it is missing. Pythons are looked for on PATH and among
those of pyenv.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
MINORS = (10, 11, 12, 13)
IMPORT_ALL = """
import importlib, pkgutil
import skidpad
from skidpad.core.errors import MissingExtra
count, failed = 0, []
for module in pkgutil.walk_packages(skidpad.__path__, "skidpad."):
    if module.name.endswith("__main__") or ".migrations." in module.name:  # alembic runs the latter
        continue
    try:
        importlib.import_module(module.name)
        count += 1
    except (ModuleNotFoundError, MissingExtra) as error:
        if (getattr(error, "name", "") or "").startswith("skidpad"):
            failed.append(f"{module.name}: {error}")
    except Exception as error:
        failed.append(f"{module.name}: {error!r}")
print(*failed, f"{count} modules imported", sep="\\n")
raise SystemExit(bool(failed) or count < 500)
"""


def oldest_versions(project: str) -> list[str]:
    """The constraints that pin every dependency of a pyproject.toml to the least version that it allows."""
    (block,) = re.findall(r"^dependencies = \[\n(.*?)^\]", project, re.DOTALL | re.MULTILINE)
    found = re.findall(r'^ *"([\w-]+)>=([\d.]+)",$', block, re.MULTILINE)
    return [f"{name}=={least}" for name, least in found]


def pythons() -> list[str]:
    """Interpreters of the versions that the project takes, one of each, the oldest first."""
    found = []
    for minor in MINORS:
        ours = Path.home().glob(f".pyenv/versions/3.{minor}.*/bin/python")
        for python in (shutil.which(f"python3.{minor}"), *map(str, sorted(ours))):
            if python and _can_make_environments(python, minor):
                found.append(python)
                break
    return found


def _can_make_environments(python: str, minor: int) -> bool:
    """Whether it is that version and has what an environment needs."""
    ask = f"import sys, venv, ensurepip; sys.exit(sys.version_info[:2] != (3, {minor}))"
    return subprocess.run([python, "-c", ask], capture_output=True, check=False).returncode == 0


def copy_source(place: Path) -> Path:
    """Copy what git knows, so that building leaves nothing here; returns the folder."""
    listed = subprocess.run(
        ["git", "-C", str(ROOT), "ls-files", "-z"], capture_output=True, text=True, check=True
    ).stdout
    for name in filter(None, listed.split("\0")):
        (place / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(ROOT / name, place / name)
    return place


def try_versions(python: str, place: Path, source: Path, *options: str) -> bool:
    """Install the package into an empty environment, import all of it, load a map, print help."""
    subprocess.run([python, "-m", "venv", str(place)], check=True)
    own = str(place / "bin" / "python")
    install = [own, "-m", "pip", "install", "--quiet", "--prefer-binary", *options, str(source)]
    subprocess.run(install, check=True)
    calls = (
        [own, "-c", IMPORT_ALL],
        [own, "-m", "skidpad", "map", "info", "figure8"],
        [own, "-m", "skidpad", "adas", "--help"],
    )
    alone = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"}
    done = [subprocess.run(call, cwd=place, env=alone, check=False).returncode for call in calls]
    return not any(done)


def main(words: list[str]) -> int:
    """Returns 1 where one of the two did not work."""
    at_hand = pythons()
    failed = []
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        source = copy_source(place / "source")
        least = place / "oldest.txt"
        project = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
        least.write_text("\n".join(oldest_versions(project)), encoding="utf-8")
        plans = {
            "oldest": (at_hand[0], ["--constraint", str(least)]),
            "newest": (at_hand[-1], ["--upgrade"]),
        }
        for name in words or plans:
            python, options = plans[name]
            print(f"{name} versions on {python}", flush=True)
            if not try_versions(python, place / name, source, *options):
                failed.append(name)
    print(f"failed: {', '.join(failed)}" if failed else "oldest and newest versions work")
    return int(bool(failed))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
