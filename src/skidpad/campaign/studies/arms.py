"""The arms of every study: runs that differ in one thing, with common seeds (decision X-7)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

from msgspec import structs

from skidpad.campaign.studies.stacks import NOISE
from skidpad.core.run import AdasDriver, RunSpec, StackDriver
from skidpad.core.settings.parts import load_profile
from skidpad.core.vocabulary import Clearance, SensorLevel
from skidpad.physics.presets import find_weather
from skidpad.stack.configurations import functions_of

TARGETS_KMH = (60.0, 90.0, 120.0, 150.0)
DROPOUT_SHARES = (0.0, 0.1, 0.2)  # of time in which nothing is sensed
STACKS = "skidpad.campaign.studies.stacks"
ONE_TICK = 0.05  # s, the shortest warm-up: none


@dataclass(frozen=True, slots=True)
class Variant:
    """One arm of a study: a run, columns that name it, and what is special about it."""

    run: RunSpec
    labels: Mapping[str, Any]
    slow_s: float = 0.0
    recovery: Mapping[str, Any] = field(default_factory=dict)  # other values of the supervisor


Arms = Callable[[int], list[Variant]]  # of a seed


@dataclass(frozen=True, slots=True)
class Study:
    """Arms of a study with their seeds, and the claims that are judged on their runs."""

    arms: Arms
    claims: tuple[str, ...]


def base_run(
    configuration: int, weather: str = "clear-noon", settings: Mapping[str, Any] | None = None
) -> RunSpec:
    """Returns an object-level run of the profile `recommended`, with these settings over it."""
    return RunSpec(
        driver=AdasDriver(label=str(configuration), functions=functions_of(configuration)),
        weather=find_weather(weather),
        settings=load_profile("recommended", settings),
        sensors=SensorLevel.OBJECTS,
    )


def make_changed_run(stack: str, seed: int, configuration: int, **change: Any) -> RunSpec:
    """Returns a base run driven by a changed stack of `stacks.py`; change: what its class is given.

    cruise_kmh, if in it, is an option of the stack.
    """
    base = base_run(configuration)
    options = {"configuration": configuration, "profile": base.settings.profile}
    options |= {k: change.pop(k) for k in ("cruise_kmh",) if k in change}
    options["change"] = {**change, "seed": seed}
    driver = StackDriver(f"{STACKS}:{stack}", options, name=str(configuration))
    return structs.replace(base, driver=driver, seed=seed)


def by_settings(arms: Mapping[str, Mapping[str, Any]], configuration: int = 2) -> Arms:
    """Returns a function of a seed that makes arms which differ in settings alone, named as `arms`."""
    return lambda seed: [
        Variant(
            structs.replace(base_run(configuration, settings=values), seed=seed), {"variant": name}
        )
        for name, values in arms.items()
    ]


def speed_and_dropout(seed: int) -> list[Variant]:
    """Returns arms for F-08: every cruise target with every share of time without any sensing."""
    return [
        Variant(
            make_changed_run("Blinking", seed, 2, cruise_kmh=target, dropout=share),
            {"target_kmh": target, "dropout_injected": share},
        )
        for target in TARGETS_KMH
        for share in DROPOUT_SHARES
    ]


def by_stacks(arms: Mapping[str, str], configuration: int = 2) -> Arms:
    """Returns a function of a seed that makes arms which differ in the stack of `stacks.py`."""
    return lambda seed: [
        Variant(make_changed_run(stack, seed, configuration), {"variant": name})
        for name, stack in arms.items()
    ]


def preliminary(seed: int) -> list[Variant]:
    """Returns arms for A-278: preliminary and recommended profile, with the same grip and sight."""
    same = {"grip": "none", "range": "none", "mu_ref": 1.5, "camera": False}
    return [
        Variant(
            structs.replace(base_run(2), seed=seed, settings=load_profile(profile, same)),
            {"variant": name},
        )
        for name, profile in (("preliminary", "preliminary"), ("final", "recommended"))
    ]


def pace(seed: int) -> list[Variant]:
    """Returns arms for F-25: the same runs, and each tick 1 ms slower."""
    base = structs.replace(base_run(4, "rain-night"), duration=100.0)
    return [
        Variant(structs.replace(base, seed=seed), {"variant": name}, slow_s=slow)
        for name, slow in (("paced", 0.0), ("slowed", 1e-3))
    ]


def recovery(seed: int) -> list[Variant]:
    """Returns arms for F-30: configuration 0 in rain, whole and without one safeguard each."""
    arms: dict[str, dict[str, Any]] = {
        "whole": {},
        "no_clearance": {"clearance": Clearance.NONE},
        "no_warm_up": {"warm_up": ONE_TICK},
        "no_grace": {"grace": 0.0},
    }
    base = base_run(0, "rain-noon")
    return [
        Variant(structs.replace(base, seed=seed), {"variant": name}, recovery=values)
        for name, values in arms.items()
    ]


def noise(seed: int) -> list[Variant]:
    """Returns arms with perception noise of cited sizes, all else a clear noon (A-230)."""
    return [
        Variant(make_changed_run("Noisy", seed, 2, noise=asdict(strength)), {"variant": name})
        for name, strength in NOISE.items()
    ]


STUDIES: dict[str, Study] = {
    "F-08": Study(speed_and_dropout, ("F-08", "F-08v")),
    "F-17": Study(
        by_settings({"cascade": {}, "safety_persist": {"safety_persist": True}}), ("F-17",)
    ),
    "F-18": Study(by_stacks({"coast": "Changed", "no_coast": "Coastless"}), ("F-18",)),
    "F-19": Study(by_settings({"zones": {}, "one_pid": {"follower": "distance_pid"}}), ("F-19",)),
    "F-21": Study(
        by_settings({"map_matched": {}, "corridor": {"radar_corridor": "parabola"}}), ("F-21",)
    ),
    "F-25": Study(pace, ("F-25",)),
    "F-29": Study(by_stacks({"released": "Changed", "engaged": "Handbraked"}), ("F-29",)),
    "F-30": Study(recovery, ("F-30", "F-30a", "F-30b", "F-30c")),
    "noise": Study(noise, ("F-12n", "F-12nv", "F-13n", "F-13nv")),
    "A-278": Study(preliminary, ("A-278",)),
}
