"""Metrics of a run, from its tick log."""
