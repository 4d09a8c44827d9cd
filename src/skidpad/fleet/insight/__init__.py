"""What the fleet knows as its readers need it: trends, places, the safety case, research (C-174, C-177)."""
