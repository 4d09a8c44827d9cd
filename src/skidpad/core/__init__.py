"""Core: the words that all packages share. It imports no other package of Skidpad."""
