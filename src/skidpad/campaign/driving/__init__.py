"""One drive: the world and the driver that a run describes, the one loop, and its sinks."""
