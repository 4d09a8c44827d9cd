"""The static world and the bodies in it as triangles: roads, furniture, terrain, vehicles, people."""
