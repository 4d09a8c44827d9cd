"""The scenarios that come with Skidpad, as their files declare them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import MappingProxyType

from lxml import etree

from skidpad.core.errors import FileError, require_choice

FOLDER = Path(__file__).parent / "catalogue"
NAMES = ("ghost_cut_in", "lead_slowdown", "front_accident")  # in the study's order, B-090 to B-092


@dataclass(frozen=True, slots=True)
class Shipped:
    """Title and parameters that a shipped file declares."""

    parameters: Mapping[str, float]  # defaults, SI
    actors: tuple[str, ...]


def scenario_file(name: str) -> Path:
    """Returns the 1.2 file of a scenario of the catalogue; ConfigError for an unknown name."""
    return FOLDER / f"{require_choice('scenario', name, NAMES)}.xosc"


def find_scenario(file: Path) -> Path:
    """Returns a file or folder, also of a name of the catalogue; FileError where there is neither."""
    if not file.exists() and str(file) in NAMES:
        return scenario_file(str(file))
    if not file.exists():
        raise FileError(
            f"scenario {file}: there is no such file or folder; the catalogue has {', '.join(NAMES)}"
        )
    return file


@cache
def find_shipped(name: str) -> Shipped:
    """Returns the parameters and entity names of the shipped scenario with this name."""
    root = etree.parse(str(scenario_file(name))).getroot()
    declared = root.iterfind("ParameterDeclarations/ParameterDeclaration")
    objects = root.iterfind("Entities/ScenarioObject")
    return Shipped(
        MappingProxyType({str(p.attrib["name"]): float(p.attrib["value"]) for p in declared}),
        tuple(str(o.attrib["name"]) for o in objects),
    )
