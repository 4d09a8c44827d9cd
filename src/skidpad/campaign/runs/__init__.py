"""One run with its folder: driven, stored, driven again, shadowed, played."""
