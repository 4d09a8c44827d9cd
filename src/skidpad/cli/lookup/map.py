"""`skidpad map`: what maps there are, what is on them, and baking."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from skidpad.core.text.wording import count_text

if TYPE_CHECKING:
    from skidpad.roads.queries import RoadMap
    from skidpad.roads.summary import MapSummary

maps = typer.Typer(name="map", help="Bundled and own maps.", no_args_is_help=True)

SPEEDS_KMH = (80.0, 150.0)  # the matrix drives at 80, its limiter ends at 150
BENDS_SHOWN, IDS_SHOWN = 20, 40


@maps.command("list")
def list_() -> None:
    """Name the maps that come with Skidpad, and those that installed packages make."""
    from skidpad.roads.bundled import bundled_maps, load_map
    from skidpad.roads.map_files import MAPS

    for name in bundled_maps():
        map = load_map(name)
        driving = map.arrays.drivable == 1
        typer.echo(f"{name}: {map.lanes.length[driving].sum() / 1000.0:.1f} km of driving lanes")
    for source in MAPS.foreign_entries():
        setting = f":SETTING ({source.units})" if source.units else ""
        typer.echo(f"{source.name}{setting}: {source.title}")


@maps.command()
def info(
    map: Annotated[
        str, typer.Argument(help="Name of a map (skidpad map list), or an OpenDRIVE file.")
    ],
    png: Annotated[Path | None, typer.Option(help="Also write a picture from above.")] = None,
) -> None:
    """Print roads, lanes, signals, limits, and the grip that bends ask for."""
    from skidpad.cli.output.pictures import format_of, write_picture
    from skidpad.roads.map_files import map_file

    map_file(map)
    if png is not None:
        format_of(png)  # before work
    from skidpad.roads.bundled import load_map
    from skidpad.roads.summary import summarise

    loaded = load_map(map)
    summary = summarise(loaded)
    for line in _facts(loaded, summary):
        typer.echo(line)
    labels = _road_labels(map)
    typer.echo(_ids(labels))
    for line in _bends(summary):
        typer.echo(line)
    if summary.dead_ends:
        typer.echo(_dead_ends(summary, labels))
    if png is not None:
        from skidpad.roads.plan_view import draw

        write_picture(png, partial(draw, loaded))
        typer.echo(f"picture: {png}")


@maps.command()
def bake(
    file: Annotated[Path, typer.Argument(help="An OpenDRIVE file.")],
    out: Annotated[
        Path | None, typer.Option(help="Where to write; default: beside it, as .npz.")
    ] = None,
) -> None:
    """Turn an OpenDRIVE file into a baked map, which loads in milliseconds."""
    from skidpad.recording.files import write_atomically
    from skidpad.roads.bundled import bake_file

    baked = bake_file(file)
    target = out or file.with_suffix(".npz")
    write_atomically(target, baked.save)
    typer.echo(f"{target}: {len(baked.samples.x)} samples, content hash {baked.content_hash()}")


@maps.command("import-carla")
def import_carla(
    source: Annotated[
        Path,
        typer.Argument(
            help="A CARLA folder, its .tar.gz or .zip, or an image saved by `docker save`."
        ),
    ],
    out: Annotated[Path, typer.Option(help="The folder to write to.")] = Path("carla-maps"),
) -> None:
    """Take the road files out of your own CARLA, for `skidpad carla-server --maps`."""
    from skidpad.core.errors import FileError, OutputError, SkidpadError
    from skidpad.core.text.told import clean
    from skidpad.recording.files import write_bytes
    from skidpad.roads.carla_import import find_road_files
    from skidpad.roads.opendrive.bake import bake
    from skidpad.roads.queries import RoadMap

    found = find_road_files(source)
    files = {name: out / f"{name}.xodr" for name in found.contents}
    there = [file for file in files.values() if file.exists() or file.is_symlink()]
    if there:
        raise OutputError(f"{there[0]} exists already; choose another --out")
    for words in found.left_out:
        typer.echo(f"not taken: {clean(words)}")
    taken = []
    for name, content in found.contents.items():
        try:
            roads = RoadMap(bake(content, name))
        except SkidpadError as error:
            typer.echo(f"not taken: {error}")
            continue
        write_bytes(files[name], content)
        length = roads.lanes.length[roads.arrays.drivable == 1].sum() / 1000.0
        typer.echo(f"{files[name]}: {length:.1f} km of driving lanes")
        taken.append(name)
    if not taken:
        raise FileError(f"{source}: none of its maps can be read")
    typer.echo(f"serve them: skidpad carla-server --maps {out} --map {taken[0]}")


def _road_labels(map: str) -> dict[int, str]:
    """Returns the ids of the roads as the file writes them, by our numbers; none of a baked map."""
    from skidpad.roads.bundled import map_file
    from skidpad.roads.opendrive.document import parse

    file = map_file(map)
    if file.suffix == ".npz":
        return {}
    roads = parse(file.read_bytes(), str(file)).roads
    return {number: road.label for number, road in roads.items()}


def _ids(labels: dict[int, str]) -> str:
    """Returns the line that names the roads."""
    if not labels:
        return "road ids: not in a baked map; see the OpenDRIVE file"
    more = f" and {len(labels) - IDS_SHOWN} more" if len(labels) > IDS_SHOWN else ""
    return f"road ids: {', '.join(list(labels.values())[:IDS_SHOWN])}{more}"


def _dead_ends(summary: MapSummary, labels: dict[int, str]) -> str:
    """Returns the warning of driving lanes that lead nowhere."""
    found = summary.dead_ends
    ends = ", ".join(f"road {labels.get(road, road)} lane {lane}" for road, lane in found[:10])
    lanes = "1 driving lane leads" if len(found) == 1 else f"{len(found)} driving lanes lead"
    return f"warning: {lanes} nowhere: {ends}"


def _facts(map: RoadMap, summary: MapSummary) -> list[str]:
    """Returns the facts on a map as lines of text."""
    lengths = ", ".join(
        f"{kind.name.lower()} {length / 1000.0:.2f} km"
        for kind, length in summary.lane_length.items()
    )
    signals = ", ".join(
        f"{count} {kind.name.lower().replace('_', ' ')}" for kind, count in summary.signals.items()
    )
    limits = ", ".join(f"{limit * 3.6:.0f}" for limit in summary.limits)
    side = map.roadside
    return [
        f"map {map.name}",
        f"content hash {map.content_hash}",
        ", ".join(
            (
                count_text(summary.roads, "road"),
                count_text(summary.lanes, "lane"),
                count_text(summary.junctions, "junction"),
            )
        ),
        f"lanes: {lengths}",
        f"signals: {signals or 'none'}",
        f"limits in km/h: {limits or 'none given'}",
        f"steepest grade: {100.0 * summary.steepest:.1f} %",
        (
            f"roadside: {len(side.barriers)} barriers, {len(side.boxes)} boxes, "
            f"{len(side.heads)} light heads, {len(side.crosswalks)} crosswalks"
        ),
    ]


def _bends(summary: MapSummary) -> list[str]:
    """Returns a table of the tightest bends with the grip that they need, as lines of text."""
    if not summary.bends:
        return ["no bend tighter than R 300 outside junctions"]
    grips = "".join(f"  grip at {v:.0f} km/h" for v in SPEEDS_KMH)
    lines = [f"{'road':>6} {'s from':>8} {'s to':>8} {'R':>7} {'limit':>6}{grips}"]
    for bend in summary.bends[:BENDS_SHOWN]:
        limit = "-" if bend.limit is None else f"{bend.limit * 3.6:.0f}"
        needs = "".join(
            f"{bend.grip(v / 3.6):>{len(f'  grip at {v:.0f} km/h')}.2f}" for v in SPEEDS_KMH
        )
        lines.append(
            f"{bend.road:>6} {bend.s_from:>8.1f} {bend.s_to:>8.1f} {bend.radius:>7.1f} {limit:>6}{needs}"
        )
    if len(summary.bends) > BENDS_SHOWN:
        lines.append(f"and {len(summary.bends) - BENDS_SHOWN} wider bends")
    return lines
