"""The backend protocol on a real CARLA server."""
