"""Coverage of the intervals of `skidpad risk` in the simulator: pieces, resuming and the table."""

from math import inf

import msgspec
import pytest

import risk_coverage as coverage
from risk_coverage import Block, Ends, Repeated
from skidpad.core.courses import Scenario
from skidpad.core.maths.space import Normal, Space, Variable
from skidpad.core.run import AdasDriver, RunSpec
from skidpad.recording.campaign.risks import RISK, Risk
from skidpad.recording.files import write_json
from skidpad.scenarios.shipped import scenario_file
from skidpad.stack.configurations import functions_of


def block(number: int) -> Block:
    return Block(number, 500, number % 2, 0, 3000.0, 1.0)


def test_pieces_that_a_file_holds_are_not_done_again(tmp_path):
    path = tmp_path / "counted.jsonl"
    coverage.drive(path, Block, block, range(3), inf, 1)
    coverage.drive(path, Block, block, range(5), inf, 1)
    lines = [msgspec.json.decode(line, type=Block) for line in path.read_bytes().splitlines()]
    assert sorted(line.number for line in lines) == [0, 1, 2, 3, 4]


def test_no_piece_begins_after_the_time(tmp_path):
    path = tmp_path / "counted.jsonl"
    coverage.drive(path, Block, block, range(5), 0.0, 1)
    assert len(path.read_bytes().splitlines()) == 1, "the one that had begun"


def test_table_says_how_often_an_interval_holds_the_counted_share(tmp_path):
    blocks = [Block(k, 500, 1, 0, 3000.0, 10.0) for k in range(4)]  # 4 of 2000: 0.002
    near, far = Ends(0.002, 0.001, 0.004), Ends(0.0001, 0.00005, 0.00015)
    both = {"importance sampling": near, "printed interval": near}
    repeated = [
        Repeated(0, 100, True, {"subset simulation": near, **both}, 1.0),
        Repeated(1, 100, False, {"subset simulation": far, **both}, 1.0),
        Repeated(2, 100, False, {"subset simulation": Ends(0.0, 0.0, None)}, 1.0),
    ]
    encoder = msgspec.json.Encoder()
    (tmp_path / coverage.COUNTED).write_bytes(encoder.encode_lines(blocks))
    (tmp_path / coverage.REPEATED).write_bytes(encoder.encode_lines(repeated))
    text = coverage.table(tmp_path)
    assert "4 of 2000 fail, 2.00e-03" in text
    assert "20.0 ms" in text
    assert "| subset simulation | 2 of 3 | 66.7 |" in text, "no upper end holds everything"
    assert "| importance sampling | 2 of 3 | 66.7 |" in text, (
        "an estimate that is missing holds nothing"
    )
    assert "determined: 1 of 3" in text


def test_a_table_of_a_folder_without_counts_is_refused(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("sys.argv", ["risk_coverage.py", "table", str(tmp_path)])
    with pytest.raises(SystemExit) as ended:
        coverage.main()
    assert ended.value.code == 2
    assert "has no counted.jsonl: run count first" in capsys.readouterr().err


def test_a_block_of_real_runs_depends_on_its_number_alone(tmp_path, monkeypatch):
    monkeypatch.setattr(coverage, "BLOCK", 3)
    course = Scenario(
        file=str(scenario_file("lead_slowdown")), parameters={"TriggerDistance": "80"}
    )
    driver = AdasDriver(label="4", functions=functions_of(4))
    run = RunSpec(driver=driver, course=course, duration=2.0)
    space = Space((Variable("LeadS", Normal(128.0, 4.0, 110.0, 160.0)),))
    asked = Risk(
        run=run.to_plain(), space=space, per_hour=None, per_100km=None, repetitions=2,
        per_level=50, samples=100, seed=1,
    )  # fmt: skip
    write_json(tmp_path / RISK, asked)
    first, again, other = (coverage.count(tmp_path, k) for k in (0, 0, 1))
    assert (first.runs, first.faults, first.simulated_s) == (3, 0, pytest.approx(6.0))
    assert msgspec.structs.replace(again, processor_s=first.processor_s) == first
    assert other.number == 1
