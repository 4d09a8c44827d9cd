"""What other drivers see, how they deviate from what a scenario asks of them, and how cars are painted."""
