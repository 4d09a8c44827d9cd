"""Campaign: cells, the one loop, and the pool of workers."""
