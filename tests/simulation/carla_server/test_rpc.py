from __future__ import annotations

import random
from typing import Any

import msgpack
import pytest

from skidpad.simulation.carla_server.methods import TABLES
from skidpad.simulation.carla_server.protocol.codec import Request
from skidpad.simulation.carla_server.protocol.rpc import CallError, Dispatcher, Shape, Table
from skidpad.simulation.carla_server.served import Served


def asked(dispatcher: Dispatcher, method: str, *arguments: Any) -> Any:
    kind, msgid, error, result = msgpack.unpackb(
        dispatcher.answer(Request(9, method, list(arguments), True))
    )
    assert (kind, msgid) == (1, 9)
    return error if error is not None else result


def small() -> Dispatcher:
    table = Table("test")

    @table.method("double")
    def double(_: Any, x: int) -> int:
        return 2 * x

    @table.method("fail", Shape.VOID)
    def fail(_: Any) -> None:
        raise CallError("no")

    @table.method("crash")
    def crash(_: Any) -> None:
        raise ZeroDivisionError

    return Dispatcher(None, [table])


def test_results_and_errors_are_wrapped_as_the_client_unwraps_them() -> None:
    dispatcher = small()
    assert asked(dispatcher, "double", 4) == [[1, 8]]
    assert asked(dispatcher, "fail") == [[True, ["no"]]]
    assert asked(dispatcher, "double") == [[0, ["double takes 1 arguments"]]]


def test_a_failing_handler_is_that_calls_answer() -> None:
    assert "internal error" in asked(small(), "crash")[0][1][0]


def test_unknown_calls_are_counted_and_answered_in_the_error_field() -> None:
    dispatcher = small()
    assert "nonsense" in asked(dispatcher, "nonsense")
    assert dispatcher.unknown == {"nonsense": 1}


def test_unknown_names_do_not_fill_memory() -> None:
    dispatcher = small()
    for i in range(3000):
        asked(dispatcher, f"method{i}")
    assert len(dispatcher.unknown) == 1000


def _any_value(rng: random.Random, depth: int = 0) -> Any:
    plain = [0, 1, -1, 2**63, 1.5, float("nan"), float("inf"), True, None, "", "x", b"\x00" * 24]
    if depth < 3 and rng.random() < 0.5:
        return [_any_value(rng, depth + 1) for _ in range(rng.randint(0, 5))]
    return rng.choice(plain)


@pytest.mark.parametrize("seed", range(4))
def test_random_arguments_to_every_call_get_an_answer(seed: int, served: Served) -> None:
    dispatcher = Dispatcher(served, TABLES)
    rng = random.Random(seed)
    for name, method in sorted(dispatcher.methods.items()):
        for _ in range(12):
            count = rng.randint(method.fewest, min(method.most, method.fewest + 3))
            answer = asked(dispatcher, name, *(_any_value(rng) for _ in range(count)))
            assert "internal error" not in str(answer), (name, answer)
    assert len(served.episode.actors) < 200
