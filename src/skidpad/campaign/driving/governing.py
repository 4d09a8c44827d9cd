"""Which envelope, if any, a run puts around its stack."""

from __future__ import annotations

from skidpad.core.run import AdasDriver, RunSpec
from skidpad.core.setup import Setup
from skidpad.core.vocabulary import Govern
from skidpad.envelope.govern import TABLE_KMH, EnvelopeSettings, govern
from skidpad.physics.grip import mu_at, road_of
from skidpad.stack.interface import Stack

FIXED_KMH = 80.0


def apply_envelope(stack: type[Stack], spec: RunSpec, setup: Setup) -> type[Stack]:
    """Returns the stack's class with what the run puts around it."""
    found = choose_envelope(spec, setup)
    return stack if found is None else govern(stack, found)


def choose_envelope(spec: RunSpec, setup: Setup) -> EnvelopeSettings | None:
    """Returns the settings of the run's envelope; None: it has none."""
    dt = setup.dt
    own = isinstance(spec.driver, AdasDriver) and spec.driver.envelope
    kind = Govern.ENVELOPE if own and spec.govern is Govern.NONE else spec.govern
    match kind:
        case Govern.NONE:
            return None
        case Govern.ENVELOPE:
            return EnvelopeSettings(dt=dt, seed=spec.seed)
        case Govern.TABLE:
            return EnvelopeSettings(dt=dt, seed=spec.seed, table_kmh=TABLE_KMH)
        case Govern.FIXED:
            return EnvelopeSettings(dt=dt, seed=spec.seed, table_kmh=(FIXED_KMH,) * 3)
        case Govern.ORACLE:
            params = road_of(setup).params()
            return EnvelopeSettings(dt=dt, seed=spec.seed, oracle=lambda v: float(mu_at(params, v)))
