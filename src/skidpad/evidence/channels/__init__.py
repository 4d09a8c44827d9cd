"""Judging channels: indicators, risk, hazards, and their monitor; it knows no map (C-021)."""
