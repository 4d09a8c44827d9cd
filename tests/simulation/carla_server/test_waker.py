"""A Traffic Manager that has missed its wake-up is woken through its own protocol (issue 14, item 10)."""

import asyncio

import pytest

msgpack = pytest.importorskip("msgpack", reason="needs the extra server")

from skidpad.simulation.carla_server.waker import METHOD, TRIES, Waker, rouse  # noqa: E402

TM = ["127.0.0.1", 8000]


class Clock:
    """Time as the test wants it."""

    def __init__(self):
        self.now, self.due = 0.0, []

    def later(self, delay, what):
        timer = Due(self.now + delay, what)
        self.due.append(timer)
        return timer

    def go(self, seconds):
        self.now += seconds
        for timer in [t for t in self.due if t.at <= self.now]:
            self.due.remove(timer)
            if not timer.cancelled:
                timer.what()


class Due:
    def __init__(self, at, what):
        self.at, self.what, self.cancelled = at, what, False

    def cancel(self):
        self.cancelled = True


@pytest.fixture
def clock():
    return Clock()


@pytest.fixture
def woken():
    return []


@pytest.fixture
def waker(clock, woken):
    return Waker(clock.later, woken.append, patience=2.0)


def test_silence_after_a_tick_wakes_the_traffic_managers_of_this_client(waker, clock, woken):
    waker.note_request("add_traffic_manager_running", [TM])
    waker.note_request("tick_cue", [])
    clock.go(1.9)
    assert woken == []
    clock.go(0.2)
    assert woken == [8000]


def test_what_a_traffic_manager_asks_before_it_sleeps_is_no_sign_of_its_work(waker, clock, woken):
    """It asks for settings between two cycles, often only after the program has ticked again."""
    waker.note_request("add_traffic_manager_running", [TM])
    waker.note_request("tick_cue", [])
    waker.note_request("get_episode_settings", [])
    clock.go(2.1)
    assert woken == [8000]


def test_a_client_that_goes_on_is_left_alone(waker, clock, woken):
    waker.note_request("add_traffic_manager_running", [TM])
    for _ in range(5):
        waker.note_request("tick_cue", [])
        clock.go(1.5)
        waker.note_request("apply_batch", [[], False])
        clock.go(60.0)  # the program thinks: its Traffic Manager has done its work
    assert woken == []


@pytest.mark.parametrize(
    "calls",
    [
        [],
        [("add_traffic_manager_running", [TM], False)],  # refused: it is another client's
        [("add_traffic_manager_running", [TM]), ("destroy_traffic_manager", [8000])],
        [("add_traffic_manager_running", ["x"]), ("add_traffic_manager_running", [])],
        [("add_traffic_manager_running", [["h", 99999]])],
    ],
)
def test_without_a_traffic_manager_of_its_own_a_client_is_not_watched(waker, clock, woken, calls):
    for call in calls:
        waker.note_request(*call)
    waker.note_request("tick_cue", [])
    clock.go(100.0)
    assert woken == []


def test_it_is_tried_again_and_given_up(waker, clock, woken):
    waker.note_request("add_traffic_manager_running", [TM])
    waker.note_request("tick_cue", [])
    for _ in range(3 * TRIES):
        clock.go(2.0)
    assert len(woken) == TRIES
    waker.note_request("tick_cue", [])
    waker.stop()
    clock.go(100.0)
    assert len(woken) == TRIES


def test_to_wake_is_to_leave_synchronous_mode_and_to_come_back():
    heard = []

    async def serve(reader, writer):
        unpacker = msgpack.Unpacker()
        while data := await reader.read(1000):
            unpacker.feed(data)
            for request in unpacker:
                heard.append(request)
                writer.write(msgpack.packb([1, request[1], None, None]))
        writer.close()
        await writer.wait_closed()

    async def main():
        server = await asyncio.start_server(serve, "127.0.0.1", 0)
        port = server.sockets[0].getsockname()[1]
        await asyncio.wait_for(rouse("127.0.0.1", port), 60.0)
        server.close()
        await server.wait_closed()
        await rouse("127.0.0.1", port)  # nobody is there any more

    asyncio.run(main())
    assert heard == [[0, 0, METHOD, [False]], [0, 1, METHOD, [True]]]
