"""What driving channels perceive: their presets, wrong and late objects, ghosts, localisation."""
