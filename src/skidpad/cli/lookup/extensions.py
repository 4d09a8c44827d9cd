"""`skidpad extensions`: what can be added to Skidpad, and what is registered."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from skidpad.core.objects.registry import Registry

OF_FLEET = "relays"


def extensions(
    kind: Annotated[
        str, typer.Argument(help="One kind alone, e.g. sensors; none: all kinds.")
    ] = "",
) -> None:
    """List what packages can add, what is registered, and which package added it."""
    from skidpad.core.errors import ConfigError, install_command, require_choice

    points = extension_points()
    names = [registry.group.partition(".")[2] for registry in points]
    if kind == OF_FLEET and kind not in names:
        raise ConfigError(f"relays belong to the fleet; install it with {install_command('fleet')}")
    chosen = [require_choice("kind", kind, names)] if kind else names
    for name, registry in zip(names, points, strict=True):
        if name not in chosen:
            continue
        typer.echo(f"{name} (entry points {registry.group})")
        for source in registry.sources().values():
            entry = source.load()
            units = getattr(entry, "units", "")
            by = "" if source.package == "skidpad" else f"  [package {source.package}]"
            unit = f" ({units})" if units else ""
            typer.echo(f"  {entry.name:<21} {entry.title}{unit}{by}")


def extension_points() -> tuple[Registry[Any], ...]:
    """Returns every registry that installed packages can add to, as help and docs show them."""
    from skidpad.core.sensor_types import SENSORS
    from skidpad.core.simulator import BACKENDS
    from skidpad.evidence.channels.indicators.catalogue import INDICATORS
    from skidpad.evidence.drive.added import METRICS
    from skidpad.physics.presets import WEATHERS
    from skidpad.roads.map_files import MAPS
    from skidpad.scenarios.registry import SCENARIO_NAMES
    from skidpad.stack.functions import FUNCTIONS

    points = (SENSORS, FUNCTIONS, METRICS, INDICATORS, WEATHERS, MAPS, SCENARIO_NAMES, BACKENDS)
    try:
        from skidpad.fleet.alerting.relay_types import RELAYS
    except ImportError:  # the optional part `fleet` is not installed
        return points
    return (*points, RELAYS)
