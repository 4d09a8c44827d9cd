"""Private keys: the first one that is made is the one for all."""

from __future__ import annotations

import pytest

from skidpad.core.errors import OutputError
from skidpad.fleet import keys
from skidpad.fleet.alerting.orders import Signer


def test_a_key_that_another_process_made_meanwhile_is_taken_not_replaced(tmp_path, monkeypatch):
    secret_pem, others = keys.secret_pem, []

    def write_late(key):
        monkeypatch.undo()
        others.append(Signer(tmp_path))
        return secret_pem(key)

    monkeypatch.setattr(keys, "secret_pem", write_late)
    mine = Signer(tmp_path)
    assert mine.public == others[0].public == Signer(tmp_path).public
    assert sorted(p.name for p in tmp_path.iterdir()) == ["orders.key", "orders.pub"]


def test_a_key_is_never_replaced(tmp_path):
    keys.new_key(tmp_path / "a.key")
    before = (tmp_path / "a.key").read_bytes()
    with pytest.raises(OutputError, match="never replaced"):
        keys.new_key(tmp_path / "a.key")
    assert (tmp_path / "a.key").read_bytes() == before
    assert (tmp_path / "a.key").stat().st_mode & 0o777 == 0o600
