"""A radar with an equation: targets and their sections, echoes, resolution cells, detections."""
