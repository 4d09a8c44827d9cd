"""Where machine code is kept: an edit of a callee reaches its callers, and nobody else."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from itertools import permutations
from pathlib import Path
from threading import Condition
from typing import Any

import pytest

from skidpad.core.kernels import jit
from skidpad.core.kernels.jit import imported, kernel_hash

FILES = {
    "low": "from house.jit import kernel\n@kernel\ndef f(x): return x",
    "middle": "from house.low import (\n    f,\n)\n@inner_kernel\ndef g(x): return f(x)",
    "high": "from house import middle\n@kernel\ndef h(x): return middle.g(x)",
    "other": "import numpy\n@kernel\ndef k(x): return x",
    "constants": "G = 9.81",
    "reader": "from house.constants import G\n@kernel\ndef r(x): return G * x",
}


@pytest.fixture
def house(tmp_path: Path) -> Path:
    root = tmp_path / "house"
    root.mkdir()
    for name, text in FILES.items():
        (root / f"{name}.py").write_text(text)
    return root


def hashes(root: Path) -> dict[str, str]:
    imported.cache_clear()
    return {name: kernel_hash(root / f"{name}.py", root) for name in FILES}


@jit.inner_kernel
def halved(x: float) -> float:
    return x / 2.0


@jit.kernel
def quartered(x: float) -> float:
    return halved(halved(x))


def test_only_kernels_call_an_inner_kernel() -> None:
    assert quartered(2.0) == 0.5
    with pytest.raises(TypeError, match="halved is for kernels alone"):
        halved(2.0)


@pytest.mark.parametrize(
    ("edited", "fresh"),
    [
        ("low", {"low", "middle", "high"}),
        ("constants", {"constants", "reader"}),
        ("middle", {"middle", "high"}),
        ("high", {"high"}),
        ("other", {"other"}),
    ],
)
def test_an_edit_reaches_those_who_may_call_it(house: Path, edited: str, fresh: set[str]) -> None:
    before = hashes(house)
    (house / f"{edited}.py").write_text(FILES[edited] + "\n# edited")
    after = hashes(house)
    assert {name for name in FILES if before[name] != after[name]} == fresh


@pytest.mark.parametrize("decorator", ["kernel", "inner_kernel"])
def test_an_edited_callee_is_compiled_into_its_caller(tmp_path: Path, decorator: str) -> None:
    """The real decorator over two files, in processes of their own."""
    root = tmp_path / "skidpad"
    kernels = root / "core" / "kernels"
    kernels.mkdir(parents=True)
    for package in (root, root / "core", kernels):
        (package / "__init__.py").touch()
    source = Path(sys.modules["skidpad.core.kernels.jit"].__file__ or "")
    for name in ("jit.py", "refcounts.py"):
        (kernels / name).write_bytes((source.parent / name).read_bytes())
    head = "from skidpad.core.kernels.jit import inner_kernel, kernel\n"
    caller = head + "from skidpad.callee import f\n@kernel\ndef g(x):\n    return f(x)\n"
    (root / "caller.py").write_text(caller)

    def answer(body: str) -> str:
        (root / "callee.py").write_text(f"{head}@{decorator}\ndef f(x):\n    return {body}\n")
        code = "from skidpad.caller import g; print(g(2.0), sum(g.stats.cache_hits.values()))"
        env = {k: v for k, v in os.environ.items() if k != "NUMBA_CACHE_DIR"}
        env |= {"PYTHONPATH": str(tmp_path), "XDG_CACHE_HOME": str(tmp_path / "cache")}
        done = subprocess.run(
            [sys.executable, "-c", code], env=env, capture_output=True, text=True, check=True
        )
        return done.stdout.strip()

    assert answer("x + 1.0") == "3.0 0"
    assert answer("x + 1.0") == "3.0 1"
    assert answer("x + 5.0") == "7.0 0"


def test_nobody_else_may_write_into_the_cache(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    before = os.umask(0)
    try:
        folder = Path(jit._cache_of.__wrapped__(Path(jit.__file__).resolve()))
    finally:
        os.umask(before)
    assert folder.is_dir()
    assert jit.kernel_cache().stat().st_mode & 0o777 == 0o700


RECORD = """
from typing import NamedTuple
import numpy as np
class {name}(NamedTuple):
    x: np.ndarray
"""
USER = """
import sys; sys.path.insert(0, {folder!r})
import numpy as np
from skidpad.core.kernels.jit import hold
from record import {name}
assert hold({name}(np.ones(3))) is not None
"""


def test_a_record_that_was_renamed_does_not_break_the_kept_code_of_others(tmp_path: Path) -> None:
    """`hold` is kept by its own text while the types of its callers change."""
    for name in ("Before", "After"):
        (tmp_path / "record.py").write_text(RECORD.format(name=name))
        text = USER.format(folder=str(tmp_path), name=name)
        done = subprocess.run(
            [sys.executable, "-c", text], capture_output=True, text=True, check=False,
            env=os.environ | {"XDG_CACHE_HOME": str(tmp_path / "cache")},
        )  # fmt: skip
        assert done.returncode == 0, done.stderr


class InTurns(jit.SharedIndex):
    """A writer whose every access to the disk waits for its turn in `order`, a list of names."""

    def __init__(self, folder: Path, name: str, order: list[str], turn: Condition) -> None:
        super().__init__(str(folder), "hold-1.py311", "stamp")
        self.name, self.order, self.turn = name, order, turn

    def in_turn(self, access: Callable[..., Any], *arguments: object) -> Any:
        with self.turn:
            assert self.turn.wait_for(lambda: self.order[:1] == [self.name], timeout=10)
            try:
                return access(*arguments)
            finally:
                self.order.pop(0)
                self.turn.notify_all()

    def _load_index(self) -> Any:
        return self.in_turn(super()._load_index)

    def _save_index(self, overloads: Any) -> None:
        self.in_turn(super()._save_index, overloads)

    def _save_data(self, name: str, data: object) -> None:
        self.in_turn(super()._save_data, name, data)


ORDERS = ["".join(order) for order in sorted(set(permutations("AAABBB")))]


@pytest.mark.parametrize("order", ORDERS)
def test_two_processes_that_compile_at_once_do_not_mix_their_code(
    tmp_path: Path, order: str
) -> None:
    """What is kept for a signature is its machine code, however two writers take turns.

    It ended in a segmentation fault, or in numbers of no meaning, once in a few hours of tests.
    """
    turns, turn = list(order), Condition()
    with ThreadPoolExecutor(2) as pool:
        for name in "AB":
            writer = InTurns(tmp_path, name, turns, turn)
            pool.submit(writer.save, f"signature of {name}", f"code of {name}")
    assert not turns
    kept = jit.SharedIndex(str(tmp_path), "hold-1.py311", "stamp")
    found = [kept.load(f"signature of {name}") for name in "AB"]
    assert found[0] in ("code of A", None), "None: lost, to be compiled again"
    assert found[1] in ("code of B", None)
    assert any(found)
