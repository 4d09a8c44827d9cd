"""Method tables by topic, and the one place where a call becomes an answer."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from enum import Enum
from inspect import Parameter, signature
from typing import Any, TypeVar

from skidpad.core.errors import SkidpadError
from skidpad.simulation.carla_server.protocol import codec
from skidpad.simulation.carla_server.protocol.codec import Request

log = logging.getLogger("skidpad.carla_server")
Handler = Callable[..., Any]
H = TypeVar("H", bound=Handler)
ANY_NUMBER = 32  # of arguments, for calls that do not look at them


class Shape(Enum):
    """How a result is wrapped."""

    VALUE = "value"  # Response<T>
    VOID = "void"  # Response<void>
    PLAIN = "plain"  # as it is: apply_batch


@dataclass(frozen=True, slots=True)
class Method:
    """One call that clients may make."""

    name: str
    topic: str
    handler: Handler
    shape: Shape
    fewest: int  # arguments
    most: int
    without_effect: str  # decision X-15: what is accepted but not done; "" when it acts


class Table:
    """The methods of one topic; handlers take the world and the call's arguments."""

    def __init__(self, topic: str) -> None:
        self.topic = topic
        self.methods: dict[str, Method] = {}

    def method(
        self, name: str, shape: Shape = Shape.VALUE, without_effect: str = ""
    ) -> Callable[[H], H]:
        """Returns a decorator that registers a handler under the protocol's name and returns it unchanged.

        without_effect: why nothing is done, logged at the first call; "" when it acts.
        """

        def register(handler: H) -> H:
            given = list(signature(handler).parameters.values())[1:]
            single = [p for p in given if p.kind is not Parameter.VAR_POSITIONAL]
            needed = [p for p in single if p.default is Parameter.empty]
            most = len(single) if len(single) == len(given) else ANY_NUMBER
            self.methods[name] = Method(
                name, self.topic, handler, shape, len(needed), most, without_effect
            )
            return handler

        return register


class CallError(SkidpadError):
    """A call that cannot be done; its text is what the client raises."""


class Dispatcher:
    """Answers requests from the merged tables; whatever a request does, it returns bytes."""

    def __init__(self, world: Any, tables: Iterable[Table]) -> None:
        self.world = world
        self.methods: dict[str, Method] = {}
        for table in tables:
            self.methods.update(table.methods)
        self.unknown: dict[str, int] = {}  # by method name: how often it was called
        self.ineffective: set[str] = set()

    def answer(self, request: Request) -> bytes:
        """Returns the bytes that answer one request, whatever happens: a failure is that client's answer."""
        method = self.methods.get(request.method)
        if method is None:
            return self._answer_unknown(request)
        if method.without_effect and method.name not in self.ineffective:
            self.ineffective.add(method.name)
            log.info("%s is accepted without effect: %s", method.name, method.without_effect)
        try:
            if not method.fewest <= len(request.arguments) <= method.most:
                raise CallError(f"{method.name} takes {method.most} arguments")
            result = method.handler(self.world, *request.arguments)
            return codec.answer(request.msgid, _wrap_result(method.shape, result))
        except SkidpadError as error:
            return codec.answer(request.msgid, _wrap_error(method.shape, str(error)))
        except Exception as error:
            log.exception("%s failed", method.name)
            return codec.answer(
                request.msgid,
                _wrap_error(method.shape, f"{method.name}: internal error: {error!r}"),
            )

    def _answer_unknown(self, request: Request) -> bytes:
        """Counts a call that is not served, logs it once and returns the error answer."""
        name = request.method[:80]
        if name not in self.unknown and len(self.unknown) < 1000:
            log.warning("unknown call %s", name)
        if name in self.unknown or len(self.unknown) < 1000:
            self.unknown[name] = self.unknown.get(name, 0) + 1
        return codec.failure(request.msgid, f"skidpad does not serve the call {name!r}")


def _wrap_result(shape: Shape, result: Any) -> Any:
    """Returns a result as on the wire: [[False]] for VOID, unchanged for PLAIN, else [[1, result]]."""
    if shape is Shape.VOID:
        return [[False]]
    return result if shape is Shape.PLAIN else [[1, result]]


def _wrap_error(shape: Shape, message: str) -> Any:
    """Returns an error as on the wire: [[True, [message]]] for VOID, else [[0, [message]]]."""
    return [[True, [message]]] if shape is Shape.VOID else [[0, [message]]]
