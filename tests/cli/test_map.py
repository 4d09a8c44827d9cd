"""`skidpad map` says what a map holds, and refuses what is none."""

from __future__ import annotations

import json
import os
import tarfile
from collections.abc import Sequence
from io import BytesIO
from pathlib import Path
from zipfile import ZIP_BZIP2, ZIP_DEFLATED, ZIP_LZMA, ZIP_STORED, ZipFile

import pytest
from typer.testing import CliRunner

from skidpad.cli.main import app, main
from skidpad.core.errors import FileError, InputError
from skidpad.roads import carla_import
from skidpad.roads.bundled import FOLDER, load_map
from skidpad.roads.carla_import import find_road_files
from skidpad.simulation.carla_server.maps.maps import MapStore

RUNNER = CliRunner()


def test_list_names_the_bundled_maps() -> None:
    out = RUNNER.invoke(app, ["map", "list"]).output
    assert "figure8" in out
    assert "straight" in out


def test_info_prints_the_grip_that_the_tightest_bend_needs() -> None:
    out = RUNNER.invoke(app, ["map", "info", "figure8"]).output
    row = next(line.split() for line in out.splitlines() if line.split()[3:4] == ["71.8"])
    assert row[4:] == ["60", f"{(80 / 3.6) ** 2 / (71.75 * 9.80665):.2f}", "2.47"]
    assert "warning" not in out
    assert load_map("figure8").content_hash in out


def test_info_warns_of_dead_ends() -> None:
    out = RUNNER.invoke(app, ["map", "info", "straight"]).output
    assert "6 driving lanes lead nowhere" in out


def test_info_names_the_only_road_as_its_file_does(tmp_path: Path) -> None:
    """An id may be a word; the number that stands for it inside is nobody's to read."""
    text = (FOLDER / "straight.xodr").read_text(encoding="utf-8")
    file = tmp_path / "worded.xodr"
    worded = text.replace('id="1" junction', 'id="north" junction')
    file.write_text(worded, encoding="utf-8")
    out = RUNNER.invoke(app, ["map", "info", str(file)]).output
    assert out.splitlines()[2].startswith("1 road, "), out
    assert "driving lanes lead nowhere: road north lane" in out
    assert "road ids: north" in out


def test_bake_writes_a_file_that_loads_as_the_same_map(tmp_path: Path) -> None:
    source = tmp_path / "mine.xodr"
    source.write_bytes((FOLDER / "straight.xodr").read_bytes())
    result = RUNNER.invoke(app, ["map", "bake", str(source)])
    assert result.exit_code == 0
    assert load_map(tmp_path / "mine.npz").content_hash == load_map("straight").content_hash


def test_a_picture_is_written(tmp_path: Path) -> None:
    target = tmp_path / "plan.png"
    assert RUNNER.invoke(app, ["map", "info", "straight", "--png", str(target)]).exit_code == 0
    assert target.read_bytes().startswith(b"\x89PNG")


def test_a_file_that_is_no_map_ends_with_one_sentence_and_code_2(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    bad = tmp_path / "bad.xodr"
    bad.write_text("<html/>")
    monkeypatch.setattr("sys.argv", ["skidpad", "map", "info", str(bad)])
    with pytest.raises(SystemExit) as caught:
        main()
    assert caught.value.code == 2
    assert "not OpenDRIVE" in capsys.readouterr().err


# --- import-carla: imitations of what CARLA's folder, package and image look like

LAYOUT = "CarlaUE4/Content/Carla/Maps"
ROADS = (FOLDER / "straight.xodr").read_bytes()
FILES = {
    f"{LAYOUT}/AnOldOne/Town03.xodr": b"an older one, not in a folder OpenDrive, and first",
    f"{LAYOUT}/OpenDrive/Town03.xodr": ROADS,
    f"{LAYOUT}/Town12/OpenDrive/Town12.xodr": ROADS,
    f"{LAYOUT}/Town12/TM/Town12.bin": b"no roads",
    f"{LAYOUT}/OpenDrive/Broken.xodr": b"<OpenDRIVE",
}


def add(archive: tarfile.TarFile, name: str, content: bytes) -> None:
    member = tarfile.TarInfo(name)
    member.size = len(content)
    archive.addfile(member, BytesIO(content))


ZSTD = b"\x28\xb5\x2f\xfd" + bytes(600)


def tarred(files: dict[str, bytes], mode: str) -> bytes:
    buffer = BytesIO()
    with tarfile.open(fileobj=buffer, mode=mode) as archive:
        for name, content in files.items():
            add(archive, name, content)
    return buffer.getvalue()


def folder(at: Path) -> Path:
    for name, content in FILES.items():
        (at / "carla" / name).parent.mkdir(parents=True, exist_ok=True)
        (at / "carla" / name).write_bytes(content)
    return at / "carla"


def package(at: Path) -> Path:
    (at / "CARLA_0.9.16.tar.gz").write_bytes(tarred(FILES, "w:gz"))
    return at / "CARLA_0.9.16.tar.gz"


def windows_package(at: Path) -> Path:
    with ZipFile(at / "CARLA_0.9.16.zip", "w") as archive:
        for name, content in FILES.items():
            archive.writestr(name, content)
    return at / "CARLA_0.9.16.zip"


def saved(layers: dict[str, bytes], order: Sequence[str] | None = None) -> bytes:
    """An image: its layers in the order of the archive, and a manifest with theirs."""
    named = [{"Layers": list(layers if order is None else order)}]
    return tarred({**layers, "manifest.json": json.dumps(named).encode()}, "w")


def image(at: Path) -> Path:
    """Layers of a container image: plain and compressed blobs beside its description."""
    names = list(FILES)
    layers = {
        "blobs/sha256/aa": b'{"no": "layer"}',
        "blobs/sha256/bb": tarred({n: FILES[n] for n in names[:1]}, "w"),
        "cc/layer.tar": tarred({n: FILES[n] for n in names[1:]}, "w:gz"),
    }
    (at / "carla.tar").write_bytes(saved(layers, list(layers)[1:]))
    return at / "carla.tar"


@pytest.mark.parametrize("layout", [folder, package, windows_package, image])
def test_road_files_are_taken_out_of_a_carla(tmp_path: Path, layout) -> None:
    out = tmp_path / "maps"
    result = RUNNER.invoke(app, ["map", "import-carla", str(layout(tmp_path)), "--out", str(out)])
    assert result.exit_code == 0, result.output
    assert sorted(p.name for p in out.iterdir()) == ["Town03.xodr", "Town12.xodr"]
    assert load_map(out / "Town03.xodr").content_hash == load_map("straight").content_hash
    assert "not taken: Broken: not XML" in result.output
    assert f"skidpad carla-server --maps {out} --map Town03" in result.output
    assert {"Town03", "Town12", "Town12_Opt"} <= set(MapStore(out).names())


def test_an_import_from_a_place_that_is_not_there_is_one_sentence(tmp_path: Path) -> None:
    result = RUNNER.invoke(app, ["map", "import-carla", str(tmp_path / "none")])
    assert isinstance(result.exception, InputError)
    assert str(result.exception) == (
        f"{tmp_path / 'none'} is not there: give a CARLA folder, package or image"
    )


def refuse(monkeypatch: pytest.MonkeyPatch, method: str, name: str) -> None:
    """Denies what a method of Path does with files of this name, as to a user without the right."""
    plain = getattr(Path, method)

    def denied(self: Path, *args, **kwargs):
        if self.name == name:
            raise PermissionError(13, "Permission denied", str(self))
        return plain(self, *args, **kwargs)

    monkeypatch.setattr(Path, method, denied)


def test_an_import_from_an_unreadable_folder_is_one_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    refuse(monkeypatch, "stat", "carla.tar")
    with pytest.raises(FileError, match=r"cannot be read as a CARLA folder .*Permission denied"):
        find_road_files(tmp_path / "carla.tar")


@pytest.mark.parametrize("method", ["open", "is_file"])
def test_a_road_file_that_cannot_be_read_is_named_and_the_others_are_taken(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, method: str
) -> None:
    source, out = folder(tmp_path), tmp_path / "maps"
    refuse(monkeypatch, method, "Town12.xodr")
    result = RUNNER.invoke(app, ["map", "import-carla", str(source), "--out", str(out)])
    assert result.exit_code == 0, result.output
    assert [p.name for p in out.iterdir()] == ["Town03.xodr"]
    place = f"{LAYOUT}/Town12/OpenDrive/Town12.xodr"
    assert f"not taken: {place}: it cannot be read: Permission denied" in result.output


def test_an_import_overwrites_nothing(tmp_path: Path) -> None:
    own = tmp_path / "Town03.xodr"
    own.write_bytes(b"<OpenDRIVE")
    result = RUNNER.invoke(app, ["map", "import-carla", str(tmp_path), "--out", str(tmp_path)])
    assert result.exit_code != 0
    assert f"{own} exists already" in str(result.exception)
    assert own.read_bytes() == b"<OpenDRIVE"


PLACE = f"{LAYOUT}/OpenDrive"
OLD, NEW = b"old", b"new"


@pytest.mark.parametrize(
    ("upper", "wanted"),
    [
        ({f"{PLACE}/Town03.xodr": NEW}, {"Town03": NEW, "Town04": OLD}),
        ({f"./{PLACE}/.wh.Town03.xodr": b""}, {"Town04": OLD}),
        ({f"{LAYOUT}/.wh.OpenDrive": b"", "a/New.xodr": NEW}, {"New": NEW}),
        ({f"{PLACE}/.wh..wh..opq": b"", f"{PLACE}/Town04.xodr": NEW}, {"Town04": NEW}),
    ],
)
@pytest.mark.parametrize("names", ["ab", "ba"])
def test_an_upper_layer_hides_those_below(
    tmp_path: Path, upper: dict[str, bytes], wanted: dict[str, bytes], names: str
) -> None:
    lower = {f"{PLACE}/Town03.xodr": OLD, f"{PLACE}/Town04.xodr": OLD}
    low, high = (f"{name}/layer.tar" for name in names)
    layers = {low: tarred(lower, "w"), high: tarred(upper, "w")}
    source = tmp_path / "carla.tar"
    source.write_bytes(saved({name: layers[name] for name in sorted(layers)}, [low, high]))
    found = find_road_files(source)
    assert found.contents == wanted
    assert not found.left_out


def test_what_cannot_be_taken_is_named_and_the_rest_taken(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(carla_import, "SIZE_MAX", 10)
    files = {
        "a/OpenDrive/Large.xodr": bytes(11),
        "a/OpenDrive/Town03.xodr": b"one",
        "b/OpenDrive/Town03.xodr": b"another",
        "c/OpenDrive/Town03.xodr": b"one",
        "a\\..\\..\\Town04.xodr": b"four",
        "a/c:Town05.xodr": b"five",
    }
    source = tmp_path / "some.tar"
    source.write_bytes(tarred(files, "w"))
    found = find_road_files(source)
    assert found.contents == {"Town03": b"one", "Town04": b"four"}
    assert found.left_out == [
        "a/OpenDrive/Large.xodr: more than the allowed 10 bytes",
        "b/OpenDrive/Town03.xodr: another file of this name is a/OpenDrive/Town03.xodr",
        "a/c:Town05.xodr: 'c:Town05' cannot be the name of a map",
    ]


@pytest.mark.parametrize("limit", ["TOTAL_MAX", "FILES_MAX"])
def test_a_source_cannot_fill_the_memory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, limit: str
) -> None:
    monkeypatch.setattr(carla_import, limit, 2)
    source = tmp_path / "some.tar"
    source.write_bytes(tarred({f"{n}.xodr": b"x" for n in range(3)}, "w:gz"))
    with pytest.raises(FileError, match=r"some\.tar: its \.xodr files are more than the allowed"):
        find_road_files(source)


def test_a_folder_or_pipe_with_the_name_of_a_road_file_is_none(tmp_path: Path) -> None:
    (tmp_path / "Folder.xodr").mkdir()
    os.mkfifo(tmp_path / "Pipe.xodr")
    (tmp_path / "Town03.xodr").write_bytes(ROADS)
    assert find_road_files(tmp_path).contents == {"Town03": ROADS}


@pytest.mark.parametrize(("at", "value"), [(6, 1), (8, 9)])  # encrypted; Deflate64
def test_a_zip_that_zipfile_does_not_read_is_one_sentence(
    tmp_path: Path, at: int, value: int
) -> None:
    source = tmp_path / "some.zip"
    with ZipFile(source, "w") as archive:
        archive.writestr("Town03.xodr", ROADS)
    data = bytearray(source.read_bytes())
    data[at] = data[data.index(b"PK\x01\x02") + at + 2] = value
    source.write_bytes(data)
    with pytest.raises(FileError, match="cannot be read as a CARLA folder or archive"):
        find_road_files(source)


@pytest.mark.parametrize("compression", [ZIP_STORED, ZIP_DEFLATED, ZIP_BZIP2, ZIP_LZMA])
def test_a_damaged_member_of_a_zip_is_one_sentence_and_writes_nothing(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    compression: int,
) -> None:
    source, out = tmp_path / "some.zip", tmp_path / "maps"
    with ZipFile(source, "w", compression=compression) as archive:
        archive.writestr("Town02.xodr", ROADS)
        archive.writestr("Town03.xodr", ROADS)
    data = bytearray(source.read_bytes())
    content = data.rindex(b"Town03.xodr", 0, data.index(b"PK\x01\x02")) + len("Town03.xodr")
    data[content + 20 : content + 24] = b"oops"  # of the second map
    source.write_bytes(data)
    monkeypatch.setattr(
        "sys.argv", ["skidpad", "map", "import-carla", str(source), "--out", str(out)]
    )
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 2
    said = capsys.readouterr().err.strip()
    assert f"{source} cannot be read as a CARLA folder or archive" in said
    assert "\n" not in said
    assert not out.exists()


TOWN = tarred({"a/Town03.xodr": ROADS}, "w")


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (tarred({"a/readme.txt": b"x"}, "w:gz"), "holds no .xodr file"),
        (tarred(FILES, "w:gz")[:700], "cannot be read as a CARLA folder or archive"),
        (b"no archive", "cannot be read as a CARLA folder or archive"),
        (tarred({"a/Broken.xodr": b"<OpenDRIVE"}, "w"), "none of its maps can be read"),
        (saved({"a/layer.tar": tarred(FILES, "w")[:4000]}), "cannot be read as a CARLA folder or"),
        (
            saved({"a/layer.tar": tarred(FILES, "w:gz")[:700]}),
            "cannot be read as a CARLA folder or",
        ),
        (saved({"a/layer.tar": tarred(FILES, "w:gz")[:30]}), "layer a/layer.tar cannot be read"),
        (saved({"blobs/sha256/bb": ZSTD}), "layer blobs/sha256/bb is compressed with zstd"),
        (ZSTD, "it is compressed with zstd"),
        (saved({"a.tar": TOWN, "b.tar": TOWN}, []), "manifest.json is needed"),
    ],
)
def test_what_holds_no_roads_is_one_sentence(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    content: bytes,
    words: str,
) -> None:
    source = tmp_path / "some.tar"
    source.write_bytes(content)
    arguments = ["map", "import-carla", str(source), "--out", str(tmp_path / "maps")]
    monkeypatch.setattr("sys.argv", ["skidpad", *arguments])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 2
    said = capsys.readouterr().err
    assert words in said
    assert str(source) in said
