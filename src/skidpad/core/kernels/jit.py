"""The decorators of compiled kernels, and where their machine code is kept.

Numba's cache notices an edit of the file that holds a kernel, not of the files whose kernels it
calls or whose constants it reads. So the machine code of a file is kept in a folder named after a
hash of that file, of what it imports from here, and so on through files that define kernels: an
edit gives fresh folders to all who may call the edited kernel, a stale callee can never be run
(decision X-10), and nothing else is compiled again.
"""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, NoReturn, TypeVar

import numba
from numba.core.caching import IndexDataCacheFile
from numba.core.registry import CPUDispatcher
from numba.experimental import structref

from skidpad.core.kernels.refcounts import LeanCompiler

F = TypeVar("F", bound=Callable[..., Any])
T = TypeVar("T")
PACKAGE = Path(__file__).resolve().parents[2]
KEPT_CACHES = 4  # of one file
KERNEL = re.compile(rb"@(inner_)?kernel\b")
IMPORT = re.compile(r"^ *from (\w+(?:\.\w+)*) import (\([^)]*\)|[^\n]*)", re.MULTILINE)


def kernel_hash(file: Path, root: Path = PACKAGE) -> str:
    """Returns a hash of `file` and of all files below `root` that its kernels may depend on."""
    reached, waiting = {file}, [file]
    while waiting:
        new = imported(waiting.pop(), root) - reached
        reached |= new
        waiting += [path for path in new if KERNEL.search(path.read_bytes())]
    digest = hashlib.sha256()
    for path in sorted(reached):
        digest.update(str(path.relative_to(root)).encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


@cache
def imported(file: Path, root: Path) -> frozenset[Path]:
    """Returns the files below `root` that `file` imports from."""
    found = set()
    for module, names in IMPORT.findall(file.read_text(encoding="utf-8")):
        package = root.parent.joinpath(*module.split("."))
        for path in (package, *(package / name for name in re.findall(r"\w+", names))):
            source = path.with_suffix(".py")
            if source.is_relative_to(root) and source.is_file():
                found.add(source)
    return frozenset(found)


def user_cache() -> Path:
    """Returns the folder for files of this user that can be made again."""
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA", Path.home() / "AppData" / "Local")) / "skidpad"
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches" / "skidpad"
    return Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "skidpad"


def kernel_cache() -> Path:
    """Returns the folder for machine code: one folder per file, in it one per hash."""
    return user_cache() / "kernels"


@cache
def _cache_of(file: Path) -> str:
    """Returns the folder for the kernels of `file`, made if need be; those of its oldest texts are removed.

    "" where nothing can be written: machine code is then not kept.
    """
    parent = kernel_cache() / ".".join(file.relative_to(PACKAGE).with_suffix("").parts)
    folder = parent / kernel_hash(file)
    try:
        kernel_cache().mkdir(parents=True, exist_ok=True)
        kernel_cache().chmod(0o700)  # whoever may write machine code here may run it as this user
        folder.mkdir(parents=True, exist_ok=True)
        os.utime(folder)
        by_age = sorted(parent.iterdir(), key=lambda p: p.stat().st_mtime, reverse=True)
        for old in by_age[KEPT_CACHES:]:
            shutil.rmtree(old, ignore_errors=True)
    except OSError:  # a read-only home: compile in memory, slower but right
        return ""
    return str(folder)


def is_kept(compiled: Any) -> bool:
    """Returns whether machine code of this kernel's present text is on the disk; then it only has to load."""
    code = compiled.py_func.__code__
    own = os.environ.get("NUMBA_CACHE_DIR")
    folder = Path(own or _cache_of(Path(code.co_filename).resolve()) or os.devnull)
    return folder.is_dir() and any(folder.rglob(f"*.{compiled.py_func.__name__}-*.nbi"))


def kernel(function: F) -> F:
    """Compiles with numba: cached on disk, without the GIL, and without fast-math.

    Fast-math would let results differ between processors (decision X-2), so no kernel has it.
    """
    return _compile(function)  # type: ignore[no-any-return]


def inner_kernel(function: F) -> F:
    """Compiles for other kernels alone: a call from Python raises TypeError.

    Without the wrappers through which Python calls, which take a fifth of the time to compile: the
    arrays of a named tuple are unpacked one by one. They become part of their callers: to hand a map's
    arrays on takes longer than most of them do.
    """
    compiled = _compile(function, no_cpython_wrapper=True, no_cfunc_wrapper=True, forceinline=True)
    compiled.__class__ = InnerKernel
    return compiled  # type: ignore[no-any-return]


class InnerKernel(CPUDispatcher):  # type: ignore[misc]
    """What has no way in from Python says so, where numba would follow a null pointer."""

    def __call__(self, *_args: object) -> NoReturn:
        """Raises TypeError: there is no way in from Python."""
        raise TypeError(f"{self.py_func.__qualname__} is for kernels alone; its .py_func is not")


def _compile(function: Callable[..., Any], **flags: bool) -> Any:
    """Returns the function compiled by numba, its machine code cached on disk."""
    if "NUMBA_CACHE_DIR" not in os.environ:  # numba's own variable: the user's word is final
        file = Path(function.__code__.co_filename).resolve()
        numba.config.CACHE_DIR = _cache_of(file) if file.is_relative_to(PACKAGE) else ""
    decorate = numba.njit(
        cache=True, nogil=True, error_model="numpy", pipeline_class=LeanCompiler, **flags
    )
    compiled = decorate(function)
    compiled._cache._cache_file.__class__ = SharedIndex
    return compiled


class SharedIndex(IndexDataCacheFile):  # type: ignore[misc]
    """The machine code of one kernel, kept by signature, for processes that compile it at once.

    Numba numbers the files of code. Two processes that save at once may then both write number 1, and
    the index names it for the signature of one while it holds the code of the other. Here a file is
    named after its signature, so at worst an entry of the index is lost, and compiled again.
    """

    def save(self, key: object, data: object) -> None:
        """Writes the code of a signature, then its entry in the index."""
        name = (
            f"{Path(self._index_name).stem}.{hashlib.sha256(self._dump(key)).hexdigest()[:16]}.nbc"
        )
        self._save_data(name, data)
        self._save_index(self._load_index() | {key: name})

    def _load_index(self) -> dict[Any, str]:
        """Returns the index; empty where it cannot be read by this version.

        Generic kernels such as `hold` are kept by their own text, for records of any file: numba would
        end with an AttributeError once such a record is renamed.
        """
        try:
            return dict(super()._load_index())
        except (AttributeError, ImportError):
            return {}


if TYPE_CHECKING:

    class Held(Generic[T]):
        """A named tuple of arrays behind one pointer; kernels read it as `value`.

        Every array that crosses into a kernel costs 0.2 us per call, so what is asked often and
        seldom replaced is held once: `hold` makes it, entry kernels take it.
        """

        value: T

        def __init__(self, value: T) -> None: ...

else:

    @structref.register
    class HeldType(numba.types.StructRef):
        """Numba's type of what is held."""

        def preprocess_fields(self, fields):
            """Plain types, no literals."""
            return tuple((name, numba.types.unliteral(kind)) for name, kind in fields)

    class Held(structref.StructRefProxy):
        """A named tuple of arrays behind one pointer; see above."""

        _numba_type_ = structref.StructRefProxy._type  # numba's is a property, asked at every call

        def __new__(cls, value):
            """Behind its pointer."""
            return structref.StructRefProxy.__new__(cls, value)

    structref.define_proxy(Held, HeldType, ["value"])


@kernel
def hold(value: T) -> Held[T]:
    """Returns a named tuple held for kernels; the arrays stay shared, so their changes are seen."""
    return Held(value)
