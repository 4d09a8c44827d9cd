"""How channels are judged, as words: declared once, and loaded by help and options without anything else."""

from __future__ import annotations

from enum import Enum


class Profile(str, Enum):
    """Which published or corrected rules apply (decision C-6)."""

    TRACKED = "tracked"  # decision R-9
    PRACTICAL = "practical"
    AS_PRINTED = "as_printed"


class Form(str, Enum):
    """How far a published formula is followed (decision C-16)."""

    CORRECTED = "corrected"  # a fit over 1.0 s; motion validated over 1.0 s
    COMPLETED = "completed"  # C-044
    PRINTED = "printed"  # C-042, C-043


class Identify(str, Enum):
    """Who finds the three scored hazards."""

    RULES = "rules"
    LEARNED = "learned"
    BOTH = "both"
