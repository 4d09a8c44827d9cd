"""Sentences on names that are not known."""

from __future__ import annotations

from enum import Enum

import pytest

from skidpad.core.errors import ConfigError, require_choice


class Shade(str, Enum):
    """Allowed values of these tests."""

    DARK = "dark"
    LIGHT = "light"


@pytest.mark.parametrize("allowed", [["dark", "light"], [*Shade]], ids=["words", "members"])
def test_an_unknown_name_is_answered_by_all_and_the_nearest(allowed: list[str]) -> None:
    assert require_choice("shade", "dark", allowed) == "dark"
    with pytest.raises(ConfigError) as found:
        require_choice("shade", "drak", allowed)
    assert str(found.value) == (
        "unknown shade 'drak'; choose one of: dark, light; did you mean 'dark'?"
    )


def test_of_too_many_names_the_nearest_three_and_the_command_are_said() -> None:
    names = [f"column_{k}" for k in range(9)]
    with pytest.raises(ConfigError) as found:
        require_choice("column", "colum_3", names, "skidpad list")
    assert str(found.value).startswith("unknown column 'colum_3'; did you mean 'column_3', ")
    assert str(found.value).endswith("? All 9 are listed by: skidpad list")
    assert str(found.value).count("column_") == 3
    with pytest.raises(ConfigError, match="'x'; all 9 are listed by: skidpad list"):
        require_choice("column", "x", names, "skidpad list")
