"""The report of the ADAS-in-weather matrix."""
