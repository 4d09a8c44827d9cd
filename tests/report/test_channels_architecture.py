import re
from pathlib import Path

import pytest

import skidpad
from skidpad.evidence.channels.timing import BUDGET_MS

SOURCE = Path(skidpad.__file__).parent
PAGE = Path(__file__).parents[2] / "docs" / "architecture.md"


def section():
    return PAGE.read_text(encoding="utf-8").split("## Channels: ")[1]


@pytest.mark.req("C-003", "C-004", "C-007", "C-008", "C-009", "C-010", "C-250", "C-251")
def test_the_page_says_what_channels_are_for():
    text = section()
    words = ("ISO 21448", "UL 4600", "affordable in real time", "unknown", "shadow", "failover")
    assert [w for w in words if w not in text] == []


@pytest.mark.req("C-002", "C-190", "C-191", "C-192", "C-193")
def test_every_part_that_the_page_names_exists():
    parts = re.findall(r"`([a-z_]+/[a-z_/]+(?:\.py)?)`", section())
    assert len(parts) >= 12
    assert [p for p in parts if not (SOURCE / p).exists()] == []


def test_page_table_and_finding_know_one_budget():
    assert f"{BUDGET_MS:g} ms" in section()
    assert BUDGET_MS == 25.0


@pytest.mark.req("C-150", "C-153")
def test_nothing_on_the_vehicle_writes_scenario_files():
    for path in [*(SOURCE / "evidence").rglob("*.py"), *(SOURCE / "recording").rglob("*.py")]:
        assert "scenariogeneration" not in path.read_text(encoding="utf-8"), path
