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
from typing import Annotated, Any, get_args, get_type_hints

import typer
from msgspec import NODEFAULT, Meta, Struct, structs

from skidpad.core.run import PARTED

Command = Callable[..., Any]


def spread(
    kinds: Mapping[str, type[Struct]] | None = None, **defaults: Any
) -> Callable[[Command], Command]:
    """Spread the command's Struct parameters into options, with these defaults over the fields'.

    kinds: what a parameter is, by name, whose hint leaves it open.
    """

    def decorate(command: Command) -> Command:
        hints = get_type_hints(command, include_extras=True)
        groups: dict[str, type[Struct]] = {}
        parameters: list[inspect.Parameter] = []
        for parameter in inspect.signature(command).parameters.values():
            hint = (kinds or {}).get(parameter.name, hints[parameter.name])
            if isinstance(hint, type) and issubclass(hint, Struct):
                groups[parameter.name] = hint
                parameters += described(hint, defaults)
            else:
                kind = inspect.Parameter.KEYWORD_ONLY
                parameters.append(parameter.replace(annotation=hint, kind=kind))
        return _gathering(command, groups, parameters)

    return decorate


def described(kind: type[Struct], defaults: dict[str, Any]) -> list[inspect.Parameter]:
    """A parameter for every field of `kind` that has a description."""
    hints = get_type_hints(kind, include_extras=True)
    found = []
    for field in structs.fields(kind):
        meta = next((m for m in get_args(hints[field.name])[1:] if isinstance(m, Meta)), None)
        if meta is None or meta.description is None:
            continue
        own = inspect.Parameter.empty if field.default is NODEFAULT else field.default
        default = defaults.get(field.name, own)
        annotation = _option(field.name, get_args(hints[field.name])[0], meta)
        found.append(
            inspect.Parameter(
                field.name,
                inspect.Parameter.KEYWORD_ONLY,
                default=_shown(default, meta),
                annotation=annotation,
            )
        )
    return found


def _shown(default: Any, meta: Meta) -> Any:
    """A default as typer takes it."""
    if not isinstance(default, tuple):
        return default
    return ",".join(default) if meta.extra == PARTED else list(default)


def _option(name: str, kind: Any, meta: Meta) -> Any:
    flag = [f"--{name.replace('_', '-')}"] if kind is bool else []  # without a --no-...
    option = typer.Option(*flag, help=meta.description, min=meta.ge, max=meta.le)
    if kind == tuple[str, ...]:
        kind = str if meta.extra == PARTED else list[str]
    return Annotated[kind, option]


def _gathering(
    command: Command, groups: dict[str, type[Struct]], parameters: list[inspect.Parameter]
) -> Command:
    """The command with these parameters, which gathers them into its Structs again."""
    names = {name: [p.name for p in described(kind, {})] for name, kind in groups.items()}

    def call(**values: Any) -> Any:
        given = {
            name: kind(**{n: _read(kind, n, values.pop(n)) for n in names[name]})
            for name, kind in groups.items()
        }
        return command(**values, **given)

    call.__name__, call.__doc__ = command.__name__, command.__doc__
    call.__module__ = command.__module__
    call.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    call.__annotations__ = {p.name: p.annotation for p in parameters}
    return call


def _read(kind: type[Struct], name: str, value: Any) -> Any:
    """An option's value as the field holds it."""
    if get_args(get_type_hints(kind, include_extras=True)[name])[0] != tuple[str, ...]:
        return value
    words = value.split(",") if isinstance(value, str) else value
    return tuple(word.strip() for word in words if word.strip())
