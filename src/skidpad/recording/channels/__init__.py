"""Recordings of driving channels: MCAP files, cycles on one clock, indicators, monitored drives."""
