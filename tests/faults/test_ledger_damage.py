"""A damaged line of the ledger costs its own run, which is driven again (item 5)."""

import random

import pytest

from skidpad.campaign.campaign import Campaign
from skidpad.core.errors import FileError, OutputError
from skidpad.recording.campaign.ledger import DAMAGED, LEDGER, Ledger, read_ledger
from support.toy_campaign import RECIPE, Toss, campaign, key


def here(jobs):
    """Runs jobs in this process."""
    from skidpad.campaign.workers.worker import Finished

    for job in jobs:
        yield Finished(job, value=job.work(job.argument))


@pytest.fixture
def driven(tmp_path):
    done = campaign(3).run(tmp_path / "out", here)
    return tmp_path / "out", done.content_hash


LINES = {
    "not text": lambda line: b"\xff\xfe" + line,
    "no JSON": lambda line: line[:-3],
    "zeros": lambda line: bytes(len(line)),
    "another type": lambda line: line.replace(b'"number":1', b'"number":"one"'),
    "no outcome": lambda line: line.replace(b"completed", b"forgotten"),
    "a way out": lambda line: line.replace(b'"run":"', b'"run":"../'),
    "deep": lambda line: b"[" * 5000,
}


@pytest.mark.parametrize("harm", LINES)
def test_a_damaged_line_is_named_set_aside_and_its_run_driven_again(driven, harm):
    out, digest = driven
    lines = (out / LEDGER).read_bytes().splitlines()
    number = next(i for i, line in enumerate(lines) if b'"run":"even-001"' in line)
    bad = LINES[harm](lines[number])
    (out / LEDGER).write_bytes(b"\n".join([*lines[:number], bad, *lines[number + 1 :], b""]))
    with pytest.raises(FileError, match=rf"line {number + 1} is damaged: .*--resume"):
        read_ledger(out, RECIPE.entry)
    again = campaign(3).run(out, here, resume=True)
    assert (again.driven, again.damaged, again.content_hash) == (1, 1, digest)
    assert any("set aside" in warning for warning in again.warnings())
    assert (out / DAMAGED).read_bytes() == bad + b"\n"
    assert len(read_ledger(out, RECIPE.entry)) == len(lines)


def test_after_any_flipped_byte_the_campaign_ends_with_the_same_results(driven):
    out, digest = driven
    whole, rng = (out / LEDGER).read_bytes(), random.Random(5)
    for _ in range(200):
        text = bytearray(whole)
        text[rng.randrange(len(text))] ^= rng.randrange(1, 256)
        (out / LEDGER).write_bytes(text)
        summary = campaign(3).run(out, here, resume=True)
        assert (summary.runs, summary.content_hash) == (6, digest)


def test_while_lines_are_set_aside_the_campaign_stays_locked(driven):
    out, _ = driven
    with (out / LEDGER).open("ab") as ledger:
        ledger.write(b"\xff\n")
    identity = campaign(3).identity()
    with (
        Ledger(out, RECIPE.entry, identity, resume=True),
        pytest.raises(OutputError, match="another process"),
    ):
        Ledger(out, RECIPE.entry, identity, resume=True)


def test_parts_that_a_kill_left_do_not_hinder_a_campaign(tmp_path):
    out = tmp_path / "out"
    out.mkdir()
    (out / ".campaign.json.123.part").write_bytes(b"{")
    (out / LEDGER).touch()
    tosses = [Toss("a", 1)]
    assert Campaign(RECIPE, tosses).run(out, here).runs == 1
    assert key(tosses[0], type("O", (), {"value": "completed"})).outcome == "completed"
