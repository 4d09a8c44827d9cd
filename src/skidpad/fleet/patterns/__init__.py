"""Recurring hazards: the same place, kind and course of indicators, seen by many vehicles (C-193)."""
