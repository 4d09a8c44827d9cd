"""Vehicles: commands, engines and physics settings of clients, falling, giving way at signs."""
