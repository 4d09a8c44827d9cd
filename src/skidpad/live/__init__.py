"""Links beside the loop: who listens while channels drive, and how it reaches them (R-12)."""
