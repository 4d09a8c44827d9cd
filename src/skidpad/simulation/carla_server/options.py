"""How the server was started (decision K-3)."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from skidpad.core.vocabulary import GripModel
from skidpad.simulation.carla_server.catalogue import MU_REF


@dataclass(frozen=True, slots=True, kw_only=True)
class ServerOptions:
    """The command line of `skidpad carla-server`."""

    host: str = "127.0.0.1"
    port: int = 2000  # 0: any free pair
    map: str = "figure8"
    maps: Path | None = None
    weather_grip: GripModel = GripModel.PHYSICAL
    ice: float = 0.0  # percent of 20 mm
    mu_ref: float = MU_REF
    seed: int = 0
    strict: bool = False
    record_calls: Path | None = None
    data_dir: Path | None = None
    idle_exit: float | None = None  # s without a client
