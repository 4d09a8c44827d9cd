"""Scenario files: played and judged, searched for failures, their risk."""
