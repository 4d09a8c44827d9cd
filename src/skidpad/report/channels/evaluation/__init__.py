"""The report of an evaluation: how well monitors and identifiers find hazards."""
