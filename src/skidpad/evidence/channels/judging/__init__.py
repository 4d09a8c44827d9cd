"""Hazards found, held against the truth of a drive."""
