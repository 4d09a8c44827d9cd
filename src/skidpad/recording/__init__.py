"""Recording: schemas, writers and readers of everything that a run leaves behind."""
