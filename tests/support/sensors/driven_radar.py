"""A radar in a driven run."""

from __future__ import annotations

from skidpad.campaign.driving.run_setup import stage_of
from skidpad.core.vocabulary import RadarModel, SensorLevel
from skidpad.simulation.embedded.engine import EmbeddedBackend
from support.runs import adas_run


def measured(level=SensorLevel.OBJECTS, model=RadarModel.PHYSICAL, weather="rain-noon", **changes):
    """A backend at the start of a run, and its first frame."""
    settings = {"radar_model": model.value, **changes}
    ready = adas_run(2, weather, settings=settings, seed=3, sensors=level)
    backend = EmbeddedBackend()
    return backend, backend.reset(stage_of(ready).setup, ready.seed)
