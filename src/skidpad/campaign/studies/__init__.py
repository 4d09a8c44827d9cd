"""Small experiments of their own, and the tuning of scenarios."""
