"""What stands beside the roads where their file names nothing, drawn by the map's content (T-14)."""
