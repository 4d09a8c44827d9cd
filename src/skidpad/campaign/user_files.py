"""What a campaign's folder keeps of its user's own files, so that nothing else need stay where it was.

A run names a map file as the folder keeps it, `maps/<content>/<name>.xodr`: so the run value says
what the file contains and not where it lies.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from msgspec import structs

from skidpad.core.courses import Edges, Roads, Route
from skidpad.core.errors import ConfigError
from skidpad.core.files.reading import is_file
from skidpad.core.kernels.jit import user_cache
from skidpad.core.run import RunSpec
from skidpad.recording.files import write_bytes
from skidpad.roads.bundled import KEPT, bundled_maps, kept_name, load_map, map_file


def road_file(course: Roads) -> str:
    """Returns the map of a course as it is driven; with rails where asked for and none stand.

    Such a map is made once, in the user's cache. ConfigError for a baked map.
    """
    if course.edges is Edges.NONE or load_map(course.map).roadside.barriers:
        return course.map
    from skidpad.roads.opendrive.rails import VERSION, add_rails  # lxml is needed for this only

    file = map_file(course.map)
    if file.suffix == ".npz":
        raise ConfigError(f"--edges rail needs an OpenDRIVE file, and {file} is a baked one")
    content = Path(kept_name(file)).parent.name
    made = user_cache() / "railed" / f"{content}-{VERSION}" / file.name
    if not made.is_file():
        write_bytes(made, add_rails(file.read_bytes(), str(file)))
    return str(made)


def keep_maps(tasks: Sequence[RunSpec]) -> tuple[list[RunSpec], dict[str, Path]]:
    """Returns the runs with maps named as the folder keeps them, and the files by these names.

    Bundled maps keep their names and are not kept.
    """
    names: dict[str, str] = {}
    files: dict[str, Path] = {}
    out = []
    for task in tasks:
        course = task.course
        if not isinstance(course, (Roads, Route)):
            out.append(task)
            continue
        asked = road_file(course) if isinstance(course, Roads) else course.map
        if asked not in names:
            names[asked] = asked
            if asked not in bundled_maps():
                names[asked] = kept_name(map_file(asked))
                files[names[asked]] = map_file(asked)
        out.append(_on(task, names[asked]))
    return out, files


def keep_files(folder: Path, files: Mapping[str, Path]) -> None:
    """Copies to `folder` the files (by name there) that are not there yet."""
    for name, file in files.items():
        target = folder / name
        if not target.is_file():
            write_bytes(target, file.read_bytes())


def keep_road(folder: Path, road: str) -> None:
    """Copies the road file of a scenario that was played to `folder`, unless it is bundled."""
    if road not in bundled_maps():
        keep_files(folder, {kept_name(Path(road)): Path(road)})


def with_kept_map(run: RunSpec, folder: Path) -> RunSpec:
    """Returns the run with the map that the campaign in `folder` keeps of it, else unchanged."""
    if not isinstance(run.course, (Roads, Route)) or not is_file(folder / run.course.map):
        return run
    return _on(run, str(folder / run.course.map))


def found_again(run: RunSpec, folder: Path | None) -> RunSpec:
    """Returns the run with the map that `folder` keeps, when its own is gone since; else unchanged.

    Unchanged also where several maps of that name are kept.
    """
    course = run.course
    if folder is None or not isinstance(course, (Roads, Route)):
        return run
    file = Path(course.map)
    if course.map in bundled_maps() or is_file(file) or not file.suffix:
        return run
    there = sorted((folder / KEPT).glob(f"*/{file.name}"))
    return _on(run, str(there[0])) if len(there) == 1 else run


def _on(run: RunSpec, map: str) -> RunSpec:
    """Returns the run on another file of the map."""
    assert isinstance(run.course, (Roads, Route))
    return structs.replace(run, course=structs.replace(run.course, map=map))
