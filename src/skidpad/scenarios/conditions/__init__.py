"""Conditions of triggers: what holds now or not, by value and by entity."""
