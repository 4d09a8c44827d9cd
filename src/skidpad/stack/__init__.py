"""Stack: what is under test. It sees sensor frames and the map, never the truth."""
