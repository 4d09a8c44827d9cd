"""The versions of OpenSCENARIO XML that are written; options load this module and no other."""

from __future__ import annotations

from enum import Enum


class OscVersion(str, Enum):
    """Which profile of OpenSCENARIO XML is written."""

    V1_2 = "1.2"
    V1_0 = "1.0"

    @property
    def minor(self) -> int:
        """Returns the minor revision for the file header."""
        return int(self.value.split(".")[1])
