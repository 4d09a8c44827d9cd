"""What there is and what it costs: maps, profiles, sensors, grip by weather, extensions, this machine."""
