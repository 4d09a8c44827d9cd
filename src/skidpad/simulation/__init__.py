"""Simulation: the backend protocol, the supervisor, and the backends."""
