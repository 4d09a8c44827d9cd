"""How many alarms of a kind were true where that was measured, so that no alarm passes for a hazard."""

from __future__ import annotations

from functools import cache
from importlib.resources import files

import msgspec

from skidpad.core.files.reading import decode_yaml
from skidpad.core.text.wording import count_text


class Precision(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """True and false alarms of one kind under one set of rules; limits of the share, 95 %."""

    true: int
    false: int
    low: float | None = None
    high: float | None = None

    @property
    def share(self) -> float:
        """Returns the share of the alarms that were true, 0 to 1."""
        return self.true / (self.true + self.false)

    def describe(self) -> str:
        """Returns the share with its limits and count, as `33 % [7, 59] of 21 alarms`."""
        count = self.true + self.false
        limits = "" if self.low is None or self.high is None else (
            f" [{100.0 * self.low:.0f}, {100.0 * self.high:.0f}]"
        )  # fmt: skip
        return f"{100.0 * self.share:.0f} %{limits} of {count_text(count, 'alarm')}"


def measured_precision(rules: str, hazard: str) -> Precision | None:
    """Returns the precision that was measured for alarms of this kind, None where it was not."""
    return _table().get(rules, {}).get(hazard)


@cache
def _table() -> dict[str, dict[str, Precision]]:
    """Returns the measured precision by rule profile and hazard type, from precision.yaml."""
    source = files("skidpad.fleet.insight").joinpath("precision.yaml")
    table: dict[str, dict[str, Precision]] = decode_yaml(
        source.read_bytes(), source.name, dict[str, dict[str, Precision]]
    )
    return table
