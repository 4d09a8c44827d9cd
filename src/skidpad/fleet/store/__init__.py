"""What the fleet knows: facts that are never changed, and events that say what became of them."""
