"""Processes that do the runs: one worker, a pool on this machine, a cluster of many."""
