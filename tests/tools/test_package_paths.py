"""The search for paths of the building machine finds a planted one, also in an archive within a package."""

from __future__ import annotations

import io
import tarfile
import zipfile
from pathlib import Path

import pytest

import package_paths

CLEAN = b"Tables go to OUT, and temporary ones to /tmp or a folder of yours."


def zipped(files: dict[str, bytes]) -> bytes:
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    return out.getvalue()


def tarred(files: dict[str, bytes]) -> bytes:
    out = io.BytesIO()
    with tarfile.open(fileobj=out, mode="w:gz") as archive:
        for name, content in files.items():
            info = tarfile.TarInfo(name)
            info.size = len(content)
            archive.addfile(info, io.BytesIO(content))
    return out.getvalue()


@pytest.mark.parametrize("planted", ["{build}/source/a.c", "/home/anna/a.c", "/tmp/tmpab12/a.c"])
@pytest.mark.parametrize("name", ["a.whl", "a.tar.gz"])
def test_a_planted_path_is_found(planted: str, name: str, tmp_path: Path) -> None:
    text = b"\0made of " + planted.format(build=tmp_path / "build").encode() + b"\0"
    pack = zipped if name == "a.whl" else tarred
    nested = zipped({"scene.bin": text})
    package = tmp_path / name
    package.write_bytes(pack({"a/clean.txt": CLEAN, "a/scene.npz": nested, "a/scene.o": text}))
    found = package_paths.find_paths(package, [tmp_path / "build"])
    assert [line.split(":")[0] for line in found] == [
        f"{name}!a/scene.npz!scene.bin",
        f"{name}!a/scene.o",
    ]
    assert package_paths.main(str(tmp_path / "build"), [str(package)]) == 1


def test_a_package_without_paths_passes(tmp_path: Path) -> None:
    package = tmp_path / "a.whl"
    package.write_bytes(zipped({"a/clean.txt": CLEAN}))
    assert package_paths.main(str(tmp_path / "build"), [str(package)]) == 0
