"""Constants of nature and of standards that more than one house needs."""

from __future__ import annotations

G = 9.80665  # m/s^2, standard gravity, 3rd CGPM (1901)
