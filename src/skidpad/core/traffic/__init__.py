"""What other drivers see, and how they deviate from what a scenario asks of them."""
