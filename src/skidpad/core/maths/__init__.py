"""Constants, conversions of axes and places, random streams, and spaces of values."""
