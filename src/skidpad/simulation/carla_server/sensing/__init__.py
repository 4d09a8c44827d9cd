"""Sensors that clients spawned: which are due, and what each of them sends."""

from skidpad.simulation.carla_server.sensing.sensors import SensorSet

__all__ = ["SensorSet"]
