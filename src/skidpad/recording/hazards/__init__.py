"""Hazard records: what a monitor found, with the worlds around it as lines of text."""
