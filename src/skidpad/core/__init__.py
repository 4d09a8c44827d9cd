"""Core: the words that all houses share. It imports no other house."""
