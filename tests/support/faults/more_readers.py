"""Readers of what vehicles, clients and people in a browser leave behind, for tests that damage it."""

from __future__ import annotations

import gzip
import random
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import msgspec

from skidpad.core.errors import InputError, SkidpadError
from skidpad.core.inputs import Pedals, Timed, Wheel
from skidpad.evidence.channels.indicators.catalogue import Indicator
from support.faults import mutation
from support.faults.channel_readers import watched
from support.faults.plain_mutation import mutated_json
from support.faults.readers import BYTES_OR_JSON, Mutate, Reader


def asked(read: Any) -> Any:
    """A reader of requests: their refusal is the sentence that files are refused with."""

    def reads(path: Path) -> object:
        try:
            return read(path)
        except InputError:
            raise
        except SkidpadError as error:
            raise InputError(str(error)) from error

    return reads


# --- what a person did


def inputs() -> list[bytes]:
    from skidpad.recording.run.inputs import encode_inputs

    done = (Timed(1, Wheel(True)), Timed(3, Pedals(0.4, 0.0)), Timed(9, Wheel(False)))
    return [encode_inputs(done)]


def read_inputs(path: Path) -> object:
    from skidpad.recording.run.inputs import decode_inputs, encode_inputs

    return encode_inputs(decode_inputs(path.read_bytes()))


# --- recordings of CARLA's clients


@cache
def served() -> Any:
    from skidpad.simulation.carla_server.options import ServerOptions
    from skidpad.simulation.carla_server.protocol.streams import StreamHub
    from skidpad.simulation.carla_server.served import Served

    return Served(ServerOptions(map="straight"), StreamHub())


@cache
def replays() -> list[bytes]:
    from skidpad.simulation.carla_server.episode import Wanted
    from skidpad.simulation.carla_server.recording.recorder import Recorder

    world = served()
    car = world.episode.spawn(Wanted("vehicle.tesla.model3", {}), world.episode.map.spawn_points[0])
    with TemporaryDirectory() as folder:
        recorder = world.recorder = Recorder(Path(folder))
        recorder.start("a.log", "straight")
        for _ in range(4):
            world.tick()
        recorder.stop()
        world.episode.destroy(car.id)
        return [(Path(folder) / "a.log").read_bytes()]


def replay(path: Path) -> object:
    """Summed up, and replayed for some ticks."""
    from skidpad.simulation.carla_server.recording.recorder import Recorder
    from skidpad.simulation.carla_server.recording.replayer import PLAYED, Replayer

    recorder, player = Recorder(path.parent), Replayer()
    recorder.summary(path.name, show_all=True)
    recorder.collisions(path.name)
    recorder.describe_blocked(path.name, 0.1, 1.0)
    player.start(served().episode, recorder.recording(path.name), 0.0, 0.0, 0)
    for _ in range(3):
        player.tick(0.05)
    player.stop(keep_actors=False)
    played = [a.id for a in served().episode.actors if a.family in PLAYED]
    for id in played:
        served().episode.destroy(id)
    return played


# --- what vehicles send


BODY = {"x": 1.0, "y": 2.0, "heading": 0.5, "length": 4.5, "width": 1.8}


def alerts() -> list[bytes]:
    alert = {
        "kind": "hazard",
        "text": "somebody drives very close behind",
        "scene": {"map": "town", "ego": BODY, "v": 12.5, "objects": [BODY]},
    }
    return [gzip.compress(msgspec.json.encode(alert))]


def drives() -> list[bytes]:
    drive = {"seconds": 60.0, "cycles": 600, "context": {"map": "town"}, "release": "a"}
    return [gzip.compress(msgspec.json.encode(drive | {"judged": {"errors": 1, "before": 2}}))]


def rows() -> list[bytes]:
    row = {
        "minute": 3, "subject": "a", "indicator": next(iter(Indicator)).value, "n": 600, "violated": 2,
        "mean": 0.5, "least": 0.1, "greatest": 0.9,
    }  # fmt: skip
    return [gzip.compress(msgspec.json.encode(row) + b"\n" + msgspec.json.encode(row))]


def hazards() -> list[bytes]:
    return [gzip.compress(watched()["hazards.txt"])]


def sent(read: Any) -> Any:
    """What comes in a request's body, unpacked within limits."""
    from skidpad.fleet.unpacking import unpack
    from skidpad.fleet.words import Limits

    return asked(lambda path: read(unpack(path.read_bytes(), Limits()), Limits()))


def read_hazards(content: bytes, limits: Any) -> object:
    from skidpad.fleet.batch import hazards_of

    return hazards_of(content, limits)


def read_rows(content: bytes, limits: Any) -> object:
    from skidpad.fleet.batch import rows_of

    return rows_of(content, limits)


def read_drive(content: bytes, _: Any) -> object:
    from skidpad.fleet.batch import drive_of

    return drive_of(content)


def read_alert(content: bytes, _: Any) -> object:
    from skidpad.fleet.alerting.keeping import parse_alert

    return parse_alert(content)


def repacked(rng: random.Random, data: bytes) -> bytes:
    """The content damaged, not its packing."""
    return gzip.compress(mutation.mutated(rng, unpacked(data)), 1)


def other_values(rng: random.Random, data: bytes) -> bytes:
    """Other values in the content."""
    return gzip.compress(mutated_json(rng, unpacked(data)), 1)


unpacked = cache(gzip.decompress)
PACKED: tuple[Mutate, ...] = (mutation.mutated, repacked, repacked)
PACKED_JSON: tuple[Mutate, ...] = (mutation.mutated, repacked, other_values, other_values)
READERS = {
    "inputs": Reader("inputs.jsonl", inputs, read_inputs, BYTES_OR_JSON),
    "replay": Reader("a.log", replays, asked(replay)),
    "sent-alert": Reader("body.gz", alerts, sent(read_alert), PACKED_JSON),
    "sent-drive": Reader("body.gz", drives, sent(read_drive), PACKED_JSON),
    "sent-rows": Reader("body.gz", rows, sent(read_rows), PACKED_JSON),
    "sent-hazards": Reader("body.gz", hazards, sent(read_hazards), PACKED),
}
