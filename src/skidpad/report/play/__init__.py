"""The page of scenarios that were played."""
