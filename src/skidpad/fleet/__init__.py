"""The fleet: what its vehicles report, kept, judged, and sent back as updates (C-170 to C-197)."""
