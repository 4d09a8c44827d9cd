"""The recorder's and the replayer's calls."""

from __future__ import annotations

from typing import Any

from skidpad.simulation.carla_server.protocol import wire
from skidpad.simulation.carla_server.protocol.rpc import CallError, Shape, Table
from skidpad.simulation.carla_server.served import Served

TABLE = Table("recorder")
MAX_FACTOR = 100.0  # times real time
KIND_LETTERS = ("o", "v", "w", "t", "h", "a")  # other, vehicle, walker, traffic light, hero, any


@TABLE.method("start_recorder")
def start_recorder(served: Served, name: Any, additional: Any = False) -> str:
    """Starts a recording, ending a replay, and returns its file's name; CallError without --data-dir.

    additional: also velocities, boxes and the machine's time. FileError where the file cannot be written.
    """
    more = wire.flag(additional, "additional_data")
    file = wire.text(name, "file name")
    started = served.recorder.start(file, served.episode.map.name, more)
    served.replayer.release()
    return started


@TABLE.method("stop_recorder", Shape.VOID)
def stop_recorder(served: Served) -> None:
    """Stops the recording that runs, if any."""
    served.recorder.stop()


@TABLE.method("show_recorder_file_info")
def show_recorder_file_info(served: Served, name: Any, show_all: Any = False) -> str:
    """Returns what is in a recording, in CARLA's words: events, with `show_all` every frame."""
    all_frames = wire.flag(show_all, "show_all")
    return served.recorder.summary(wire.text(name, "file name"), all_frames)


@TABLE.method("show_recorder_collisions")
def show_recorder_collisions(served: Served, name: Any, first: Any, second: Any) -> str:
    """Returns the contacts between two kinds of actors, in CARLA's words."""
    kinds = [_actor_kind(kind) for kind in (first, second)]
    return served.recorder.collisions(wire.text(name, "file name"), *kinds)


def _actor_kind(value: Any) -> str:
    """Returns the letter of a kind; the client sends it as a character's number. CallError for others."""
    letter = chr(value) if isinstance(value, int) and 0 < value < 128 else value
    if letter not in KIND_LETTERS:
        raise CallError(f"a kind of actor is one of {', '.join(KIND_LETTERS)}, got {value!r:.20}")
    return str(letter)


@TABLE.method("show_recorder_actors_blocked")
def show_recorder_actors_blocked(served: Served, name: Any, seconds: Any, distance: Any) -> str:
    """Returns the actors that stood for longer than `seconds`, in CARLA's words; distance in cm."""
    least, cm = wire.number(seconds, "min_time"), wire.number(distance, "min_distance")
    return served.recorder.describe_blocked(wire.text(name, "file name"), least, cm)


@TABLE.method("replay_file")
def replay_file(
    served: Served, name: Any, start: Any, duration: Any, follow: Any = 0, *without_effect: Any
) -> str:
    """Starts a replay, loading its map if need be, and returns CARLA's words for it.

    start, duration: s. Neither recorded sensors nor an offset of the followed view are served.
    CallError where the file is no recording.
    """
    del without_effect
    asked = wire.text(name, "file name")
    begin, length = wire.number(start, "time_start"), wire.number(duration, "duration")
    followed = wire.integer(follow, "follow_id")
    source = served.recorder.recording(asked)
    served.recorder.stop()
    if source.map.rsplit("/", 1)[-1] != served.episode.map.name:
        served.load(source.map, reset_settings=False)
    since, until = served.replayer.start(served.episode, source, begin, length, followed)
    player, total = served.replayer, f"{source.total:g}"
    lines = [
        f"Replaying File: {asked:.200}",
        f"Total time recorded: {total}",
        f"Replaying from {since:g} s - {until:g} s ({total} s) at {player.time_factor:.1f}x",
    ]
    lines += ["Ignoring Hero vehicle"] if player.ignore_hero else []
    lines += ["Ignoring Spectator camera"] if player.ignore_spectator else []
    return "\n".join(lines) + "\n"


@TABLE.method("stop_replayer", Shape.VOID)
def stop_replayer(served: Served, keep_actors: Any) -> None:
    """Ends the replay; actors that the recording lets vanish do so unless they are kept."""
    served.replayer.stop(wire.flag(keep_actors, "keep_actors"))


@TABLE.method("set_replayer_time_factor", Shape.VOID)
def set_replayer_time_factor(served: Served, factor: Any) -> None:
    """Sets how much faster than recorded a replay runs; CallError outside of (0, MAX_FACTOR]."""
    wanted = wire.number(factor, "time_factor")
    if not 0.0 < wanted <= MAX_FACTOR:
        raise CallError(f"time_factor must be in (0, {MAX_FACTOR:g}], got {wanted:g}")
    served.replayer.time_factor = wanted


@TABLE.method("set_replayer_ignore_hero", Shape.VOID)
def set_replayer_ignore_hero(served: Served, ignore: Any) -> None:
    """Sets whether a replay leaves out actors with the role `hero`."""
    served.replayer.ignore_hero = wire.flag(ignore, "ignore_hero")


@TABLE.method("set_replayer_ignore_spectator", Shape.VOID)
def set_replayer_ignore_spectator(served: Served, ignore: Any) -> None:
    """Sets whether a replay leaves out the recorded way of the spectator, as it does at first."""
    served.replayer.ignore_spectator = wire.flag(ignore, "ignore_spectator")
