"""What the matrix compares: configurations, steps of automation, factors, levels, published numbers."""
