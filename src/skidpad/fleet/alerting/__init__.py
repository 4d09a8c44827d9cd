"""Alerts of vehicles, relayed at once, and stop orders back to them (C-175)."""
