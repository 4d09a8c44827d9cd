"""The embedded simulator: no GPU, no download, deterministic."""
