"""Sensors: the scene and what cameras, radar and the object level make of it."""
