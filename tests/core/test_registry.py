"""Registries find what installed packages add, and say in one sentence what is wrong with it."""

from __future__ import annotations

import sys
from dataclasses import dataclass

import pytest

from skidpad.core.errors import ConfigError
from skidpad.core.objects.registry import Registry


@dataclass(frozen=True)
class Bell:
    name: str
    title: str = "A bell"


def registry() -> Registry[Bell]:
    return Registry("bell", "skidpad.bells", Bell, lambda: (Bell("small"), Bell("large")))


def install(tmp_path, monkeypatch, points: str, module: str = "", name: str = "bell_maker") -> None:
    about = tmp_path / f"{name}-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text(f"[skidpad.bells]\n{points}\n")
    (tmp_path / f"{name}_code.py").write_text(f"from {__name__} import Bell\n{module}\n")
    monkeypatch.delitem(sys.modules, f"{name}_code", raising=False)
    monkeypatch.syspath_prepend(str(tmp_path))


def test_own_entries_come_first_and_in_their_order(tmp_path, monkeypatch):
    install(tmp_path, monkeypatch, "brass = bell_maker_code:BELL", "BELL = Bell('brass')")
    bells = registry()
    assert bells.names() == ("small", "large", "brass")
    assert [b.name for b in bells.foreign_entries()] == ["brass"]
    assert bells.sources()["brass"].package == "bell_maker"


def test_an_unknown_name_is_answered_with_those_that_exist_and_the_nearest():
    with pytest.raises(ConfigError, match="'smal'; choose one of: small, large; did you mean 's"):
        registry().get("smal")


def test_code_of_a_package_is_loaded_only_for_its_entry(tmp_path, monkeypatch):
    install(tmp_path, monkeypatch, "bad = bell_maker_code:BELL", "raise OSError('no brass')")
    assert registry().get("small") == Bell("small")
    with pytest.raises(ConfigError, match="'bad' of the package bell_maker cannot be.*no brass"):
        registry().get("bad")


@pytest.mark.parametrize(
    ("points", "module", "message"),
    [
        ("small = bell_maker_code:B", "B = Bell('small')", "bell_maker has the name of one of ski"),
        ("new = bell_maker_code:B", "B = 7", "bell_maker_code:B must be a Bell, got 7"),
        ("new = bell_maker_code:B", "B = Bell('old')", "calls itself 'old': both names must be"),
        ("new = bell_maker_code:C", "B = 7", "cannot be loaded: AttributeError"),
    ],
)
def test_a_package_that_cannot_be_used_is_named(tmp_path, monkeypatch, points, module, message):
    install(tmp_path, monkeypatch, points, module)
    with pytest.raises(ConfigError, match=message):
        registry().entries()
