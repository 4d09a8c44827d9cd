"""Where: positions, routes, trajectories, places for traffic."""
