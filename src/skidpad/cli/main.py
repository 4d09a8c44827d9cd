"""The command `skidpad`. Each command module is loaded when its command runs, so help is quick."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable
from typing import NoReturn

import typer

import skidpad
from skidpad.cli.campaigns.adas import adas, report, show
from skidpad.cli.campaigns.effects import effects
from skidpad.cli.campaigns.grip import grip
from skidpad.cli.carla_launcher import carla_launcher, translate_options
from skidpad.cli.channels.channels import channels
from skidpad.cli.channels.drive import drive, outcomes
from skidpad.cli.channels.evaluate import evaluate, train
from skidpad.cli.channels.hazards import hazards
from skidpad.cli.channels.monitor import monitor, safety_case
from skidpad.cli.channels.view import view
from skidpad.cli.fleet.fleet import fleet
from skidpad.cli.lookup.bench import bench
from skidpad.cli.lookup.extensions import extensions
from skidpad.cli.lookup.friction import friction
from skidpad.cli.lookup.map import maps
from skidpad.cli.lookup.profiles import profiles
from skidpad.cli.options.campaigns import CampaignOptions, Estimate
from skidpad.cli.options.help_panels import arrange_help
from skidpad.cli.options.spread import spread_fields
from skidpad.cli.runs.cockpit import drive as cockpit_drive
from skidpad.cli.runs.cockpit import replay, watch
from skidpad.cli.runs.compare import compare
from skidpad.cli.runs.dataset import export_dataset
from skidpad.cli.runs.export import export
from skidpad.cli.runs.rerun import rerun, study
from skidpad.cli.runs.shadow import shadow
from skidpad.cli.scenarios.play import play, play_folder
from skidpad.cli.scenarios.risk import risk
from skidpad.cli.scenarios.search import search
from skidpad.core.errors import InputError, SkidpadError
from skidpad.core.text.told import clean

LONGEST = 100_000  # characters of what is wrong

app = typer.Typer(
    name="skidpad",
    help="A proving ground for driving automation in bad weather.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)


def _version(wanted: bool) -> None:
    """Prints the version and ends the command where it is wanted."""
    if wanted:
        typer.echo(f"skidpad {skidpad.__version__}")
        raise typer.Exit


@app.callback()
def _root(
    version: bool = typer.Option(
        False, "--version", callback=_version, is_eager=True, help="Print the version and exit."
    ),
) -> None:
    """A proving ground for driving automation in bad weather."""


campaign = typer.Typer(name="campaign", help="About campaigns.", no_args_is_help=True)
estimate = typer.Typer(
    name="estimate",
    help="Say how long a campaign will take, from a few of its runs.",
    no_args_is_help=True,
)
campaign.add_typer(estimate)
driving, estimating = spread_fields({"how": CampaignOptions}), spread_fields({"how": Estimate})
app.command()(driving(adas))
app.command()(driving(grip))
channels.command()(driving(drive))
for name, command in (("adas", adas), ("grip", grip), ("channels", drive), ("play", play_folder)):
    estimate.command(name)(estimating(command))
app.command()(report)
app.command()(compare)
app.command()(rerun)
app.command()(shadow)
app.command()(study)
app.command()(effects)
app.command()(bench)
app.command()(show)
app.command()(export)
app.command("export-dataset")(export_dataset)
app.add_typer(profiles)
app.add_typer(maps)
app.command()(extensions)
for reader in (outcomes, evaluate, train):
    channels.command()(reader)
app.add_typer(channels)
app.add_typer(hazards)
app.add_typer(fleet)
app.command()(friction)
app.command()(play)
app.command()(search)
app.command()(risk)
app.add_typer(campaign)
app.command()(monitor)
app.command("safety-case")(safety_case)
app.command()(view)
app.command("drive")(cockpit_drive)
app.command()(replay)
app.command()(watch)
app.command()(carla_launcher)


@app.command()
def doctor() -> None:
    """Say what is installed, and what each missing part would give."""
    from skidpad.cli.lookup.doctor import doctor as show

    show()


@app.command(
    "carla-server",
    context_settings={"allow_extra_args": True, "ignore_unknown_options": True},
    add_help_option=False,
)
def carla_server(context: typer.Context) -> None:
    """Serve unmodified CARLA 0.9.16 clients: no GPU, no download."""
    from skidpad.cli.carla_server import command

    command(context.args)


@app.command(
    "carla-unreal",
    context_settings={"allow_extra_args": True, "ignore_unknown_options": True},
    add_help_option=False,
    hidden=True,
)
def carla_unreal(context: typer.Context) -> None:
    """Serve CARLA's clients with Unreal's options: what CarlaUE4.sh of carla-launcher runs."""
    from skidpad.cli.carla_server import command

    command(translate_options(context.args))


arrange_help(app)


def _on_termination(number: int, frame: object) -> NoReturn:
    """Ends the process with the exit code of the signal."""
    del frame
    raise SystemExit(128 + number)


def main() -> None:
    """Runs the command line and exits."""
    run_guarded(app)


def run_guarded(command: Callable[[], object]) -> None:
    """Runs a command; input that cannot be used ends with one sentence and exit code 2.

    Other errors of ours end with 1. SIGTERM ends it as Ctrl-C does: what is under way is dropped,
    what is done is kept.
    """
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGTERM, _on_termination)
    try:
        command()
    except InputError as error:
        typer.echo(f"skidpad: {clean(str(error), LONGEST)}", err=True)
        raise SystemExit(2) from None
    except SkidpadError as error:
        typer.echo(f"skidpad: {clean(str(error), LONGEST)}", err=True)
        raise SystemExit(1) from None
