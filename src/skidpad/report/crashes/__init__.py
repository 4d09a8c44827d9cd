"""Crash cards: why a crash happened, what was seen of it, and a replay."""
