"""The order in which help shows commands and options: by what they are for, with one example each."""

from __future__ import annotations

import typer
from typer.models import CommandInfo, TyperInfo

# panel: command: its example
COMMANDS: dict[str, dict[str, str]] = {
    "Drive a campaign": {
        "adas": "adas --sensors objects --seeds 10 --out out/mine",
        "grip": "grip --scenarios front_accident --seeds 20 --out out/grip",
        "search": "search lead_slowdown --vary LeadS=110:140 --vary Deceleration=2:9 --out out/search",
        "risk": "risk lead_slowdown --vary 'LeadS=normal(128,6,100:160)' --out out/risk",
        "study": "study F-08 --seeds 10",
        "effects": "effects --stack 2 --weather rain-noon --seeds 10",
        "campaign": "campaign estimate adas --sensors objects --seeds 50",
        "export-dataset": "export-dataset --weather rain-night --seeds 3 --out out/images",
    },
    "Drive one run": {
        "drive": "drive --weather rain-night",
        "play": "play front_accident --weather icy_30 --out out/played",
        "rerun": "rerun out/mine/runs/3_rain-night-001 --from 20 --to 30",
    },
    "Read results": {
        "report": "report out/mine",
        "show": "show out/mine/runs/3_rain-night-001",
        "replay": "replay out/mine/runs/3_rain-night-001",
        "shadow": "shadow out/mine/runs/3_rain-night-001 --driver reference",
        "watch": "watch out/mine",
        "compare": "compare out/before out/after --fail-if 'interventions > 0.1'",
        "export": "export out/mine/runs/3_rain-night-001",
    },
    "Channels and fleet": {
        "channels": "channels drive --route route-1 --hours 0.2 --out out/channels",
        "monitor": "monitor drive.mcap --out out/monitored",
        "hazards": "hazards list out/monitored",
        "safety-case": "safety-case out/monitored",
        "view": "view drive.mcap",
        "fleet": "fleet demo --recorded",
    },
    "Look something up": {
        "friction": "friction --preset rain_60",
        "map": "map info figure8",
        "profiles": "profiles diff recommended thesis_text",
        "bench": "bench tick",
        "extensions": "extensions sensors",
        "doctor": "doctor",
    },
    "CARLA": {
        "carla-server": "carla-server --port 2000 --map figure8",
        "carla-launcher": "carla-launcher out/carla",
    },
}
SUBCOMMANDS = (  # an example of each
    "profiles list",
    "profiles sensors",
    "profiles show recommended",
    "profiles diff recommended thesis_text",
    "map list",
    "map info figure8",
    "map bake road.xodr",
    "map import-carla ~/CARLA_0.9.16",
    "channels info drive.mcap",
    "channels compare out/monitored out/again",
    "channels drive --route route-1 --hours 0.2 --out out/channels",
    "channels outcomes out/channels out/one-channel",
    "channels evaluate out/monitored",
    "channels train out/channels --out model.npz",
    "hazards list out/monitored",
    "hazards show out/monitored",
    "hazards export out/monitored",
    "fleet serve --data fleet",
    "fleet enrol operator Ann --tenant 'Red Cabs' --data fleet",
    "fleet end operator Ann --tenant 'Red Cabs' --data fleet",
    "fleet open --to http://127.0.0.1:8470 --token-file ann.token",
    "fleet upload out/monitored --spool spool --to http://127.0.0.1:8470 --token-file v1.token",
    "fleet drive --to http://127.0.0.1:8470 --token-file v1.token --orders-key orders.pub --out out/v1",
    "fleet keys --manufacturer Axle --data fleet --out offline",
    "fleet sign rules.yaml --kind rules --list list.json --key offline/targets-1.key --out next.json",
    "fleet certificate --out certificates",
    "fleet demo --recorded",
    "campaign estimate adas --sensors objects --seeds 50",
    "campaign estimate grip --scenarios front_accident",
    "campaign estimate channels --route route-1 --hours 10",
    "campaign estimate play scenarios",
)
# options of a command by the parameter that they make up
OPTIONS = {
    "how": "Campaign",
    "driving": "Campaign",
    "drivers": "Driver",
    "ego": "Driver",
    "crew": "Driver",
    "climate": "Weather",
    "cross": "Variations",
    "run": "Run",
    "tuned": "Run",
    "roads": "Road and traffic",
    "scenario": "Scenario",
    "expected": "Verdicts",
    "varied": "Search",
    "encounters": "Encounters",
    "backend": "Simulator",
    "pages": "Page",
    "map": "Threshold map",
    "links": "Links to other programs",
}


def arrange_help(app: typer.Typer) -> None:
    """Sets the panel and the example of every command that COMMANDS names, and examples of SUBCOMMANDS."""
    places = {name: (panel, text) for panel, of in COMMANDS.items() for name, text in of.items()}
    for info in _commands_of(app):
        panel, text = places.get(name_of(info), (None, None))
        if panel is not None:
            info.rich_help_panel = panel
            info.epilog = f"Example: skidpad {text}"
        if isinstance(info, TyperInfo):
            _set_examples(info, name_of(info))


def _commands_of(app: typer.Typer) -> list[CommandInfo | TyperInfo]:
    """Returns the commands and groups of commands that are right below `app`."""
    return [*app.registered_commands, *app.registered_groups]


def _set_examples(group: TyperInfo, path: str) -> None:
    """Sets the example of each command below a group; path: the words by which the group is called."""
    assert group.typer_instance is not None
    for info in _commands_of(group.typer_instance):
        name = f"{path} {name_of(info)}"
        if isinstance(info, TyperInfo):
            _set_examples(info, name)
        for text in SUBCOMMANDS:
            if f"{text} ".startswith(f"{name} ") and isinstance(info, CommandInfo):
                info.epilog = f"Example: skidpad {text}"


def name_of(info: CommandInfo | TyperInfo) -> str:
    """Returns the name by which a command is called."""
    if isinstance(info, TyperInfo):
        assert info.typer_instance is not None
        return str(info.typer_instance.info.name)
    assert info.callback is not None
    return info.name or info.callback.__name__.replace("_", "-")
