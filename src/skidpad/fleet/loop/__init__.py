"""The loop: hazard, analysis, change, update, re-evaluation, as one record (C-178)."""
