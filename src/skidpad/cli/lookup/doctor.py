"""`skidpad doctor`: what is installed, and what each missing part would give."""

from __future__ import annotations

import os
import platform
from dataclasses import dataclass
from importlib import metadata
from importlib.util import find_spec

import typer
from rich.console import Console

import skidpad
from skidpad.core.errors import install_command
from skidpad.core.kernels.jit import kernel_cache


@dataclass(frozen=True, slots=True)
class Extra:
    """An optional part: the module that shows it is there, its distribution, what it gives."""

    name: str
    module: str
    distribution: str
    gives: str


EXTRAS = (
    Extra("server", "msgpack", "msgpack", "skidpad carla-server: CARLA without a GPU"),
    Extra("carla", "carla", "carla", "--backend carla, a pytest fixture for its clients"),
    Extra("cluster", "distributed", "distributed", "--cluster: campaigns on many machines"),
    Extra("ros", "rosbags", "rosbags", "skidpad monitor on ROS 2 bags"),
    Extra("learn", "sklearn", "scikit-learn", "--identifier learned"),
    Extra("search", "optuna", "optuna", "search --method tpe"),
    Extra("osi", "osi3", "osi-python", "skidpad export --osi: traces of ASAM OSI"),
    Extra("cockpit", "nicegui", "nicegui", "skidpad drive, replay, watch: pages in a browser"),
    Extra("fleet", "fastapi", "fastapi", "skidpad fleet: what many vehicles report"),
    Extra("view", "rerun", "rerun-sdk", "skidpad view: recordings in Rerun"),
)
PROTOCOL = "0.9.16"  # of CARLA's clients, which the server speaks
CORE = ("numpy", "numba", "scipy", "polars", "opencv-python-headless", "scenariogeneration")


def doctor() -> None:
    """Print what is installed and what each missing part would give."""
    console = Console()
    console.print(
        f"skidpad {skidpad.__version__} on Python {platform.python_version()}, "
        f"{platform.system()} {platform.machine()}, {os.cpu_count()} cores"
    )
    for name in CORE:
        console.print(f"  {name} {metadata.version(name)}")
    console.print(f"  compiled kernels: in {kernel_cache()}")
    console.print()
    for extra in EXTRAS:
        there = find_spec(extra.module) is not None
        state = f"{extra.module} {metadata.version(extra.distribution)}" if there else "missing"
        if extra.name == "server" and there:
            state = f"serves CARLA {PROTOCOL}"
        # plain lines: in a pipe they are as long as they are
        typer.echo(f"{extra.name:<8} {state:<20} {extra.gives}")
    missing = [extra.name for extra in EXTRAS if find_spec(extra.module) is None]
    if missing:
        typer.echo(f"\nto install what is missing: {install_command(','.join(missing))}")
