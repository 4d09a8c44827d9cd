"""Evidence: pure functions of recordings."""
