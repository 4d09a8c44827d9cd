"""`skidpad show RUN_DIR`: one run in the terminal: what it was, what it came to, and its crashes."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

from rich.table import Table

from skidpad.campaign.runs.folder import CONFIG
from skidpad.campaign.runs.road import load_road
from skidpad.campaign.runs.stored import read_run
from skidpad.cli.output.tables import table_console
from skidpad.core.errors import FileError
from skidpad.core.simulator import BackendKind
from skidpad.core.vocabulary import ActorKind
from skidpad.evidence.drive.collisions import shown_crashes
from skidpad.evidence.drive.metrics import run_metrics, weather_metrics
from skidpad.evidence.drive.prepared import prepare
from skidpad.evidence.drive.severity import graded_contacts
from skidpad.evidence.drive.story import tell_story
from skidpad.physics.grip import friction_ratio
from skidpad.physics.types import vehicle_types
from skidpad.recording.campaign.added_metrics import read_added_metrics
from skidpad.recording.campaign.matrix import Metrics
from skidpad.recording.campaign.results import definitions_of
from skidpad.recording.fingerprint import comparison_text, fingerprint
from skidpad.recording.run.log import RunLog
from skidpad.recording.run.log_files import driven_on, log_hash, read_log
from skidpad.recording.run.readings import read_readings, summarise_readings
from skidpad.report.crashes.cards import contact_text, headline, timeline
from skidpad.report.crashes.causes import write_cause
from skidpad.roads.queries import RoadMap


def open_run(run: Path) -> tuple[RunLog, RoadMap]:
    """Returns the log of a run's folder, and the map that it was driven on, or today's of that name."""
    log = read_log(run)
    return log, load_road(run, log.header)


def compare_runs(a: Path, b: Path) -> None:
    """Prints the metrics of two runs, of a campaign or driven by hand, and B - A.

    Raises FileError where the map has changed since.
    """
    found = []
    for run in (a, b):
        log, road_map = open_run(run)
        if road_map.content_hash != log.header.map_hash:
            raise FileError(f"{run}: the map {log.header.map} is another one today")
        found.append(asdict(run_metrics(log, road_map)))
    places = [[place] if (place := driven_on(run)) else [] for run in (a, b)]
    table_console().print(comparison_text(*places), highlight=False)
    table = Table("metric", "A", "B", "B - A", box=None, pad_edge=False)
    for name, before in found[0].items():
        after = found[1][name]
        change = None if before is None or after is None else after - before
        table.add_row(name, _text(before), _text(after), _text(change))
    table_console().print(table)


def show(run: Path) -> None:
    """Prints a run: metrics, crashes, contacts, readings, and tyre friction of each vehicle."""
    log, road_map = open_run(run)
    console = table_console()
    console.print(f"[bold]{run.name}[/] on {log.header.map}, {len(log) * log.header.dt:g} s")
    for name, value in log.header.about.items():
        console.print(f"  {name}: {value}")
    console.print(f"  content hash: {log_hash(log)}")
    places = [place] if (place := driven_on(run)) else []
    console.print(f"  here, {comparison_text(places, [fingerprint().short])}", highlight=False)
    if road_map.content_hash != log.header.map_hash:
        console.print("[yellow]the map has changed since this run: lanes may not match[/]")
    meanings = {name: meaning for name, meaning, _ in definitions_of(Metrics)}
    columns = {"value": asdict(run_metrics(log, road_map))}
    by_weather = weather_metrics(log, road_map)
    if len(by_weather) > 1:  # it changed on the way
        columns |= {f"in {slug}": asdict(metrics) for slug, metrics in by_weather.items()}
    table = Table("metric", *columns, "meaning", box=None, pad_edge=False)
    for name in columns["value"]:
        table.add_row(name, *(_text(c[name]) for c in columns.values()), meanings[name])
    for added in read_added_metrics(run):  # of the whole run
        rest = [""] * (len(columns) - 1)
        table.add_row(added.name, _text(added.value), *rest, f"{added.title}, {added.units}")
    console.print(table)
    drive = prepare(log, road_map)
    for crash in shown_crashes(drive):
        story = tell_story(drive, crash)
        console.print(f"\n[bold]{crash.t:.2f} s: {headline(crash)}[/]")
        console.print(f"  {write_cause(story)}")
        for event in timeline(story):
            style = "red" if event.is_wrong else ""
            console.print(f"  {event.time:>8}  {event.text}", style=style)
    contacts = graded_contacts(drive)
    if contacts:
        console.print("\n[bold]All contacts[/]")
    for contact in contacts:
        console.print(f"  {contact.tick * log.header.dt:8.2f} s  {contact_text(contact)}")
    show_readings(run)
    grips = vehicle_grips(run, log)
    if grips:
        console.print("\n[bold]Tyre friction of each vehicle, at standstill[/]")
        heads = ("vehicle", "type", "own", "ratio", "in this weather", "weather")
        shown = Table(*heads, box=None, pad_edge=False)
        for row in grips:
            shown.add_row(*row)
        console.print(shown)


def show_readings(run: Path) -> None:
    """Prints mean, least and largest value of recorded further sensors; nothing without any."""
    readings = read_readings(run)
    if readings is None:
        return
    table_console().print("\n[bold]Readings of further sensors and functions[/]")
    shown = Table("sensor", "type", "quantity", "mean", "least", "most", box=None, pad_edge=False)
    for row in summarise_readings(readings):
        values = (_text(v) for v in (row.mean, row.least, row.most))
        shown.add_row(row.sensor.id, row.sensor.title, row.quantity, *values)
    table_console().print(shown)


def vehicle_grips(run: Path, log: RunLog) -> list[tuple[str, ...]]:
    """Returns name, type, own friction, ratio, result and weather of each vehicle as text (B-068).

    Empty where the folder does not describe its run, or a CARLA server drove it, whose log says it.
    """
    if not (run / CONFIG).is_file():
        return []
    spec = read_run(run)
    if spec.backend.backend != BackendKind.EMBEDDED:
        return []
    ratio = friction_ratio(spec.weather, spec.grip)
    types = vehicle_types()
    return [
        (name, type_, f"{own:g}", f"{ratio:.4f}", f"{own * ratio:.4g}", spec.weather.name)
        for name, type_, kind in zip(log.table.names, log.table.types, log.table.kind, strict=True)
        if kind <= ActorKind.MOTORCYCLE and type_ in types
        for own in [types[type_].tire_friction]
    ]


def _text(value: float | None) -> str:
    """Returns a number as text with three decimals, whole ones without; "-" for None."""
    if value is None:
        return "-"
    return f"{value:g}" if isinstance(value, int) else f"{value:.3f}"
