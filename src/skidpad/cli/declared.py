"""Options that several commands take are the fields of one dataclass: declared once."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import MISSING, Field, fields
from functools import wraps
from typing import Any, get_type_hints


def taking(parameter: str, kind: type[Any]) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """The command gets an option for each field of the dataclass `kind`, and the whole as one value.

    Fields are annotated as typer asks for it: Annotated[type, typer.Option(...)].
    """
    hints = get_type_hints(kind, include_extras=True)
    names = [f.name for f in fields(kind)]

    def decorate(command: Callable[..., None]) -> Callable[..., None]:
        @wraps(command)
        def run(**given: Any) -> None:
            value = kind(**{name: given.pop(name) for name in names})
            command(**given, **{parameter: value})

        own = inspect.signature(command, eval_str=True).parameters.values()
        declared = [
            inspect.Parameter(f.name, _KEYWORD, default=_default(f), annotation=hints[f.name])
            for f in fields(kind)
        ]
        kept = [p.replace(kind=_KEYWORD) for p in own if p.name != parameter]
        parameters = [*declared, *kept]
        run.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
        run.__annotations__ = {p.name: p.annotation for p in parameters}
        return run

    return decorate


_KEYWORD = inspect.Parameter.KEYWORD_ONLY


def _default(field: Field[Any]) -> Any:
    return inspect.Parameter.empty if field.default is MISSING else field.default
