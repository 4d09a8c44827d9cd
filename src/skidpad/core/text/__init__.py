"""Texts for people: words around numbers, and foreign texts that can be printed."""
