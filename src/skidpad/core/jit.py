"""The one decorator for compiled kernels, and where their machine code is kept.

Numba's cache notices an edit of the file that holds a kernel, not of the files whose kernels it
calls. So the cache folder is named after a hash of every source file that defines kernels: any
edit gives a fresh folder, and a stale callee can never be run (decision X-10).
"""

from __future__ import annotations

import hashlib
import os
import shutil
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

F = TypeVar("F", bound=Callable[..., Any])
PACKAGE = Path(__file__).resolve().parents[1]
KEPT_CACHES = 4


def kernel_source_hash(root: Path = PACKAGE) -> str:
    """Hash of the text of all files below `root` that define kernels."""
    digest = hashlib.sha256()
    for path in sorted(root.rglob("*.py")):
        text = path.read_bytes()
        if b"@kernel" in text:
            digest.update(str(path.relative_to(root)).encode())
            digest.update(text)
    return digest.hexdigest()[:16]


def user_cache() -> Path:
    """Where files of this user that can be made again are kept."""
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA", Path.home() / "AppData" / "Local")) / "skidpad"
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches" / "skidpad"
    return Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "skidpad"


def _choose_cache() -> None:
    if "NUMBA_CACHE_DIR" in os.environ:  # numba's own variable: the user's word is final
        return
    parent = user_cache() / "kernels"
    folder = parent / kernel_source_hash()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        os.utime(folder)
        by_age = sorted(parent.iterdir(), key=lambda p: p.stat().st_mtime, reverse=True)
        for old in by_age[KEPT_CACHES:]:
            shutil.rmtree(old, ignore_errors=True)
    except OSError:  # a read-only home: compile in memory, slower but right
        return
    os.environ["NUMBA_CACHE_DIR"] = str(folder)


_choose_cache()

import numba

numba.config.CACHE_DIR = os.environ.get("NUMBA_CACHE_DIR", numba.config.CACHE_DIR)


def kernel(function: F) -> F:
    """Compile with numba: cached on disk, without the GIL, and without fast-math.

    Fast-math would let results differ between processors (decision X-2), so no kernel has it.
    """
    return numba.njit(cache=True, nogil=True, error_model="numpy")(function)  # type: ignore[no-any-return]
