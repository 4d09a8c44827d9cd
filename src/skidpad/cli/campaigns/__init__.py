"""The campaigns: `adas`, `grip` and its threshold map."""
