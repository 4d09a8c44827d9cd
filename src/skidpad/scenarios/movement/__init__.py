"""How entities move: the road's ways, lines, changes over time, steering, distances between entities."""
