"""Catalogs: entries of other files, taken over with their parameters."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

from skidpad.core.errors import FileError
from skidpad.scenarios.document import Node, parse
from skidpad.scenarios.parameters import assignments, declared, inner

DEPTH_MAX = 8  # references from entry to entry


class Catalogs:
    """The catalogs that a scenario names by <CatalogLocations>."""

    def __init__(self, root: Node) -> None:
        self.folders: list[Path] = []
        locations = root.find("CatalogLocations")
        for location in locations.children() if locations else ():
            folder = location.find("Directory")
            if folder is not None:
                path = (root.file.parent / folder.text("path").replace("\\", "/")).resolve()
                self.folders.append(path.parent if path.suffix == ".xosc" else path)

    def entry(self, reference: Node, depth: int = 0) -> Node:
        """The entry that a <CatalogReference> means, with its parameters in scope."""
        catalog, name = reference.text("catalogName"), reference.text("entryName")
        if depth > DEPTH_MAX:
            raise reference.error(f"the references of catalog {catalog!r} run in a circle")
        root = next((r for f in self.folders if (r := _catalog(f, catalog)) is not None), None)
        if root is None:
            raise reference.error(f"there is no catalog {catalog!r} in the catalog locations")
        body = root.child("Catalog")
        found = next((n for n in body.children() if n.element.get("name") == name), None)
        if found is None:
            raise reference.error(f"catalog {catalog!r} has no entry {name!r}")
        given = assignments(reference)
        values = declared(found, reference.values, given)
        return found.scoped(values | given)

    def resolved(self, node: Node, kind: str | None = None) -> Node:
        """The node itself, or the entry where it is a reference; its own parameters are in scope.

        kind: the element it must be, else a fault; None for any.
        """
        found, depth = node, 0
        while found.tag == "CatalogReference":
            found = self.entry(found, depth)
            depth += 1
        if kind is not None and found.tag != kind:
            raise node.error(f"<{kind}> is needed, not <{found.tag}>")
        return inner(node) if found is node else found


def _catalog(folder: Path, name: str) -> Node | None:
    """The file of this name, else the one whose <Catalog> has it; as esmini looks for them."""
    if not folder.is_dir():
        return None
    files = sorted(folder.glob("*.xosc"), key=lambda p: (p.stem != name, p.name))
    for file in files:
        try:
            root = _parsed(file, file.stat().st_mtime_ns)
        except FileError:
            continue  # another catalog's file; if it is the wanted one, the reference says so
        body = root.find("Catalog")
        if body is not None and name in (file.stem, body.element.get("name")):
            return root
    return None


@lru_cache(maxsize=256)
def _parsed(file: Path, changed: int) -> Node:  # noqa: ARG001  part of the key
    return parse(file)
