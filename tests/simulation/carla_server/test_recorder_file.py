"""The recorder's files are CARLA's, byte for byte: assembled here by hand from CARLA's documentation."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

from skidpad.simulation.carla_server.actors.walkers import WalkerControl
from skidpad.simulation.carla_server.episode import Wanted
from skidpad.simulation.carla_server.methods.actors import get_actor_definitions
from skidpad.simulation.carla_server.options import ServerOptions
from skidpad.simulation.carla_server.protocol import wire
from skidpad.simulation.carla_server.protocol.rpc import CallError
from skidpad.simulation.carla_server.protocol.streams import StreamHub
from skidpad.simulation.carla_server.recording import packets
from skidpad.simulation.carla_server.recording.packets import Added, Packet
from skidpad.simulation.carla_server.recording.recorder import Recorder
from skidpad.simulation.carla_server.served import Served
from skidpad.simulation.carla_server.vehicles.control import Control

NAME = "by_hand.log"
CONTACT = (0, 7, 2**32 - 1, True, False)


def text(value: str) -> bytes:
    """Section 1 of the documentation: the length, then the characters."""
    return struct.pack("<H", len(value)) + value.encode()


def packet(id: int, data: bytes) -> bytes:
    """Section 3: id and size of the data, then the data."""
    return struct.pack("<BI", id, len(data)) + data


def counted(id: int, *records: bytes) -> bytes:
    """A packet that begins with the number of its records."""
    return packet(id, struct.pack("<H", len(records)) + b"".join(records))


HEAD = (
    struct.pack("<H", 1)
    + text("CARLA_RECORDER")
    + struct.pack("<q", 1_764_237_600)
    + text("Town06")
)
CAR = struct.pack("<IB3f3fI", 7, 1, 100.0, -200.0, 50.0, 0.0, 1.5, 90.0, 26) + text(
    "vehicle.seat.leon"
)
CAR += struct.pack("<H", 2)
CAR += struct.pack("<B", 2) + text("number_of_wheels") + text("4")
CAR += struct.pack("<B", 4) + text("role_name") + text("hero")
WALKER = struct.pack("<IB3f3fI", 8, 2, 300.0, 0.0, 0.0, 0.0, 0.0, 0.0, 31)
WALKER += text("walker.pedestrian.0001") + struct.pack("<H", 0)
LIGHT = struct.pack("<IB3f3fI", 3, 3, 10.0, 20.0, 0.0, 0.0, 0.0, 0.0, 0)
LIGHT += text("traffic.traffic_light") + struct.pack("<H", 0)
RAIN = [60.0, 80.0, 50.0, 10.0, 0.0, 45.0, 20.0, 0.75, 0.1, 90.0, 1.0, 0.03, 0.0331, 0.0]


def body(x: float) -> tuple[bytes, ...]:
    """What every frame has: places, lights, controls, walkers, lamps."""
    return (
        counted(6, struct.pack("<I3f3f", 7, x, -200.0, 50.0, 0.0, 1.5, 90.0),
                struct.pack("<I3f3f", 8, 300.0, 0.0, 0.0, 0.0, 0.0, 0.0)),
        counted(7, struct.pack("<I?fb", 3, False, 2.5, 2)),
        counted(8, struct.pack("<I3f?i", 7, 0.25, 0.5, 0.0, False, 2)),
        counted(9, struct.pack("<If", 8, 140.0)),
        counted(10, struct.pack("<II", 7, 0x2 | 0x10)),
    )  # fmt: skip


FRAMES = (
    packet(0, struct.pack("<Qdd", 1, 0.05, 0.0)),
    counted(2, CAR, WALKER, LIGHT),
    counted(3),
    counted(4, struct.pack("<II", 8, 7)),
    counted(5),
    *body(100.0),
    counted(24, struct.pack("<14f", *RAIN)),
    packet(1, b""),
    packet(0, struct.pack("<Qdd", 2, -1.0, 0.05)),
    counted(2),
    counted(3, struct.pack("<I", 8)),
    counted(4),
    counted(5, struct.pack("<III??", *CONTACT)),
    *body(150.0),
    packet(1, b""),
)
FILE = HEAD + b"".join(FRAMES)

# by hand, from the wording of CarlaRecorderQuery.cpp
SAID = """Version: 1
Map: Town06
Date: 11/27/25 10:00:00

Frame 1 at 0 seconds
 Create 7: vehicle.seat.leon (1) at (100, -200, 50)
  number_of_wheels = 4
  role_name = hero
 Create 8: walker.pedestrian.0001 (2) at (300, 0, 0)
 Create 3: traffic.traffic_light (3) at (10, 20, 0)
 Parenting 8 with 7 (parent)
 Positions: 2
  Id: 7 Location: (100, -200, 50) Rotation: (0, 1.5, 90)
  Id: 8 Location: (300, 0, 0) Rotation: (0, 0, 0)
 State traffic lights: 1
  Id: 3 state: 2 frozen: 0 elapsedTime: 2.5
 Vehicle animations: 1
  Id: 7 Steering: 0.25 Throttle: 0.5 Brake: 0 Handbrake: 0 Gear: 2
 Walker animations: 1
  Id: 8 speed: 140
 Vehicle light animations: 1
  Id: 7 LowBeam RightBlinker
 Weathers: 1
  Cloudiness: 60 Precipitation: 80 PrecipitationDeposits: 50 WindIntensity: 10 SunAzimuthAngle: 0 \
SunAltitudeAngle: 45 FogDensity: 20 FogDistance: 0.75 FogFalloff: 0.1 Wetness: 90 \
ScatteringIntensity: 1 MieScatteringScale: 0.03 RayleighScatteringScale: 0.0331 DustStorm: 0
Frame 2 at 0.05 seconds
 Destroy 8
 Collision id 0 between 7 (hero)  with 4294967295
 Positions: 2
  Id: 7 Location: (150, -200, 50) Rotation: (0, 1.5, 90)
  Id: 8 Location: (300, 0, 0) Rotation: (0, 0, 0)
"""


@pytest.fixture
def recorder(tmp_path: Path) -> Recorder:
    (tmp_path / NAME).write_bytes(FILE)
    return Recorder(tmp_path)


def test_a_file_made_by_hand_is_told_in_carlas_words(recorder: Recorder) -> None:
    said = recorder.summary(NAME, show_all=True)
    assert said.startswith(SAID)
    assert said.endswith("\nFrames: 2\nDuration: 0.05 seconds\n")
    events = recorder.summary(NAME)
    assert " Destroy 8\n" in events
    assert "Positions" not in events
    assert "vehicle.seat.leon" in recorder.collisions(NAME, "h", "o")
    assert "vehicle.seat.leon" not in recorder.collisions(NAME, "w", "a")


def test_what_is_written_are_the_bytes_of_the_documentation() -> None:
    car = Added(
        7, 1, (100.0, -200.0, 50.0), (0.0, 1.5, 90.0), "vehicle.seat.leon",
        ((2, "number_of_wheels", "4"), (4, "role_name", "hero")), 26,
    )  # fmt: skip
    assert packets.pack_head("Town06", 1_764_237_600) == HEAD
    assert packets.pack_added([car]) == counted(2, CAR)
    place = (7, (100.0, -200.0, 50.0), (0.0, 1.5, 90.0))
    still = (8, (300.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    rows = {
        Packet.POSITION: [place, still],
        Packet.TRAFFIC_LIGHT: [(3, False, 2.5, 2)],
        Packet.VEHICLE: [(7, 0.25, 0.5, 0.0, False, 2)],
        Packet.WALKER: [(8, 140.0)],
        Packet.VEHICLE_LIGHT: [(7, 0x2 | 0x10)],
    }
    assert tuple(packets.pack_records(p, r) for p, r in rows.items()) == body(100.0)
    assert packets.pack_records(Packet.COLLISION, [CONTACT]) == FRAMES[16]
    assert packets.pack_records(Packet.WEATHER, [(RAIN,)]) == FRAMES[10]
    assert packets.pack_records(Packet.EVENT_DEL, [(8,)]) == counted(3, struct.pack("<I", 8))
    begun = packets.pack_start(1, 0.0)
    at = packets.DURATION_AT
    assert begun[:at] + packets.pack_duration(0.05) + begun[at + 8 :] == FRAMES[0]
    assert packets.pack_end() == FRAMES[-1]


def test_packets_of_unknown_kinds_are_skipped(recorder: Recorder, tmp_path: Path) -> None:
    ours = packet(200, b"of a user") + counted(11, bytes(26)) + packet(20, struct.pack("<d", 1.0))
    (tmp_path / NAME).write_bytes(HEAD + FRAMES[0] + ours + b"".join(FRAMES[1:]))
    assert recorder.summary(NAME, show_all=True).startswith(SAID)


@pytest.mark.parametrize("cut", [1, 20, len(HEAD) + 3, len(HEAD) + 60, -1, -8, -40])
def test_a_cut_file_is_refused_in_one_sentence(
    recorder: Recorder, tmp_path: Path, cut: int
) -> None:
    (tmp_path / NAME).write_bytes(FILE[:cut])
    for call in (recorder.summary, recorder.collisions, recorder.recording):
        with pytest.raises(CallError, match=r"^by_hand\.log is [^\n]+$"):
            call(NAME)


@pytest.mark.parametrize(
    ("damaged", "words"),
    [
        (b"\x89PNG" + FILE, "does not begin with CARLA_RECORDER"),
        (HEAD + counted(3), "packet 3 stands outside of a frame"),
        (HEAD + FRAMES[0] + FRAMES[0] + packet(1, b""), "frame 1 has no end"),
        (HEAD + FRAMES[0] + packet(6, struct.pack("<H", 2) + bytes(28)), "2 records of 28 bytes"),
        (HEAD + FRAMES[0] + packet(2, struct.pack("<H", 9) + CAR), "bytes expected"),
    ],
)
def test_a_damaged_file_says_what_is_wrong(
    recorder: Recorder, tmp_path: Path, damaged: bytes, words: str
) -> None:
    (tmp_path / NAME).write_bytes(damaged)
    with pytest.raises(CallError, match=words):
        recorder.summary(NAME)


def test_our_own_recording_comes_back_as_it_was(tmp_path: Path) -> None:
    served = Served(ServerOptions(data_dir=tmp_path), StreamHub())
    episode = served.episode
    car = episode.spawn(Wanted("vehicle.tesla.model3", {}), episode.map.spawn_points[0])
    walker = episode.spawn(Wanted("walker.pedestrian.0001", {}), episode.map.spawn_points[1])
    episode.walkers[walker.id] = WalkerControl(speed=1.4)
    vehicle = episode.vehicles.of(car.id)
    vehicle.control, vehicle.lights = Control(throttle=0.5, steer=-0.25), 0x3
    episode.sky.apply(RAIN)
    assert served.recorder.start("a/own.log", episode.map.name, additional=True) == "own.log"
    poses = []
    for k in range(4):
        if k == 3:
            episode.destroy(walker.id)
        served.tick()
        poses.append(wire.transform(episode.actors.pose(car)))
    served.recorder.stop()

    head, found = packets.read_log("own.log", (tmp_path / "own.log").read_bytes())
    frames = list(found)
    assert (head.version, head.map) == (1, episode.map.name)
    assert [f.number for f in frames] == [1, 2, 3, 4]
    assert [f.elapsed for f in frames] == pytest.approx([0.0, 0.05, 0.1, 0.15])
    assert [f.duration for f in frames] == [0.05, 0.05, 0.05, -1.0]
    born = {a.id: a for a in frames[0].added}
    assert born.keys() == {a.id for a in episode.actors} | {walker.id}
    assert born[car.id].attribute_values() == car.attributes
    numbers = {id: number for number, id, *_ in get_actor_definitions(served)}
    assert born[car.id].number == numbers["vehicle.tesla.model3"] > 0
    assert {a.number for a in frames[0].added if a.blueprint.startswith("traffic.")} == {0}
    for frame, (place, (pitch, yaw, roll)) in zip(frames, poses, strict=True):
        (row,) = [r for r in frame.rows(Packet.POSITION) if r[0] == car.id]
        assert np.array(row[1]) / 100.0 == pytest.approx(place, abs=1e-4)
        assert row[2] == pytest.approx((roll, pitch, yaw), abs=1e-4)
    id, steer, throttle, *_ = frames[1].rows(Packet.VEHICLE)[0]
    assert (id, steer, throttle) == (car.id, 0.25, 0.5)  # right is positive in CARLA
    assert frames[1].rows(Packet.WALKER) == [(walker.id, pytest.approx(140.0))]
    assert frames[1].rows(Packet.VEHICLE_LIGHT) == [(car.id, 0x3)]
    assert frames[0].rows(Packet.WEATHER)[0][0] == pytest.approx(RAIN)
    assert Packet.WEATHER not in frames[1].records  # only changes are written
    assert frames[3].rows(Packet.EVENT_DEL) == [(walker.id,)]
    assert len(frames[0].rows(Packet.TRAFFIC_LIGHT)) == len(list(episode.posts))
    velocity = frames[3].rows(Packet.KINEMATICS)[0][1]
    assert velocity == pytest.approx(wire.iso_to_wire(episode.actors.velocity(car)), abs=1e-5)
    assert all(f.platform_time is not None for f in frames)
