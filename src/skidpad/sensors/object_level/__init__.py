"""The object level: what cameras, radar and a driver's eyes would report, computed from boxes."""
