"""Options of a command from values: a parameter that is a Struct becomes an option per described field.

    class RunSpec(Struct):
        duration: Annotated[float, Meta(gt=0.0, description="Simulated seconds.")] = 500.0
        seed: int = 1                                          # no description, no option

    @spread(duration=60.0)                                     # another default for this command
    def command(out: Path, run: RunSpec) -> None: ...          # takes --out and --duration

So an option is declared once, beside the field that it sets, and every command that takes the value
takes the option.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from enum import Enum
from math import inf
from typing import Annotated, Any, NamedTuple, get_args, get_type_hints

import typer
from msgspec import NODEFAULT, Meta, Struct, structs

from skidpad.cli.options.help_panels import OPTIONS
from skidpad.core.errors import require_choice, require_range
from skidpad.core.run import PARTED

Command = Callable[..., Any]


def spread_fields(
    kinds: Mapping[str, type[Struct]] | None = None, **defaults: Any
) -> Callable[[Command], Command]:
    """Returns a decorator that spreads a command's Struct parameters into options.

    kinds: what a parameter is, by name, whose hint leaves it open. defaults: over those of fields.
    """

    def decorate(command: Command) -> Command:
        hints = get_type_hints(command, include_extras=True)
        groups: dict[str, type[Struct]] = {}
        parameters: list[inspect.Parameter] = []
        for parameter in inspect.signature(command).parameters.values():
            hint = (kinds or {}).get(parameter.name, hints[parameter.name])
            if isinstance(hint, type) and issubclass(hint, Struct):
                groups[parameter.name] = hint
                parameters += describe_parameters(hint, defaults, OPTIONS.get(parameter.name))
            else:
                kind = inspect.Parameter.KEYWORD_ONLY
                parameters.append(parameter.replace(annotation=hint, kind=kind))
        return _gathering(command, groups, parameters)

    return decorate


class Described(NamedTuple):
    """A field that has a description, so that it is an option."""

    name: str
    kind: Any
    meta: Meta
    default: Any


def _describe_fields(kind: type[Struct]) -> dict[str, Described]:
    """Returns the fields of a struct that have a description, by name."""
    hints = get_type_hints(kind, include_extras=True)
    found = {}
    for field in structs.fields(kind):
        plain, *about = get_args(hints[field.name]) or (hints[field.name],)
        meta = next((m for m in about if isinstance(m, Meta)), None)
        if meta is not None and meta.description is not None:
            own = inspect.Parameter.empty if field.default is NODEFAULT else field.default
            found[field.name] = Described(field.name, plain, meta, own)
    return found


def describe_parameters(
    kind: type[Struct], defaults: dict[str, Any], panel: str | None = None
) -> list[inspect.Parameter]:
    """Returns a parameter for every field of `kind` that has a description; panel: heading in help."""
    return [
        inspect.Parameter(
            field.name,
            inspect.Parameter.KEYWORD_ONLY,
            default=_format_default(defaults.get(field.name, field.default), field.meta),
            annotation=_option(field, panel),
        )
        for field in _describe_fields(kind).values()
    ]


def _format_default(default: Any, meta: Meta) -> Any:
    """Returns a default as typer takes it: enums by value, tuples as a list or with commas."""
    if isinstance(default, Enum):
        return default.value
    if not isinstance(default, tuple):
        return default
    return ",".join(default) if meta.extra == PARTED else list(default)


def _option(field: Described, panel: str | None) -> Any:
    """Returns a field's annotation for typer, as plain as it can be, since `_read` checks the value."""
    name, kind, meta, _ = field
    flags = [_flag(name)] if kind is bool else []  # without a --no-...
    words = _words(kind)
    metavar = f"<{'|'.join(words)}>" if words else None
    if words:
        kind = str
    elif kind == tuple[str, ...]:
        kind = str if meta.extra == PARTED else list[str]
    option = typer.Option(*flags, help=meta.description, metavar=metavar, rich_help_panel=panel)
    return Annotated[kind, option]


def _flag(name: str) -> str:
    """Returns the flag of an option from its field name."""
    return f"--{name.replace('_', '-')}"


def _words(kind: Any) -> list[str]:
    """Returns the values of an enum, [] for any other type."""
    return [m.value for m in kind] if isinstance(kind, type) and issubclass(kind, Enum) else []


def _gathering(
    command: Command, groups: dict[str, type[Struct]], parameters: list[inspect.Parameter]
) -> Command:
    """Returns the command with these parameters, which gathers them into its Structs again."""
    fields = {name: _describe_fields(kind) for name, kind in groups.items()}

    def call(**values: Any) -> Any:
        given = {
            name: kind(**{n: _read(f, values.pop(n)) for n, f in fields[name].items()})
            for name, kind in groups.items()
        }
        return command(**values, **given)

    call.__name__, call.__doc__ = command.__name__, command.__doc__
    call.__module__ = command.__module__
    call.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    call.__annotations__ = {p.name: p.annotation for p in parameters}
    return call


def _read(field: Described, value: Any) -> Any:
    """Returns an option's value as the field holds it; ConfigError for one that it does not allow."""
    name, wanted, meta, _ = field
    if wanted == tuple[str, ...]:
        words = value.split(",") if isinstance(value, str) else value
        return tuple(word.strip() for word in words if word.strip())
    if words := _words(wanted):
        return wanted(require_choice(_flag(name), value, words))
    if value is not None and (meta.ge is not None or meta.le is not None):
        low, high = (-inf if meta.ge is None else meta.ge), (inf if meta.le is None else meta.le)
        require_range(_flag(name), value, low, high)
    return value
