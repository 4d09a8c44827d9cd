"""Finds paths of the building machine in a wheel or a source distribution.

    python tools/package_paths.py FOLDER dist/*.whl dist/*.tar.gz

FOLDER is where they were built. Archives within them are searched, too. Ends with 1 on a find.
"""

from __future__ import annotations

import io
import re
import sys
import tarfile
import tempfile
import zipfile
from collections.abc import Iterator
from pathlib import Path

SHORTEST = 6  # bytes of a folder that is looked for: "/tmp" alone may stand in a text for people
HOMES = re.compile(rb"/(?:home|Users)/[\w.-]+/|/root/[\w.-]+|/tmp/tmp[\w.-]+|/var/folders/\w\w/")


def members(name: str, content: bytes) -> Iterator[tuple[str, bytes]]:
    """Yields the files in an archive by their names, those of archives within it too; else the file."""
    if zipfile.is_zipfile(io.BytesIO(content)):
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            for one in archive.namelist():
                yield from members(f"{name}!{one}", archive.read(one))
    elif name.endswith((".tar.gz", ".tgz")):
        with tarfile.open(fileobj=io.BytesIO(content), mode="r:gz") as archive:
            for info in archive:
                held = archive.extractfile(info)
                if held is not None:
                    yield from members(f"{name}!{info.name}", held.read())
    else:
        yield name, content


def find_paths(package: Path, folders: list[Path]) -> list[str]:
    """Returns a line for each file in a package that names one of the folders, or a user's home."""
    texts = [str(folder).encode() for folder in folders]
    wanted = re.compile(b"|".join(re.escape(t) for t in texts if len(t) >= SHORTEST) or rb"(?!)")
    found = []
    for name, content in members(package.name, package.read_bytes()):
        for pattern in (wanted, HOMES):
            if hit := pattern.search(content):
                around = content[max(hit.start() - 30, 0) : hit.end() + 30]
                found.append(f"{name}: {around.decode(errors='replace')!r}")
                break
    return found


def main(folder: str, packages: list[str]) -> int:
    """Prints what was found and returns 1; 0 where nothing was."""
    here = [Path(folder), Path.home(), Path.cwd(), Path(tempfile.gettempdir())]
    found = [line for package in packages for line in find_paths(Path(package), here)]
    for line in found:
        print(line)
    print(f"{len(found)} files in {len(packages)} packages name a path of this machine")
    return int(bool(found))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], sys.argv[2:]))
