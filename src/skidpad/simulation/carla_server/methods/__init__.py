"""The calls that clients may make, one module per topic."""

from skidpad.simulation.carla_server.methods import (
    actors,
    batch,
    episode,
    lights,
    maps,
    motion,
    recording,
    scenery,
    traffic_manager,
    vehicles,
    walkers,
    weather,
)

TABLES = (
    episode.TABLE,
    maps.TABLE,
    actors.TABLE,
    motion.TABLE,
    vehicles.TABLE,
    walkers.TABLE,
    lights.TABLE,
    weather.TABLE,
    traffic_manager.TABLE,
    batch.TABLE,
    scenery.TABLE,
    recording.TABLE,
)

__all__ = ["TABLES"]
