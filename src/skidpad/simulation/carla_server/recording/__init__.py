"""The recorder and the replayer."""
