"""`skidpad drive`, `replay` and `watch`: the cockpit in a browser (extra `cockpit`)."""

from __future__ import annotations

from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from msgspec import Meta, Struct, structs

from skidpad.cli.options.asked import Climate, Drivers, Tuned
from skidpad.cli.options.spread import spread_fields
from skidpad.core.courses import Roads, Scenario
from skidpad.core.errors import ConfigError, FileError
from skidpad.core.run import RunSpec
from skidpad.core.setup import VEHICLES_MAX
from skidpad.core.simulator import BackendChoice, BackendKind
from skidpad.core.vocabulary import Bodywork, Quality, Scenery, TrafficStart

if TYPE_CHECKING:
    from skidpad.cockpit.source import Source
    from skidpad.cockpit.studio import Looks
    from skidpad.pages.server import Place


RESERVE = 20  # vehicles to call in, where nothing else is said


class Pages(Struct, frozen=True, kw_only=True):
    """Where the page is served."""

    page_port: Annotated[int, Meta(ge=0, le=65535, description="Of the page; 0: any free one.")] = 0
    page_host: Annotated[
        str, Meta(description="Address of the page; others than 127.0.0.1 let others in.")
    ] = "127.0.0.1"
    no_browser: Annotated[bool, Meta(description="Print the address, open nothing.")] = False


class Sheet(Struct, frozen=True, kw_only=True):
    """A picture of one moment in place of the page."""

    picture: Annotated[
        Path | None,
        Meta(description="Write the moment --at as a picture (.png, .jpg or .webp), no page."),
    ] = None
    weather: Annotated[
        str | None,
        Meta(
            description="Of the picture, one for each: all, or presets and YAML files parted by commas; "
            "default: as it was."
        ),
    ] = None
    drops: Annotated[bool, Meta(description="The picture also with rain drops on the lens.")] = (
        False
    )

    def write(self, source: Source, views: list[str], at: float | None, looks: Looks) -> Path:
        """Writes the picture of the moment at s, None: the opening one, and returns its path."""
        from skidpad.cockpit.sheet import Shots, write_sheet
        from skidpad.cockpit.source import index_at, opening_tick
        from skidpad.cockpit.studio import View
        from skidpad.core.setup import DT

        assert self.picture is not None
        weathers = () if self.weather is None else Climate(self.weather).find_weathers()
        moment = index_at(source, opening_tick(source) if at is None else round(at / DT))
        shots = Shots([View(v) for v in views], weathers, self.drops)
        return write_sheet(source, moment, shots, self.picture, looks)


class OnClose(str, Enum):
    """Values that the option --on-close takes."""

    GO_ON = "go-on"
    PAUSE = "pause"


@spread_fields(
    duration=3600.0,
    traffic=TrafficStart.PACK,  # a lead is in sight from the first second on
    scenery=Scenery.FULL,
    bodywork=Bodywork.SHAPED,
)
def drive(
    context: typer.Context,
    drivers: Drivers,
    run: RunSpec,
    roads: Roads,
    tuned: Tuned,
    backend: BackendChoice,
    pages: Pages,
    weather: Annotated[str, typer.Option(help="A preset or a YAML file.")] = "rain-noon",
    seed: Annotated[int, typer.Option(help="Of traffic and noise.")] = 1,
    scenario: Annotated[
        str,
        typer.Option(help="An OpenSCENARIO file, or a name of the catalogue, instead of roads."),
    ] = "",
    more: Annotated[
        int | None,
        typer.Option(
            min=0, max=VEHICLES_MAX, help="Vehicles that can be called in; default: up to 20."
        ),
    ] = None,
    rate: Annotated[float, typer.Option(help="Times real time; 0: as fast as it can.")] = 1.0,
    paused: Annotated[bool, typer.Option("--paused", help="Begin standing.")] = False,
    gc_in_pause: Annotated[
        bool, typer.Option(help="Collect garbage between ticks only, not at any moment.")
    ] = True,
    on_close: Annotated[
        OnClose, typer.Option(help="What the drive does when the page is closed.")
    ] = OnClose.GO_ON,
    out: Annotated[
        Path | None, typer.Option(help="Folder of the run; default: out/drives/<name>, numbered.")
    ] = None,
) -> None:
    """Drive in a browser, in rain behind a lead: watch the stack or take over; keeps a run."""
    from skidpad.cli.options.carla_backend import check_backend
    from skidpad.physics.presets import find_weather
    from skidpad.roads.map_files import require_map

    if backend.backend == BackendKind.CARLA and is_default(context, "traffic"):
        roads = structs.replace(roads, traffic=TrafficStart.FIXED)  # a CARLA server keeps no pack
    chosen = drivers.find_drivers() if drivers != Drivers() else Drivers(configs="3").find_drivers()
    if len(chosen) != 1:
        raise ConfigError(f"one driver at a time, got {len(chosen)}")
    spec = structs.replace(
        tuned.resolve(run),
        driver=chosen[0],
        course=Scenario(file=scenario) if scenario else with_reserve(roads, backend, more),
        weather=find_weather(weather),
        seed=seed,
        backend=check_backend(backend),
    )
    if isinstance(spec.course, Roads) and spec.backend.backend != BackendKind.CARLA:
        require_map(spec.course.map)
        tuned.require_surface_on(spec.course, spec.surface)
    from skidpad.cockpit.about import About
    from skidpad.cockpit.driving import about, drive_job
    from skidpad.cockpit.parts import list_parts
    from skidpad.cockpit.producer import Producer
    from skidpad.cockpit.serving import serve
    from skidpad.recording.files import next_free, require_free
    from skidpad.simulation.carla.options import Optimisation

    require_place(spec)
    folder = next_free(Path("out/drives") / spec.name) if out is None else require_free(out)
    own_gc = gc_in_pause and Optimisation.GC_IN_PAUSE.value not in backend.without
    producer = Producer(drive_job, about(spec, folder, rate, paused, own_gc))
    course = spec.course
    most = course.vehicles + course.reserve if isinstance(course, Roads) else 0
    pauses = on_close is OnClose.PAUSE
    shown = About("drive", vehicles=most, pauses=pauses, parts=list_parts(spec))
    typer.echo(serve(producer, shown, place_of(pages), typer.echo, not pages.no_browser))


def is_default(context: typer.Context, option: str) -> bool:
    """Returns True when a command was given without this option."""
    source = context.get_parameter_source(option)
    return source is not None and source.name == "DEFAULT"


def require_place(spec: RunSpec) -> None:
    """Raises an error for a file or map that cannot be driven, before a page is opened.

    A CARLA server's map is not checked.
    """
    from skidpad.campaign.driving.course_file import load_scenario
    from skidpad.campaign.user_files import road_file
    from skidpad.roads.bundled import load_map

    if isinstance(spec.course, Scenario):
        load_scenario(spec.course)
    elif isinstance(spec.course, Roads) and spec.backend.backend != BackendKind.CARLA:
        load_map(road_file(spec.course))


def with_reserve(roads: Roads, backend: BackendChoice, more: int | None) -> Roads:
    """Returns the course with `more` vehicles to call in, None: up to RESERVE; none on a CARLA server.

    Raises ConfigError for more than fit, or any on a CARLA server.
    """
    room = VEHICLES_MAX - roads.vehicles
    if more is not None and more > room:
        raise ConfigError(
            f"--more must be at most {room} beside {roads.vehicles} vehicles, got {more}"
        )
    if backend.backend == BackendKind.CARLA:
        if more:
            raise ConfigError(f"--more must be 0 on a CARLA server, got {more}")
        return roads
    return structs.replace(roads, reserve=min(room, RESERVE) if more is None else more)


@spread_fields()
def replay(
    run: Annotated[
        Path,
        typer.Argument(
            help="A run's folder, a recording of channels (.mcap), or a monitor's folder."
        ),
    ],
    pages: Pages,
    sheet: Sheet,
    beside: Annotated[
        Path | None, typer.Option(help="Another run, shown beside it in step.")
    ] = None,
    hazard: Annotated[
        str | None, typer.Option("--id", help="Which hazard of a monitor's folder.")
    ] = None,
    at: Annotated[
        float | None,
        typer.Option(min=0.0, help="s, where it begins; default: before the worst crash."),
    ] = None,
    film: Annotated[
        Path | None, typer.Option(help="Write a film (.mp4 or .webp) instead of a page.")
    ] = None,
    begin: Annotated[float, typer.Option("--from", help="s, of the film.")] = 0.0,
    end: Annotated[float, typer.Option("--to", help="s, of the film.")] = 10.0,
    view: Annotated[
        str,
        typer.Option(
            help="driver, follow, top or crash, and every small view; of a picture several, "
            "parted by commas."
        ),
    ] = "follow",
    scenery: Annotated[
        Scenery,
        typer.Option(help="Beside the roads in the pictures, whatever the run had: full or none."),
    ] = Scenery.FULL,
    bodywork: Annotated[
        Bodywork,
        typer.Option(help="Of vehicles and people in the pictures, whatever the run had."),
    ] = Bodywork.SHAPED,
    quality: Annotated[
        Quality, typer.Option(help="Of the pictures: draft takes less time, whatever the run had.")
    ] = Quality.FULL,
) -> None:
    """Scrub through a run in a browser: its pictures are drawn again from what was logged."""
    from skidpad.cli.options.folders import require_run

    for folder in filter(None, (run, beside)):
        require_run(folder, ".mcap", "hazards.txt")
    from skidpad.cockpit.about import About
    from skidpad.cockpit.again import list_changes
    from skidpad.cockpit.film import stretch_of, write_film
    from skidpad.cockpit.opening import open_source
    from skidpad.cockpit.parts import list_parts
    from skidpad.cockpit.producer import Producer
    from skidpad.cockpit.replay import RecordedRun
    from skidpad.cockpit.replaying import replay_job
    from skidpad.cockpit.serving import serve
    from skidpad.cockpit.source import timeline
    from skidpad.cockpit.studio import Looks, View
    from skidpad.core.errors import require_choice

    if sheet.picture is None and (sheet.drops or sheet.weather is not None):
        raise ConfigError("--weather and --drops are of a picture: give it with --picture FILE.png")
    source = open_source(run, hazard)
    other = None if beside is None else open_source(beside)
    looks, known = Looks(scenery, bodywork, quality), [v.value for v in View]
    if sheet.picture is not None:
        views = [require_choice("--view", v.strip(), known) for v in view.split(",")]
        typer.echo(sheet.write(source, views, at, looks))
        return
    if film is not None:
        seen = View(require_choice("--view", view, known))
        typer.echo(write_film(source, stretch_of(source, begin, end), seen, film, other, looks))
        return
    what = {
        "path": str(run),
        "hazard": hazard,
        "at": at,
        "beside": None if beside is None else str(beside),
        "scenery": scenery.value,
        "bodywork": bodywork.value,
        "quality": quality.value,
    }
    producer = Producer(replay_job, what)
    parts = list_parts(source.spec) if isinstance(source, RecordedRun) else ()
    shown = About("replay", timeline(source), again=list_changes(source), parts=parts)
    typer.echo(serve(producer, shown, place_of(pages), typer.echo, not pages.no_browser))


@spread_fields()
def watch(
    folder: Annotated[Path, typer.Argument(help="A campaign's folder, running or finished.")],
    pages: Pages,
    once: Annotated[bool, typer.Option("--once", help="Print how it stands and end.")] = False,
) -> None:
    """Watch a campaign while it runs: progress, results with intervals, a film of the worst crash."""
    if not folder.is_dir():
        raise FileError(f"{folder} is not the folder of a campaign")
    from skidpad.cockpit.watching import lines, serve_watch, standing

    if once:
        typer.echo("\n".join(lines(standing(folder))))
        return
    serve_watch(folder, place_of(pages), typer.echo, browser=not pages.no_browser)


def place_of(pages: Pages) -> Place:
    """Returns host and port at which the pages are served."""
    from skidpad.pages.server import Place

    return Place(host=pages.page_host, port=pages.page_port)
