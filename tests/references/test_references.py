"""Reference recordings: drives whose logged columns may change only in a commit that says why.

Compared on every machine (decision R-2): floats within 1e-9 of their value (2.4e-7 for those logged
with 32 bit, two steps of such a float; 1e-9 and 1e-6 of the unit near zero), integers, enums, texts
and numbers of rows exactly. At an equal fingerprint all rows must give the stored content hash.

Chaos begins at the first contact: which of two bodies yields depends on the last bit. Elsewhere than
at an equal fingerprint a drive with a contact is therefore compared up to that tick, and the tick
itself must be equal; its later ticks and its events are not compared.

Measured (numba 0.66, NumPy 2.4, x86-64): machine code for a generic processor
(NUMBA_CPU_NAME=generic) gives the same bytes in every drive, as kernels have no fast-math.

`make refs` writes the stored drives anew and prints what moved, from which row on, and by how much.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from skidpad.recording.fingerprint import fingerprint
from support.references.columns import STRIDE, Columns, changes, digest, first_contact, sampled
from support.references.drives import DRIVES

STORE = Path(__file__).with_name("stored")


@pytest.mark.parametrize("name", DRIVES)
def test_the_drive_is_the_recorded_one(
    name: str, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    if name == "carla":
        pytest.importorskip("carla", reason="a reference needs the client: carla is not installed")
    file = STORE / f"{name.replace(', ', '-').replace(' ', '-')}.npz"
    now = DRIVES[name](tmp_path)
    if request.config.getoption("--rewrite-references"):
        moved = told(read(file)[1], now) if file.exists() else "new"
        print(f"\n{name}: {moved or 'nothing moved'}")
        write(file, now)
        return
    head, stored = read(file)
    if head["fingerprint"] == fingerprint().short:
        if digest(now) != head["hash"]:
            moved = told(stored, now) or "by less than the tolerances, or between stored rows"
            pytest.fail(f"{name} moved: {moved}")
        return
    contact = head["contact"] or float("inf")
    assert first_contact(now) == contact
    moved = told(stored, now, contact)
    assert not moved, f"{name} moved: {moved}"


def told(stored: Columns, now: Columns, contact: float = float("inf")) -> str:
    return "".join(f"\n  {change}" for change in changes(stored, now, contact))


def write(file: Path, columns: Columns) -> None:
    contact = first_contact(columns)
    head = {
        "fingerprint": fingerprint().short,
        "hash": digest(columns),
        "contact": contact if contact < float("inf") else None,
    }
    file.parent.mkdir(exist_ok=True)
    np.savez_compressed(file, head=np.array(json.dumps(head)), **sampled(columns))


def read(file: Path) -> tuple[dict[str, Any], Columns]:
    with np.load(file) as stored:
        columns = dict(stored)
    return json.loads(str(columns.pop("head"))), columns


def test_a_moved_column_is_told_with_its_first_row_and_largest_change() -> None:
    rows = np.arange(100.0)
    stored = {"ticks/v": rows[::STRIDE], "ticks/tier": np.zeros(100, np.int64)}
    now = {"ticks/v": rows * (1.0 + 1e-12), "ticks/tier": np.zeros(100, np.int64)}
    assert told(stored, now) == ""
    now["ticks/v"] = rows + 0.5 * (rows > 30)
    now["ticks/tier"][42] = 3
    assert told(stored, now).split("\n  ")[1:] == [
        "ticks/tier from row 42 on by at most 3",
        "ticks/v from row 38 on by at most 0.5",
    ]
    assert told(stored, now, contact=30.0) == ""
    del now["ticks/v"]
    assert "ticks/v (gone)" in told(stored, now)
    assert "80 stored rows" in told({"k": np.zeros(100, np.int64)}, {"k": np.zeros(80, np.int64)})
