"""From a measured distance to pedals and steering."""
