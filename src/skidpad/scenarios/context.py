"""What the parts of a scenario need to know of each other while it is compiled."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeVar

from skidpad.roads.opendrive.reader import id_number
from skidpad.scenarios.movement.network import Network
from skidpad.scenarios.reading.catalogs import Catalogs
from skidpad.scenarios.reading.document import Node
from skidpad.scenarios.reading.entities import Entity
from skidpad.scenarios.reading.findings import Fault, Finding, Kind

Made = TypeVar("Made")
ROADS_NAMED = 12  # ids of a map that a fault names
Path = tuple[str, ...]  # names from the story down to a storyboard element


@dataclass(slots=True)
class Context:
    """One file's compilation. elements: paths of all storyboard elements, with their types."""

    network: Network
    catalogs: Catalogs
    entities: Mapping[str, Entity]
    groups: Mapping[str, tuple[str, ...]] = field(default_factory=dict)  # entity selections
    parameters: Mapping[str, str] = field(default_factory=dict)
    variables: Mapping[str, str] = field(default_factory=dict)
    signals: frozenset[str] = frozenset()
    # places on what is itself made of places: routes and trajectories
    further_positions: Mapping[str, Callable[[Node, Context], Any]] = field(default_factory=dict)
    hired: dict[str, Entity] = field(default_factory=dict)  # vehicles that traffic may bring
    added: frozenset[str] = frozenset()  # entities that some event adds
    elements: Sequence[tuple[str, Path]] = ()
    findings: list[Finding] = field(default_factory=list)
    names: Any = None  # `registry.Names`: what the file may reach by name
    controllers: Mapping[str, Any] = field(default_factory=dict)  # of entities, not yet active

    def entity(self, node: Node, name: str = "entityRef") -> str:
        """Returns the entity that an attribute names; a Fault when there is none."""
        text = node.text(name)
        if text not in self.entities:
            raise node.error(f"{name}: there is no entity {text!r}")
        return text

    def actors(self, nodes: Iterable[Node]) -> tuple[str, ...]:
        """Returns the entities that <EntityRef>s name, each once, selections taken apart."""
        found: list[str] = []
        for node in nodes:
            name = node.text("entityRef")
            members = self.groups.get(name) or (self.entity(node),)
            found += [m for m in members if m not in found]
        return tuple(found)

    def road(self, node: Node) -> int:
        """Returns the road that an attribute roadId names; on a map with one road only that one, with a note.

        A Fault names the ids that there are.
        """
        text = node.text("roadId")
        number = id_number(text)
        known = self.network.map.lanes.road
        if (known == number).any() or number in self.network.labels:
            return number
        labels = self.network.labels
        if len(labels) == 1:
            ((only, label),) = labels.items()
            what = f"roadId: there is no road {text!r}; the only one, {label!r}, is taken"
            self.findings.append(node.finding(what, Kind.NOTE))
            return only
        some = ", ".join(repr(label) for label in list(labels.values())[:ROADS_NAMED])
        more = f" and {len(labels) - ROADS_NAMED} more" if len(labels) > ROADS_NAMED else ""
        raise node.error(f"roadId: there is no road {text!r}; the map has {some}{more}")

    def element(self, node: Node) -> Path:
        """Returns the path of the storyboard element that a condition names, by name or end of its path.

        The first one that fits; a Fault where none does.
        """
        text = node.text("storyboardElementRef")
        kind = node.text("storyboardElementType", "")
        wanted = tuple(text.split("::"))
        fits = [p for k, p in self.elements if p[-len(wanted) :] == wanted and kind in ("", k)]
        if not fits:
            raise node.error(f"storyboardElementRef: there is no {kind or 'element'} {text!r}")
        return fits[0]

    def attempt(self, make: Callable[[], Made]) -> Made | None:
        """Returns what is made, or None with the fault on the list, so that one hides no other."""
        try:
            return make()
        except Fault as fault:
            self.findings.append(fault.finding)
            return None
