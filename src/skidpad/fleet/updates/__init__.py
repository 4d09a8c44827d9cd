"""Updates over the air: validated data, signed off line by two of three, fetched by vehicles (C-176)."""
