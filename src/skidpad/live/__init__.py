"""Links beside the loop: the listeners to a drive of channels, and how its messages reach them (R-12)."""
