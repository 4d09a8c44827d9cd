"""`skidpad grip`: what changes when weather also changes grip, in thousands of paired runs."""

from __future__ import annotations

from enum import Enum
from typing import Annotated

import typer
from msgspec import structs

from skidpad.cli.asked import Controller, GripCross, Tuned
from skidpad.cli.campaigns import How, Seeds
from skidpad.cli.spread import spread
from skidpad.core.run import BackendChoice, RunSpec, Scenario
from skidpad.core.vocabulary import SensorLevel


class Keep(str, Enum):
    """Whose whole logs stay."""

    SHOWN = "shown"
    ALL = "all"


@spread(sensors=SensorLevel.OBJECTS, duration=120.0)
def grip(
    how: How,
    cross: GripCross,
    controller: Controller,
    run: RunSpec,
    scenario: Scenario,
    tuned: Tuned,
    backend: BackendChoice,
    seeds: Seeds = 100,
    keep: Annotated[
        Keep, typer.Option(help="shown: logs of runs in the report; all: of every run.")
    ] = Keep.SHOWN,
) -> None:
    """Drive scenarios x weathers x frictions x seeds; prints the path of the report."""
    from skidpad.campaign.campaign import Campaign
    from skidpad.campaign.grip import recipe
    from skidpad.cli.carla_backend import checked, drives_alone
    from skidpad.cli.grip_plan import plan_grip, with_model
    from skidpad.report.grip import write_grip_report

    run = structs.replace(
        with_model(run, tuned, cross.model),
        driver=controller.chosen(),
        course=scenario,
        backend=checked(backend),
    )
    cells = plan_grip(cross, run, seeds)
    how(
        Campaign(recipe(keep is Keep.ALL), cells, alone=drives_alone(run.backend)),
        write_grip_report,
    )
