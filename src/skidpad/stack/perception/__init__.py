"""From a sensor frame to one measured distance."""
