"""Driving channels and their arbiter."""
