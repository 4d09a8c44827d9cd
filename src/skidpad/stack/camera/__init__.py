"""A driver that sees: three forward cameras and a frozen network (B-121)."""
