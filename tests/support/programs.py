"""Programs of the system that some tests need: found here, or the test is skipped with its reason.

Debian keeps servers outside an ordinary PATH, so their folders are looked into as well. With
SKIDPAD_ONLY_PATH set they are not: CI hides all programs that way and expects skips only.
"""

from __future__ import annotations

import inspect
import os
import re
import shutil
from glob import glob

import pytest

FURTHER = ("/usr/sbin", "/usr/local/sbin", "/usr/lib/postgresql/*/bin")


def find_program(*names: str) -> str | None:
    """Returns the path of the first of these programs that is installed, or None."""
    further = () if os.environ.get("SKIDPAD_ONLY_PATH") else FURTHER
    folders = [folder for pattern in further for folder in sorted(glob(pattern), reverse=True)]
    path = os.pathsep.join([os.environ.get("PATH", ""), *folders])
    return next((found for name in names if (found := shutil.which(name, path=path))), None)


def require_program(name: str, package: str) -> str:
    """Returns the path of a program; skips the test when its Debian package is not installed."""
    found = find_program(name)
    if found is None:
        pytest.skip(f"{package} is not installed: no program {name}")
    return found


CALLS = re.compile(
    r"""require_program|mosquitto\(|postgresql|CHROMIUM|asam_python|asam_verdicts|"mount"|(?:run|Popen)\(\s*\[f?["']"""
)


def needs_program(item: pytest.Item) -> bool:
    """Returns whether a test, one of its fixtures or its marks asks for a program of the system.

    Read from the source, so that a test which calls a program without `find_program` is found too.
    """
    if not isinstance(item, pytest.Function):
        return False
    params = getattr(getattr(item, "callspec", None), "params", {})
    if any(isinstance(value, str) and value == "sqlite" for value in params.values()):
        return False
    if any("installed" in mark.kwargs.get("reason", "") for mark in item.iter_markers("skipif")):
        return True
    fixtures = item._fixtureinfo.name2fixturedefs.values()
    functions = [item.function, *(made[-1].func for made in fixtures)]
    return any(CALLS.search(_source(function)) for function in functions)


def _source(function: object) -> str:
    try:
        return inspect.getsource(function)
    except (OSError, TypeError):  # a fixture made by pytest itself
        return ""
