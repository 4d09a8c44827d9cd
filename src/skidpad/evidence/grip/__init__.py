"""Judging drives of the friction campaign: scores, series, findings."""
