"""The server's time: episode, frame counter and simulated seconds, and the client's settings."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from skidpad.core.setup import DT
from skidpad.simulation.carla_server.protocol import wire

SHORTEST_STEP = 1.0e-4  # s
LONGEST_STEP = 10.0  # s


@dataclass(frozen=True, slots=True)
class EpisodeSettings:
    """What `World.apply_settings` sends; only the first three members act (decision X-15)."""

    synchronous: bool = False
    no_rendering: bool = False
    fixed_step: float | None = None  # s
    substepping: bool = True
    max_substep: float = 0.01  # s
    max_substeps: int = 10
    max_culling_distance: float = 0.0  # m
    deterministic_ragdolls: bool = True
    tile_stream_distance: float = 3000.0  # m
    actor_active_distance: float = 2000.0  # m
    spectator_as_ego: bool = True

    @property
    def step(self) -> float:
        """Seconds by which one tick advances; without a fixed step, DT."""
        return DT if self.fixed_step is None else self.fixed_step

    def pack(self) -> list[Any]:
        """Returns the settings as CARLA's wire sends them."""
        return [
            self.synchronous,
            self.no_rendering,
            wire.some(self.fixed_step),
            self.substepping,
            self.max_substep,
            self.max_substeps,
            self.max_culling_distance,
            self.deterministic_ragdolls,
            self.tile_stream_distance,
            self.actor_active_distance,
            self.spectator_as_ego,
        ]


def parse_settings(value: Any) -> EpisodeSettings:
    """Returns the checked `EpisodeSettings` of a call; WireError names what is wrong. A step of 0 is none."""
    v = wire.items(value, "settings", 11)
    step = wire.optional(v[2], "settings.fixed_delta_seconds")
    if step is not None:
        step = wire.number(step, "settings.fixed_delta_seconds")
        if step == 0.0:
            step = None
        elif not SHORTEST_STEP <= step <= LONGEST_STEP:
            raise wire.WireError(
                f"settings.fixed_delta_seconds must be between {SHORTEST_STEP:g} and "
                f"{LONGEST_STEP:g} s, got {step!r}"
            )
    return EpisodeSettings(
        synchronous=wire.flag(v[0], "settings.synchronous_mode"),
        no_rendering=wire.flag(v[1], "settings.no_rendering_mode"),
        fixed_step=step,
        substepping=wire.flag(v[3], "settings.substepping"),
        max_substep=wire.number(v[4], "settings.max_substep_delta_time"),
        max_substeps=wire.integer(v[5], "settings.max_substeps", -(2**31)),
        max_culling_distance=wire.number(v[6], "settings.max_culling_distance"),
        deterministic_ragdolls=wire.flag(v[7], "settings.deterministic_ragdolls"),
        tile_stream_distance=wire.number(v[8], "settings.tile_stream_distance"),
        actor_active_distance=wire.number(v[9], "settings.actor_active_distance"),
        spectator_as_ego=wire.flag(v[10], "settings.spectator_as_ego"),
    )


@dataclass(slots=True)
class Clock:
    """Frames go on counting across episodes; seconds begin anew with each map."""

    episode: int = 1
    frame: int = 0
    elapsed: float = 0.0  # s of simulated time in this episode
    settings: EpisodeSettings = EpisodeSettings()

    @property
    def step(self) -> float:
        """Returns the time in s by which one tick advances."""
        return self.settings.step

    def advance(self) -> None:
        """Advances frame number and elapsed time by one tick."""
        self.frame += 1
        self.elapsed += self.step

    def renew(self, reset_settings: bool) -> None:
        """Begins another episode: its number rises and its seconds begin at 0; frames go on.

        reset_settings: settings are the defaults again, but for rendering.
        """
        self.episode += 1
        self.elapsed = 0.0
        if reset_settings:
            self.settings = replace(EpisodeSettings(), no_rendering=self.settings.no_rendering)
