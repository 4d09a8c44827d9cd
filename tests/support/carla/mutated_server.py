"""A server with one sign flipped: `mutated_server.py MUTANT [options of carla-server]` (K-4)."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from skidpad.core.geometry import Pose
from skidpad.simulation.carla_server import filling
from skidpad.simulation.carla_server.protocol import wire
from skidpad.simulation.carla_server.sensing import inertial, pixels, points

Function = Callable[..., Any]


def column(index: int) -> Callable[[Function], Function]:
    """Flip one column of an array that a function returns."""

    def mutate(function: Function) -> Function:
        def mutated(*arguments: Any) -> Any:
            out = function(*arguments).copy()
            out[:, index] *= -1.0
            return out

        return mutated

    return mutate


def member(index: int) -> Callable[[Function], Function]:
    """Flip one member of a tuple that a function returns."""

    def mutate(function: Function) -> Function:
        def mutated(*arguments: Any) -> Any:
            out = list(function(*arguments))
            out[index] = -out[index]
            return tuple(out)

        return mutated

    return mutate


def pose(flip: Callable[[Pose], Pose]) -> Callable[[Function], Function]:
    """Flip a part of the poses that a function reads."""
    return lambda function: lambda *arguments: flip(function(*arguments))


def negated(function: Function) -> Function:
    """Flip a number or an array."""
    return lambda *arguments: -function(*arguments)


def mirrored_image(function: Function) -> Function:
    """Left becomes right in the image that a function fills."""

    def mutated(*arguments: Any) -> None:
        function(*arguments)
        out = arguments[-1]
        out[:] = out[:, ::-1].copy()

    return mutated


# What is flipped: module, function, how.
MUTANTS: dict[str, tuple[Any, str, Callable[[Function], Function]]] = {
    "place in snapshots": (filling, "poses_to_carla", column(1)),
    "pitch in snapshots": (wire, "transform", lambda f: lambda p: f(replace(p, pitch=-p.pitch))),
    "yaw in snapshots": (filling, "poses_to_carla", column(4)),
    "velocity": (filling, "vectors_to_carla", column(1)),
    "angular velocity": (filling, "turns_to_carla", column(2)),
    "steer": (wire, "iso_steer", negated),
    "place of spawning": (wire, "pose", pose(lambda p: replace(p, y=-p.y))),
    "yaw of spawning": (wire, "pose", pose(lambda p: replace(p, yaw=-p.yaw))),
    "pitch of mounting": (wire, "pose", pose(lambda p: replace(p, pitch=-p.pitch))),
    "target velocity": (wire, "iso_vector", member(1)),
    "radar": (points, "angles_to_carla", negated),
    "lidars": (points, "vectors_to_carla", column(1)),
    "images": (pixels, "bgra_from_instances", mirrored_image),
    "gyroscope": (inertial, "turn_from_carla", member(2)),
    "accelerometer, compass": (inertial, "vector_from_carla", member(1)),
}


def main() -> None:
    """Flip it, then be the server."""
    name = sys.argv.pop(1)
    if name != "none":
        module, function, how = MUTANTS[name]
        setattr(module, function, how(getattr(module, function)))
    sys.argv.insert(1, "carla-server")
    from skidpad.cli.main import main as command

    command()


if __name__ == "__main__":
    main()
