"""The reports of the friction campaign and of the threshold map."""
