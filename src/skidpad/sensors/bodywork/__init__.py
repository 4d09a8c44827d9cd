"""Bodies of vehicles and people from a parametric generator: each fills its box and has wheels that turn."""
