"""Batches: what follows a spawned actor, and what is refused before anything is spawned."""

from __future__ import annotations

from typing import Any

import pytest

from skidpad.simulation.carla_server.methods.batch import apply_batch
from skidpad.simulation.carla_server.options import ServerOptions
from skidpad.simulation.carla_server.protocol import wire
from skidpad.simulation.carla_server.protocol.streams import StreamHub
from skidpad.simulation.carla_server.served import Served

CAR = "vehicle.tesla.model3"


@pytest.fixture(scope="module")
def served() -> Served:
    return Served(ServerOptions(map="figure8"), StreamHub())


def spawning(served: Served, point: int, after: Any) -> list[Any]:
    place = wire.transform(served.episode.map.spawn_points[point])
    return [[0, [[1, CAR, []], place, [False], 0, "", after]]]


@pytest.mark.parametrize("body", [[0, ["no control"]], [0], [0, [[1.0, 2.0], [0.0, 0.0, 0.0]]]])
def test_a_command_after_a_spawned_actor_that_cannot_be_done_is_skipped(
    served: Served, body: list[Any]
) -> None:
    point = len(served.episode.vehicles)
    after = [[[6, body]], [[15, [0, True]]]]
    ((kind, id),) = apply_batch(served, [spawning(served, point, after)], False)[0]
    assert (kind, id in served.episode.vehicles) == (1, True)


@pytest.mark.parametrize("after", [7, [7], [[[99, []]]], [[[0, []]]], [[[6, 7]]]])
def test_what_is_no_command_is_refused_before_anything_is_spawned(
    served: Served, after: Any
) -> None:
    before = len(served.episode.vehicles)
    ((kind, _),) = apply_batch(served, [spawning(served, before, after)], False)[0]
    assert (kind, len(served.episode.vehicles)) == (0, before)
