"""Which envelope, if any, a run puts around its stack."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from skidpad.core.run import AdasDriver, RunSpec
from skidpad.core.setup import Setup
from skidpad.core.vocabulary import Govern, RangeModel
from skidpad.core.weather import Weather
from skidpad.envelope.envelope import EnvelopeSettings
from skidpad.envelope.govern import govern
from skidpad.envelope.govern_kernel import ORACLE_STEP, TABLE_KMH
from skidpad.envelope.limits import Binding
from skidpad.physics.grip import mu_at, road_of
from skidpad.physics.optics import radar_range
from skidpad.stack.interface import Stack

FIXED_KMH = 80.0
ORACLE_SPEEDS = np.arange(0.0, 60.0, ORACLE_STEP)  # m/s


def apply_envelope(stack: type[Stack], spec: RunSpec, setup: Setup) -> type[Stack]:
    """Returns the stack's class wrapped in the run's speed envelope; the class itself without one."""
    found = choose_envelope(spec, setup)
    return stack if found is None else govern(stack, found)


LIMITS = {
    Govern.ONLY_SIGHT: Binding.SIGHT,
    Govern.ONLY_LEAD: Binding.LEAD,
    Govern.ONLY_BEND: Binding.BEND,
    Govern.ONLY_WATER: Binding.WATER,
}  # of the ablations, each alone
GRIP_FACTORS = {Govern.GRIP_LOW: 0.7, Govern.GRIP_HIGH: 1.3}


def choose_envelope(spec: RunSpec, setup: Setup) -> EnvelopeSettings | None:
    """Returns the settings of the run's envelope; None: it has none."""
    own = isinstance(spec.driver, AdasDriver) and spec.driver.envelope
    kind = Govern.ENVELOPE if own and spec.govern is Govern.NONE else spec.govern
    found = describe_envelope(kind, setup.dt, spec.seed)
    if found is not None and kind is Govern.ORACLE:
        params = road_of(setup).params()
        return replace(found, oracle=tuple(float(mu_at(params, v)) for v in ORACLE_SPEEDS))
    if found is not None and kind is Govern.ORACLE_SIGHT:
        is_limited = setup.range_model is RangeModel.PHYSICAL
        weather = setup.weather if is_limited else Weather()
        return replace(found, oracle_sight=lambda nominal: radar_range(weather, nominal))
    return found


def describe_envelope(kind: Govern, dt: float, seed: int) -> EnvelopeSettings | None:
    """Returns the settings of a word of --govern, oracles without what they know; None: no envelope."""
    plain = EnvelopeSettings(dt=dt, seed=seed)
    if kind in LIMITS:
        return replace(plain, limits=frozenset({LIMITS[kind]}))
    match kind:
        case Govern.NONE:
            return None
        case Govern.TABLE:
            return replace(plain, table_kmh=TABLE_KMH)
        case Govern.FIXED:
            return replace(plain, table_kmh=(FIXED_KMH,) * 3)
        case Govern.RSS:
            return replace(plain, rss=True)
        case Govern.WATCH:
            return replace(plain, watches=True)
        case Govern.PULSES:
            return replace(plain, pulses=True)
        case Govern.FULL:
            return replace(plain, lanes=True, walkers=True, bridges=True)
    return replace(plain, factor=GRIP_FACTORS.get(kind, 1.0))
