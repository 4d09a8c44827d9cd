"""The settings of a run: one setting, the parts that hold them, and profiles that fill them."""
