"""Scenarios: OpenSCENARIO files, their player and writer."""
