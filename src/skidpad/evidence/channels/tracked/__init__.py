"""The profile `tracked`: each channel's own tracks on its path, a safe distance, and a vote (R-9)."""
