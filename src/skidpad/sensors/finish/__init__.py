"""What is added to a colour picture for people, over key and depth; a stack never reads it (R-13)."""
