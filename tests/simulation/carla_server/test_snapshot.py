from __future__ import annotations

import struct

from skidpad.simulation.carla_server import snapshot
from skidpad.simulation.carla_server.clock import Clock, EpisodeSettings
from skidpad.simulation.carla_server.snapshot import Rows


def test_rows_have_the_clients_packed_layout() -> None:
    rows = Rows()
    rows.add(7)
    row = rows.vehicles[0]
    row["pose"] = (1, 2, 3, 4, 5, 6)
    row["speed_limit"], row["light_state"], row["has_light"], row["light_id"] = 90.0, 2, 1, 77
    data = rows.tobytes()
    assert len(data) == 119
    assert struct.unpack_from("<IB6f", data) == (7, 1, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0)
    assert struct.unpack_from("<fBBI", data, 84) == (90.0, 2, 1, 77)


def test_a_light_shares_the_row() -> None:
    rows = Rows()
    rows.add(1)
    rows.lights["sign"][0] = b"1001"
    rows.lights["times"][0] = (10, 3, 2, 0.5)
    rows.lights["shown"][0] = 2
    data = rows.tobytes()
    assert data[65:69] == b"1001"
    assert struct.unpack_from("<4f", data, 97) == (10.0, 3.0, 2.0, 0.5)
    assert data[118] == 2


def test_rows_grow_and_close_gaps() -> None:
    rows = Rows()
    for actor in range(600):
        assert rows.add(actor) == actor
    rows.remove(10)
    order = rows.order()
    assert rows.count == 599
    assert order[11] == 10
    assert rows.vehicles["id"][: rows.count].tolist() == [i for i in range(600) if i != 10]


def test_a_message_says_what_the_clock_says() -> None:
    clock = Clock(episode=3, frame=12, elapsed=0.6, settings=EpisodeSettings(fixed_step=0.05))
    data = snapshot.message(clock, Rows(), 1.25, snapshot.MAP_CHANGED)
    kind, frame, time = struct.unpack_from("<QQd", data)
    assert (kind, frame, time) == (17, 12, 0.6)
    id, wall, delta, *_, bits = struct.unpack_from("<Qdf3iI", data, 48)
    assert (id, wall, bits) == (3, 1.25, 1)
    assert delta == struct.unpack("<f", struct.pack("<f", 0.05))[0]
    assert len(data) == 48 + 36
