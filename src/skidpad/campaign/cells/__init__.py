"""Which runs a campaign has: of the matrix, of friction, of the threshold map."""
