"""Files of others are counted with their controllers, and compared with esmini without them."""

from __future__ import annotations

import csv
from argparse import Namespace

import scenario_oracle as oracle
import unseen_files
from skidpad.scenarios.playing.stage import play_ideal
from skidpad.scenarios.scenario import compile_scenario
from support.oracle.reference import Reference, State, file_hash
from support.scenarios.files import (
    ACTIVATE,
    at,
    init,
    on_lane,
    speed,
    teleport,
    to,
    vehicle,
    with_controller,
    write,
)


def test_both_sides_of_the_comparison_play_without_controllers(tmp_path, monkeypatch, capsys):
    """`other` keeps its 10 m/s without its ACC, as in esmini; with it, it follows the car ahead at 4 m/s."""
    folder = tmp_path / "somebody+files"
    folder.mkdir()
    begins = init("other", teleport(on_lane(-1, 100)), speed(to(10)), ACTIVATE)
    file = write(
        folder,
        entities=vehicle("ego") + with_controller("ACC", setSpeed=20) + vehicle("third"),
        init=at("ego", -3, 100) + begins + at("third", -1, 130, 4),
        end=10.0,
    )
    start = play_ideal(compile_scenario(file), 0.0, oracle.STEP).of("other")[0]
    straight = {k * 200: State(start.x + 2.0 * k, start.y, start.h, 10.0) for k in range(51)}
    reference = Reference("esmini", oracle.OPTIONS, file_hash(file), {"other": straight})
    monkeypatch.setattr(unseen_files, "run_esmini", lambda *_: reference)
    table = tmp_path / "list.csv"
    with table.open("w", newline="") as out:
        rows = csv.writer(out)
        rows.writerow(unseen_files.COLUMNS)
        rows.writerow(("somebody/files", file.name, "0" * 40, file_hash(file)))

    unseen_files.count(
        Namespace(table=table, folders=[tmp_path], maps=[], esmini=tmp_path, towns=None)
    )

    last = capsys.readouterr().out.splitlines()[-1]
    assert (
        last == "esmini plays 1 of them; 1 entities; within 0.1, 0.5, 2 m: 100.0%, 100.0%, 100.0%"
    )
