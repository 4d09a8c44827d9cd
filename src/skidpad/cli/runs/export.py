"""`skidpad export`: any run's folder as OpenSCENARIO and OpenDRIVE."""

from __future__ import annotations

from math import pi
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from skidpad.scenarios.export.version import OscVersion

if TYPE_CHECKING:
    from skidpad.recording.formats.osi import World
    from skidpad.recording.run.log import RunLog
    from skidpad.scenarios.reading.environment import Environment


def export(
    run: Annotated[Path, typer.Argument(help="A run's folder: OUT of play, or OUT/runs/NAME.")],
    out: Annotated[
        Path | None, typer.Option(help="Where to; default: RUN/scenario.", show_default=False)
    ] = None,
    osc: Annotated[
        OscVersion, typer.Option(help="1.2, or 1.0 for CARLA ScenarioRunner.")
    ] = OscVersion.V1_2,
    osi: Annotated[
        Path | None, typer.Option(help="Also a trace of OSI GroundTruth: FILE.osi (extra osi).")
    ] = None,
    osi_udp: Annotated[
        str | None,
        typer.Option(
            help="Also send that trace as UDP datagrams, at the run's pace: PORT of this machine, or "
            "ADDRESS:PORT. In parts as esmini sends them.",
        ),
    ] = None,
) -> None:
    """Write a driven run as .xosc and .xodr that other simulators replay."""
    from skidpad.cli.options.folders import require_run

    require_run(run)
    from skidpad.campaign.runs.road import road_files
    from skidpad.recording.formats.osi import send_run, write_osi
    from skidpad.recording.formats.osi_udp import read_address
    from skidpad.recording.run.log_files import read_log
    from skidpad.scenarios.export.run_export import export_run

    address = None if osi_udp is None else read_address(osi_udp)
    log = read_log(run)
    if osi is not None:
        typer.echo(f"{osi}: {write_osi(osi, log, _world(run, log))} messages")
    if address is not None:
        sent = send_run(address, log, _world(run, log))
        typer.echo(f"{address[0]}:{address[1]}: {sent} messages sent")
    folder = run / "scenario" if out is None else out
    name = run.resolve().name
    scenario, road, known = export_run(log, folder, name, road_files(run), osc, _environment(run))
    typer.echo(f"{scenario} with {road.name}")
    if not known:
        typer.echo(f"the road {log.header.map!r} is not there: a straight one lies under the run")


def _environment(run: Path) -> Environment | None:
    """Returns the weather of the run for a file; None where its description is not there."""
    from skidpad.campaign.driving.outdoors import environment_of
    from skidpad.campaign.runs.stored import read_run
    from skidpad.core.errors import InputError

    try:
        return environment_of(read_run(run.resolve()).weather)
    except InputError:
        return None


def _world(run: Path, log: RunLog) -> World:
    """Returns projection, lights and rain of the run, as far as road and description are there."""
    from skidpad.campaign.runs.road import road_files
    from skidpad.campaign.runs.stored import read_run
    from skidpad.core.errors import InputError
    from skidpad.core.geometry import Pose, wrap_angle
    from skidpad.physics.grip import rain_rate
    from skidpad.recording.formats.osi import World
    from skidpad.recording.run.lamps import read_lamps
    from skidpad.recording.run.tilts import read_tilts
    from skidpad.roads.bundled import load_map
    from skidpad.scenarios.export.osi_road import Tilt, road_truth
    from skidpad.scenarios.export.run_export import road_of

    try:
        rain = rain_rate(read_run(run.resolve()).weather)
    except InputError:
        rain = None
    lamps, tilts = read_lamps(run), read_tilts(run)
    road = road_of(log, road_files(run))
    if road is None:
        return World(rain_mm_h=rain, lamps=lamps, tilts=tilts)
    map = load_map(road)
    s = map.signals
    places = zip(
        s.id.tolist(), s.x.tolist(), s.y.tolist(), s.z.tolist(), s.heading.tolist(), strict=True
    )
    # a head looks against the traffic that it governs
    heads = {id: Pose(x, y, z, yaw=wrap_angle(heading + pi)) for id, x, y, z, heading in places}
    return World(
        map.geo_reference, road.name, heads, rain, road_truth(map), Tilt(map), lamps, tilts
    )
