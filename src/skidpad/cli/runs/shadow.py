"""`skidpad shadow`: what another driver, or another channel, would have done on the same drive."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from collections.abc import Sequence

    from skidpad.campaign.runs.shadow import Shadowed
    from skidpad.evidence.shadow import Foresight, Parting

RECORDING = ".mcap"
MOST = 20  # lines of differences
LONGEST = 5.9  # s; braking is looked for no longer before a contact


def shadow(
    run: Annotated[
        Path,
        typer.Argument(help="A run's folder, of adas, grip or play; or a recording of channels."),
    ],
    driver: Annotated[
        str | None,
        typer.Option(
            help="What rides along: reference (default), 0 to 4, or your module:Class; of a "
            "recording a channel (default: each)."
        ),
    ] = None,
    yes: Annotated[
        bool, typer.Option("--yes", help="Run the code that the folder names without asking.")
    ] = False,
) -> None:
    """Drive a stored run again with another driver in its shadow, and say where both differ.

    The shadow gets the same frames in the same world, and what it asks for changes nothing. Of a
    recording of channels the plans of those that did not drive are compared.
    """
    from skidpad.cli.options.folders import require_run

    require_run(run, RECORDING)
    if run.suffix == RECORDING:
        for line in channel_lines(run, driver):
            typer.echo(line)
        return
    from skidpad.campaign.runs.shadow import ride_along
    from skidpad.campaign.runs.stored import read_run
    from skidpad.cli.options.asked import Drivers

    driver = driver or "reference"
    drivers = Drivers(stack=driver) if ":" in driver else Drivers(configs=driver)
    (found,) = drivers.find_drivers()
    spec = read_run(run)
    for foreign in spec.foreign_code:
        if not yes:
            typer.confirm(f"{run} names {foreign}, which would be run; go on?", abort=True)
    shadowed = ride_along(run, found)
    for line in lines(shadowed, spec.driver.label, found.label):
        typer.echo(line)
    if not shadowed.same:
        typer.echo(
            "this is another drive than the stored one: libraries or code have changed", err=True
        )
        raise typer.Exit(1)


def channel_lines(recording: Path, channel: str | None) -> list[str]:
    """Returns lines on how the plans of channels differ from the driving one's; None: of each channel."""
    from skidpad.core.errors import require_choice
    from skidpad.evidence.channels.shadow import plans_of
    from skidpad.evidence.shadow import partings, share_apart
    from skidpad.recording.channels.cycles import cycles
    from skidpad.recording.channels.mcap_files import McapRecording

    source = McapRecording(recording, truth=False)
    if channel is not None:
        require_choice("channel", channel, source.channels)
    told: list[str] = []
    for name in source.channels if channel is None else (channel,):
        t, driving, riding = plans_of(cycles(source), source.channels.index(name))
        apart = partings(t, driving, riding)
        told += story("the driving channel", name, share_apart(driving, riding), apart)
    return told


def lines(found: Shadowed, driver: str, shadow: str) -> list[str]:
    """Returns lines on what both did, first before contacts, then in order of time."""
    head, *rest = story(driver, shadow, found.share_apart, found.partings)
    return [head, *(_before(event, driver, shadow) for event in found.contacts), *rest]


def story(driver: str, shadow: str, share: float, partings: Sequence[Parting]) -> list[str]:
    """Returns lines on how long one braked without the other, and the first MOST stretches of it.

    share: of time, 0 to 1.
    """
    alone = f"one braked without the other {100.0 * share:.1f} % of the time"
    told = [f"{shadow} in the shadow of {driver}: {alone}"]
    for one in partings[:MOST]:
        name = shadow if one.shadow_brakes else driver
        told += [f"{one.begin:.2f} to {one.end:.2f} s: {name} brakes alone"]
    if len(partings) > MOST:
        told += [f"and {len(partings) - MOST} more"]
    return told


def _before(event: Foresight, driver: str, shadow: str) -> str:
    """Returns a line on a contact: how long before each of both had braked."""
    both = f"{driver} {_ahead(event.driver)}, {shadow} {_ahead(event.shadow)}"
    return f"contact at {event.t:.2f} s: {both}"


def _ahead(seconds: float | None) -> str:
    """Returns how many s before the contact it braked, as words; None: not at all."""
    if seconds is None:
        return "did not brake"
    return f"braked {'at least ' if seconds > LONGEST else ''}{seconds:.2f} s before"
