"""Tyres as data with sources: what each kind holds on dry roads, ice and snow, and its tread.

A name is a kind (`tyres.yaml`) and, after an underscore, the tread that is left: `summer`,
`summer_4mm`, `summer_1.6mm`. A new tyre has 8 mm.
"""

from __future__ import annotations

from functools import cache
from importlib import resources

from msgspec import Struct, structs

from skidpad.core.errors import require_choice

NEW_MM = 8.0
WORN_MM = 1.6  # the legal limit in Europe, and "worn" in the table of Bosch
TREADS = {"": NEW_MM, "_4mm": 4.0, "_1.6mm": WORN_MM}
REFERENCE = "winter"  # the tyre that `mu_ref` describes


class Tyres(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """One kind of tyre with one depth of tread. Frictions are those of a road with `mu_ref` 0.9."""

    title: str
    dry: float
    ice: float  # of sheet ice at -5 C
    snow: float  # of packed snow
    worn_ice: float  # of ice with 4 mm of tread and less
    source: str
    tread_mm: float = NEW_MM

    @property
    def wear(self) -> float:
        """Returns the share of the usable tread that is gone: 0 when new, 1 at 1.6 mm."""
        return (NEW_MM - self.tread_mm) / (NEW_MM - WORN_MM)


@cache
def known_tyres() -> dict[str, Tyres]:
    """Returns the tyres by name, each kind with each tread depth, kinds sorted."""
    from skidpad.core.files.reading import (
        decode_yaml,  # YAML comes with it, which --help does not need
    )

    where = resources.files(__package__).joinpath("tyres.yaml")
    kinds = decode_yaml(where.read_bytes(), "tyres.yaml", dict[str, Tyres])
    return {
        f"{name}{suffix}": structs.replace(kind, tread_mm=tread)
        for name, kind in sorted(kinds.items())
        for suffix, tread in TREADS.items()
    }


def find_tyres(name: str) -> Tyres:
    """Returns the tyres with this name; ConfigError lists the known ones."""
    return known_tyres()[require_choice("tyres", name, list(known_tyres()))]
