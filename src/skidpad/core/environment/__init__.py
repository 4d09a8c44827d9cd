"""What surrounds a vehicle as plain values: what lies on roads, tyres on it, what acts on lidars, places."""
