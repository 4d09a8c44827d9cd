"""Two truths about hazards; neither shares code with the rules or indicators that it judges."""
