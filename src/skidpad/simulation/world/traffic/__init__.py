"""Background traffic: drivers who see the road and each other, and drive through the physics."""
