"""`skidpad shadow`: what another driver would have done, on the same drive."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from skidpad.campaign.shadow import Shadowed

MOST = 20  # lines of differences
LONGEST = 5.9  # s; braking is looked for no longer before a contact


def shadow(
    run: Annotated[Path, typer.Argument(help="A run's folder, of adas, grip or play.")],
    driver: Annotated[
        str, typer.Option(help="Who rides along: reference, 0 to 4, or your module:Class.")
    ] = "reference",
    yes: Annotated[
        bool, typer.Option("--yes", help="Run the code that the folder names without asking.")
    ] = False,
) -> None:
    """Drive a stored run again with another driver in its shadow, and say where both differ.

    The shadow gets the same frames in the same world, and what it asks for changes nothing.
    """
    from skidpad.cli.folders import require_run

    require_run(run)
    from skidpad.campaign.shadow import ride_along
    from skidpad.campaign.stored import read_run
    from skidpad.cli.asked import Drivers

    drivers = Drivers(stack=driver) if ":" in driver else Drivers(configs=driver)
    (found,) = drivers.chosen()
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


def lines(found: Shadowed, driver: str, shadow: str) -> list[str]:
    """What both did, first before contacts, then in order of time."""
    alone = 100.0 * found.share_apart
    told = [
        f"{shadow} in the shadow of {driver}: one braked without the other {alone:.1f} % of the time"
    ]
    for event in found.contacts:
        both = f"{driver} {_ahead(event.driver)}, {shadow} {_ahead(event.shadow)}"
        told += [f"contact at {event.t:.2f} s: {both}"]
    for one in found.partings[:MOST]:
        name = shadow if one.shadow_brakes else driver
        told += [f"{one.begin:.2f} to {one.end:.2f} s: {name} brakes alone"]
    if len(found.partings) > MOST:
        told.append(f"and {len(found.partings) - MOST} more")
    return told


def _ahead(seconds: float | None) -> str:
    if seconds is None:
        return "did not brake"
    return f"braked {'at least ' if seconds > LONGEST else ''}{seconds:.2f} s before"
