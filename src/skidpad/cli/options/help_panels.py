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
    """Sets the panel and the example of every command that COMMANDS names."""
    places = {name: (panel, text) for panel, of in COMMANDS.items() for name, text in of.items()}
    commands: list[CommandInfo | TyperInfo] = [*app.registered_commands, *app.registered_groups]
    for info in commands:
        panel, text = places.get(name_of(info), (None, None))
        if panel is not None:
            info.rich_help_panel = panel
            info.epilog = f"Example: skidpad {text}"


def name_of(info: CommandInfo | TyperInfo) -> str:
    """Returns the name by which a command is called."""
    if isinstance(info, TyperInfo):
        assert info.typer_instance is not None
        return str(info.typer_instance.info.name)
    assert info.callback is not None
    return info.name or info.callback.__name__.replace("_", "-")
