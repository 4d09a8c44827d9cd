"""Sensors that clients spawned: which are due, and what each of them sends."""
