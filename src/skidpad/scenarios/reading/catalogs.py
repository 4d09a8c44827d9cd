"""Catalogs: entries of other files, taken over with their parameters."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

from skidpad.core.errors import FileError
from skidpad.scenarios.reading.document import Node, parse
from skidpad.scenarios.reading.findings import Finding, Kind
from skidpad.scenarios.reading.parameters import assignments, inner, read_declarations
from skidpad.scenarios.reading.schema import violations

DEPTH_MAX = 8  # references from entry to entry
LEVELS_UP = 6  # folders above the file's, from which relative paths may have been meant


class Catalogs:
    """The catalogs that a scenario names by <CatalogLocations>.

    findings: the list to which is added which folders are not there, and what the schema has
    against catalogs that are used.
    """

    def __init__(self, root: Node, findings: list[Finding]) -> None:
        self.folders: list[Path] = []
        self.findings = findings
        self._seen: set[Path] = set()
        locations = root.find("CatalogLocations")
        for location in locations.children() if locations else ():
            folder = location.find("Directory")
            if folder is not None:
                self.folders.append(self._folder(root, folder))

    def _folder(self, root: Node, folder: Node) -> Path:
        """Returns the folder of a <Directory>: from the file's own, else from one above it.

        A note says where neither is; for a .xosc file it is that file's folder.
        """
        name = folder.text("path").replace("\\", "/")
        path = (root.file.parent / name).resolve()
        if not path.exists() and not Path(name).is_absolute():
            above = list(root.file.resolve().parent.parents)[:LEVELS_UP]
            found = next((f for a in above if name and (f := (a / name).resolve()).is_dir()), None)
            if found is not None:
                what = f"path {name!r} is not there; {found} is taken, seen from a folder above"
                self.findings.append(folder.finding(what, Kind.NOTE))
                path = found
        if not path.exists():
            self.findings.append(folder.finding(f"there is no folder {path}", Kind.NOTE))
        return path.parent if path.suffix == ".xosc" else path

    def _looked_at(self, root: Node) -> None:
        """Adds once to the findings what the schema has against a catalog that is used."""
        if root.file in self._seen:
            return
        self._seen.add(root.file)
        header = root.find("FileHeader")
        if header is not None and header.element.get("revMajor") == "1":
            minor = header.element.get("revMinor", "")
            self.findings += violations(root.element, root.file.name, minor)

    def entry(self, reference: Node, depth: int = 0) -> Node:
        """Returns the entry that a <CatalogReference> means, with its parameters in scope.

        A Fault where there is no such catalog or entry. depth: how many references led here.
        """
        catalog, name = reference.text("catalogName"), reference.text("entryName")
        if depth > DEPTH_MAX:
            raise reference.error(f"the references of catalog {catalog!r} run in a circle")
        root = next((r for f in self.folders if (r := _catalog(f, catalog)) is not None), None)
        if root is None:
            where = ", ".join(map(str, dict.fromkeys(self.folders)))
            looked = f"looked in {where}" if where else "the file names none"
            raise reference.error(
                f"there is no catalog {catalog!r} in the catalog locations ({looked})"
            )
        self._looked_at(root)
        body = root.child("Catalog")
        found = next((n for n in body.children() if n.element.get("name") == name), None)
        if found is None:
            raise reference.error(f"catalog {catalog!r} has no entry {name!r}")
        given = assignments(reference)
        values = read_declarations(found, reference.values, given)
        return found.with_parameters(values | given)

    def resolve(self, node: Node, kind: str | None = None) -> Node:
        """Returns the node itself, or the entry where it is a reference; its own parameters are in scope.

        kind: the element it must be, else a Fault; None for any.
        """
        found, depth = node, 0
        while found.tag == "CatalogReference":
            found = self.entry(found, depth)
            depth += 1
        if kind is not None and found.tag != kind:
            raise node.error(f"<{kind}> is needed, not <{found.tag}>")
        return inner(node) if found is node else found


def _catalog(folder: Path, name: str) -> Node | None:
    """Returns the file of this name, else the one whose <Catalog> has it; None where neither is there.

    As esmini looks for them.
    """
    if not folder.is_dir():
        return None
    files = sorted(folder.glob("*.xosc"), key=lambda p: (p.stem != name, p.name))
    for file in files:
        try:
            root = _parse_catalog(file, file.stat().st_mtime_ns)
        except FileError:
            continue  # another catalog's file; if it is the wanted one, the reference says so
        body = root.find("Catalog")
        if body is not None and name in (file.stem, body.element.get("name")):
            return root
    return None


@lru_cache(maxsize=256)
def _parse_catalog(file: Path, changed: int) -> Node:  # noqa: ARG001  part of the key
    """Parses a catalogue file; the cache distinguishes its versions by the time of change."""
    return parse(file)
