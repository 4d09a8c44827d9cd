"""Long proofs: what passed at this commit is not driven again, what failed is said."""

from __future__ import annotations

import sys

import pytest

import nightly
from nightly import Proof


@pytest.fixture
def driven(tmp_path, monkeypatch, capsys):
    def drive(*proofs, arguments=()):
        monkeypatch.setattr(sys, "argv", ["nightly", "--out", str(tmp_path), *arguments])
        return nightly.main(proofs), capsys.readouterr().out

    return drive


def proof(name, code):
    return Proof(name, (sys.executable, "-c", code), f"that {name}")


def test_outcomes_are_kept_and_told(driven, tmp_path):
    good, bad = proof("good", "print('12 of 12')"), proof("bad", "print('no'); raise SystemExit(1)")
    status, said = driven(good, bad)
    assert status == 1
    assert "passed: 12 of 12" in said
    assert "FAILED: no" in said
    assert len((tmp_path / "proofs.jsonl").read_text().splitlines()) == 2
    assert (tmp_path / "good.log").read_text() == "12 of 12\n"


def test_goes_on_where_it_was(driven, tmp_path, monkeypatch):
    monkeypatch.setattr(nightly, "commit", lambda: "abc")
    count = tmp_path / "count"
    counted = proof("counted", f"open({str(count)!r}, 'a').write('x')")
    driven(counted)
    (tmp_path / "proofs.jsonl").open("a").write('{"name": "cut o')  # by a kill
    driven(counted)
    assert count.read_text() == "x"
    driven(counted, arguments=["--again"])
    monkeypatch.setattr(nightly, "commit", lambda: "abd")
    driven(counted)
    assert count.read_text() == "xxx"


def test_only_what_is_asked_for(driven):
    status, said = driven(
        proof("one", "print(1)"), proof("two", "print(2)"), arguments=["--only", "two"]
    )
    assert status == 0
    assert "passed: 2" in said
    assert "one" not in said
    status, said = driven(proof("never", ""), arguments=["--list"])
    assert (status, "not driven" in said) == (0, True)


def test_every_proof_names_something_that_is_there():
    assert len({p.name for p in nightly.PROOFS}) == len(nightly.PROOFS)
    for p in nightly.PROOFS:
        files = [word for word in p.command if word.endswith(".py")]
        assert all((nightly.ROOT / f).is_file() for f in files), p
