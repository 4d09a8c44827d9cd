"""A server that speaks CARLA's network protocol to the real client."""
