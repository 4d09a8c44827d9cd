"""The coverage table of `docs/carla.md`, made from what is registered.

`python tools/carla_coverage.py FILE` rewrites the part between its marks.
"""

from __future__ import annotations

import sys
from pathlib import Path

from skidpad.simulation.carla_server.actors.catalogue import Family, load_catalogue
from skidpad.simulation.carla_server.actors.effects import (
    acting,
    additions,
    is_produced,
    load_acting,
)
from skidpad.simulation.carla_server.methods import TABLES

BEGIN, END = "<!-- coverage: generated -->", "<!-- end of coverage -->"


def coverage() -> str:
    """Markdown: calls by topic, blueprints by family, attributes that act."""
    return "\n\n".join((_calls(), _blueprints(), _sensors(), _families())) + "\n"


def _calls() -> str:
    methods = [m for table in TABLES for m in table.methods.values()]
    acts = sum(not m.without_effect for m in methods)
    counts = f"{acts} act, {len(methods) - acts} accepted without effect"
    lines = [
        f"### Calls: {len(methods)} known, {counts}",
        "",
        "| topic | acting | accepted without effect |",
        "|---|---|---|",
    ]
    for table in TABLES:
        own = table.methods.values()
        served = [f"`{m.name}`" for m in own if not m.without_effect]
        vain = [f"`{m.name}` ({m.without_effect})" for m in own if m.without_effect]
        cells = (", ".join(served), ", ".join(vain))
        lines.append(f"| {table.topic} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def _blueprints() -> str:
    catalogue = load_catalogue().values()
    lines = ["### Blueprints", "", "| family | blueprints |", "|---|---|"]
    for family in Family:
        count = sum(b.family is family for b in catalogue)
        if count:
            lines.append(f"| {family.value} | {count} |")
    lines.append(f"| all | {len(catalogue)} |")
    return "\n".join(lines)


def _sensors() -> str:
    lines = [
        "### Sensors",
        "",
        "| sensor | sends | attributes that act | our additions (not in Unreal) | without effect |",
        "|---|---|---|---|---|",
    ]
    for blueprint in load_catalogue().values():
        if blueprint.family is not Family.SENSOR:
            continue
        sends = "yes" if is_produced(blueprint.id) else "nothing"
        if blueprint.id in load_acting().in_the_client:
            sends = "computed in the client"
        acts, ours = acting(blueprint), additions(blueprint)
        vain = [a for a in blueprint.attributes if a not in acts]
        cells = (", ".join(sorted(acts - ours)), _list(list(ours)), _list(vain))
        lines.append(f"| `{blueprint.id}` | {sends} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def _families() -> str:
    lines = [
        "### Attributes of the other families",
        "",
        "| family | attributes that act | accepted without effect |",
        "|---|---|---|",
    ]
    for family in Family:
        members = [b for b in load_catalogue().values() if b.family is family]
        if family is Family.SENSOR or not members:
            continue
        known = {a: True for b in members for a in b.attributes}
        acts = {a for b in members for a in acting(b)}
        vain = [a for a in known if a not in acts]
        lines.append(f"| {family.value} | {', '.join(sorted(acts))} | {_list(vain)} |")
    return "\n".join(lines)


def _list(names: list[str]) -> str:
    return ", ".join(sorted(names)) or "-"


def rewritten(text: str) -> str:
    """A page with its generated part renewed."""
    before, rest = text.split(BEGIN)
    _, after = rest.split(END)
    return f"{before}{BEGIN}\n{coverage()}{END}{after}"


if __name__ == "__main__":
    page = Path(sys.argv[1])
    page.write_text(rewritten(page.read_text(encoding="utf-8")), encoding="utf-8")
