"""Actions of a storyboard: what entities do, and what happens to the world."""
