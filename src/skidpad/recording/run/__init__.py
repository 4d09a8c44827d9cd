"""What one run leaves: its log per tick, events, inputs of a person, readings, what was staged."""
