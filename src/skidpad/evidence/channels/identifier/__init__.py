"""Hazards by trained trees: features, model, training."""
