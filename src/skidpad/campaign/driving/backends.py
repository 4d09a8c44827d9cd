"""From the word in a cell to a simulator that is ready to be reset."""

from __future__ import annotations

import shlex
from typing import TYPE_CHECKING

from skidpad.core.errors import require_choice
from skidpad.core.simulator import BACKENDS, BackendChoice, BackendKind
from skidpad.simulation.backend import Backend
from skidpad.simulation.embedded.engine import EmbeddedBackend

if TYPE_CHECKING:
    from skidpad.simulation.carla.keeper import ServerKeeper
    from skidpad.simulation.carla.options import CarlaOptions

WATCHDOG = 120.0  # s without a tick after which a worker ends itself; a map may take a minute
_KEEPERS: dict[BackendChoice, ServerKeeper] = {}  # of this process; a worker lives for many runs


def keep_server(choice: BackendChoice) -> None:
    """Starts the campaign's own CARLA server where it is down or older than asked for."""
    if choice.backend != BackendKind.CARLA or not choice.server_command:
        return
    if choice not in _KEEPERS:
        from skidpad.simulation.carla.keeper import ServerKeeper

        _KEEPERS[choice] = ServerKeeper(
            shlex.split(choice.server_command), choice.host, choice.port, choice.restart_every
        )
    _KEEPERS[choice].before_run()


def carla_options(choice: BackendChoice, watchdog: float | None = None) -> CarlaOptions:
    """Returns the adapter's options; ConfigError for an unknown optimisation. watchdog: s, None: none."""
    from skidpad.simulation.carla.options import CarlaOptions, Optimisation

    names = [o.value for o in Optimisation]
    off = {Optimisation(require_choice("--without", name, names)) for name in choice.without}
    return CarlaOptions(
        host=choice.host,
        port=choice.port,
        pace=choice.pace,
        optimisations=frozenset(Optimisation) - off,
        watchdog=watchdog,
    )


def make_backend(choice: BackendChoice, watchdog: float | None = None) -> Backend:
    """Returns a backend, not reset yet; this process ends `watchdog` s after its last tick (None: never)."""
    made: Backend = BACKENDS.get(choice.backend).make(choice, watchdog)
    return made


def make_embedded(choice: BackendChoice, watchdog: float | None = None) -> Backend:
    """Returns a fresh embedded simulator, which needs no watchdog."""
    del choice, watchdog
    return EmbeddedBackend()


def make_carla(choice: BackendChoice, watchdog: float | None = None) -> Backend:
    """Returns the client of a CARLA server."""
    # The wheel and its threads concern only drives on it.
    from skidpad.simulation.carla.backend import CarlaBackend

    return CarlaBackend(carla_options(choice, watchdog))
