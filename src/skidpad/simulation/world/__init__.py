"""The moving world of a run, on which every simulator of the house stands."""
