"""Radar and lidar as exact ray samples of the scene, and what weather leaves of their returns."""
