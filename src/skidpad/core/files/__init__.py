"""Files of others as plain values, and names that become parts of paths."""
