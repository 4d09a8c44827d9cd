"""What counts as a stall, and what is waiting."""

from types import SimpleNamespace

import numpy as np
import pytest

from skidpad.campaign.channels.outcomes import STALL_TIME, STUCK_TIME, Referee
from skidpad.core.channels import Decision
from skidpad.stack.channels.route import PathPoints, RoutePath
from skidpad.stack.channels.settings import CarModel

CAR = CarModel(length=4.9, width=1.9, wheelbase=2.9, steer_max=0.6, a_drive=4.0, a_brake=9.0)


def standing(others):
    """The ego stands at x = 100 m among others (x, y, speed)."""
    x = np.array([100.0, *[o[0] for o in others]])
    y = np.array([0.0, *[o[1] for o in others]])
    vx = np.array([0.0, *[o[2] for o in others]])
    states = SimpleNamespace(
        x=x, y=y, yaw=np.zeros(len(x)), vx=vx, vy=0.0 * x, present=np.ones(len(x), dtype=bool)
    )
    return SimpleNamespace(states=states, lights={}, contacts=())


def stood_until_over(others):
    s = np.arange(500.0)
    flat = np.zeros(500)
    route = RoutePath(PathPoints(s, flat, flat, flat, flat, flat + 14.0), (), (0,), (0.0,))
    referee = Referee(route, CAR, 0.5)
    truth = standing(others)
    for k in range(1000):
        referee.observe(truth, Decision(0.5 * k, "a", "kept", (1.0,)))
        if referee.over:
            break
    return referee.stood


@pytest.mark.parametrize(
    ("others", "limit"),
    [
        ([], STALL_TIME),
        ([(107.0, 0.3, 0.0)], STUCK_TIME),  # a queue
        ([(107.0, 0.3, 3.0)], STALL_TIME),  # it drives on
        ([(107.0, 3.5, 0.0)], STALL_TIME),  # the next lane
        ([(93.0, 0.0, 0.0)], STALL_TIME),  # behind
    ],
)
def test_waiting_in_a_queue_is_no_stall(others, limit):
    assert stood_until_over(others) == pytest.approx(limit, abs=1.0)
