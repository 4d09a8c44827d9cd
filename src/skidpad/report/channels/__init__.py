"""The report of a monitored drive of channels."""
