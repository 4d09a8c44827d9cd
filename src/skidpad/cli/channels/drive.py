"""`skidpad channels drive`: drive channels over routes and record what they say."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from msgspec import structs

from skidpad.cli.options.campaigns import How
from skidpad.cli.options.spread import spread_fields
from skidpad.core.run import ChannelCrew
from skidpad.core.simulator import BackendChoice
from skidpad.live.settings import Links


@spread_fields()
def drive(
    how: How,
    crew: ChannelCrew,
    backend: BackendChoice,
    links: Links,
    route: Annotated[str, typer.Option(help="One of the six routes, or all.")] = "all",
    hours: Annotated[
        float, typer.Option(help="Hours in total, split equally among the routes.")
    ] = 1.0,
    seed: Annotated[
        int, typer.Option(help="First seed; different numbers give disjoint seeds.")
    ] = 0,
    map: Annotated[
        Path | None, typer.Option(help="Drive on this map (.xodr) instead of the route's own.")
    ] = None,
    conditions: Annotated[
        str, typer.Option(help="Light and weather, parted by commas: own, day, night, rain, ice.")
    ] = "own",
    strata: Annotated[
        str, typer.Option(help="Background drivers, parted by commas: natural, risky.")
    ] = "natural",
    mind_weather: Annotated[
        bool, typer.Option(help="Background drivers mind rain, grip and sight.")
    ] = True,
) -> None:
    """Drive channels over routes on a simulator; one recording per ten minutes."""
    from skidpad.campaign.channels.routes import Condition, chosen_routes
    from skidpad.cli.options.carla_backend import check_backend, drives_alone
    from skidpad.core.errors import require_choice
    from skidpad.core.vocabulary import Stratum

    routes = chosen_routes(
        route,
        map,
        [Condition(require_choice("condition", c, [*Condition])) for c in conditions.split(",")],
        [Stratum(require_choice("stratum", s, [*Stratum])) for s in strata.split(",")],
        mind_weather,
    )
    from skidpad.campaign.campaign import Campaign
    from skidpad.campaign.channels.world import route_of
    from skidpad.campaign.recipes.channels import recipe_with_links, segments
    from skidpad.campaign.user_files import found_again, keep_maps
    from skidpad.roads.bundled import load_map
    from skidpad.sensors.channels.presets import senses_of

    for name in crew.channels:
        senses_of(name)
    routes = [found_again(chosen, how.folder) for chosen in routes]
    for chosen in routes:
        load_map(route_of(chosen).map)
    template = structs.replace(routes[0], driver=crew, seed=seed, backend=check_backend(backend))
    tasks, files = keep_maps(segments(routes, hours, template))
    # topics and the scene's port are one drive's at a time
    alone = drives_alone(template.backend) or bool(links.publish)
    campaign = Campaign(recipe_with_links(links), tasks, alone=alone, files=files)
    summary = how(campaign, totals)
    if summary is not None and summary.failed:
        raise typer.Exit(1)


def totals(folder: Path) -> str:
    """Writes the pages of monitored drives; returns what driven segments came to, and the next command."""
    import polars as pl

    from skidpad.core.text.wording import count_text
    from skidpad.live.outcome import LINK
    from skidpad.recording.campaign.results import read_results

    _write_pages(folder)
    driven = read_results(folder).drop_nulls("driven_s")
    sums = driven.select(pl.col(pl.Float64, pl.Int64).sum()).row(0, named=True)
    watched = "".join(
        f"\n{_describe_monitor(link.parent)}" for link in sorted(folder.glob(f"*/*/{LINK}"))
    )
    recording = next(iter(sorted(folder.glob("*/*.mcap"))), "FILE.mcap")
    return (
        f"{folder}: {count_text(len(driven), 'segment')}, {sums['driven_s'] / 3600.0:.2f} h, "
        f"{sums['distance_m'] / 1000.0:.1f} km, {count_text(sums['collisions'], 'collision')}, "
        f"{count_text(sums['red_lights_run'], 'red light')} run, "
        f"{count_text(sums['stalls'], 'stall')}{watched}\n"
        f"Next: skidpad monitor {recording} --out {folder / 'monitored'}"
    )


def _write_pages(folder: Path) -> None:
    """Writes the page of every drive whose monitor came to its end."""
    from skidpad.recording.channels.monitored import SUMMARY

    for summary in sorted(folder.glob(f"*/*.monitor/{SUMMARY}")):
        from skidpad.report.channels.page import write_drive_report

        write_drive_report(summary.parent)


def _describe_monitor(folder: Path) -> str:
    """Returns what became of a monitor beside its drive, in one line."""
    from skidpad.evidence.channels.timing import LIVE_TIMES, delay_sentence
    from skidpad.live.outcome import read_outcome
    from skidpad.recording.channels.monitored import read_timing

    times = read_timing(folder, LIVE_TIMES)
    delay = "" if times is None else f"; {delay_sentence(times)}"
    return f"{folder.name}: {read_outcome(folder).sentence}{delay}"


def outcomes(
    folders: Annotated[list[Path], typer.Argument(help="Folders of `skidpad channels drive`.")],
) -> None:
    """Compare drivers over the routes and seeds that all have driven: does redundancy pay?"""
    from skidpad.core.errors import FileError
    from skidpad.recording.channels.drives import read_outcomes

    driven = read_outcomes(folders)
    if not driven:
        raise FileError(
            f"no driven segments below {', '.join(map(str, folders))}; give folders that `skidpad "
            "channels drive` wrote to"
        )
    from skidpad.core.text.wording import count_text
    from skidpad.evidence.channels.redundancy import compare_drivers
    from skidpad.evidence.statistics_text import rate_text

    for row in compare_drivers(driven):
        typer.echo(
            f"{row.drive_by}: {count_text(row.segments, 'segment')}, {row.hours:.2f} h, {row.km:.1f} km"
        )
        for event, rate in row.rates.items():
            typer.echo(f"  {event}: {rate.events}, {rate_text(rate, 'segment', 'h')}")
