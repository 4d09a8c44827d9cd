"""The one rule by which words about friction combine, as data: the page and the tests read it.

mu at a wheel = mu_ref x weather x tire_friction / 3.5
"""

from __future__ import annotations

from typing import NamedTuple


class FrictionWord(NamedTuple):
    """One way to say something about friction, and what becomes of it."""

    said_by: str
    acts: str  # "multiplies" or "replaces"
    what: str  # the factor of the product above
    how: str


FRICTION_RULE = (
    FrictionWord("`mu_ref`", "replaces", "mu_ref", "the dry road with new winter tyres"),
    FrictionWord(
        "`tyres`",
        "multiplies",
        "mu_ref",
        "their dry friction over 0.9; they also decide what water, ice and snow leave",
    ),
    FrictionWord(
        "`<material friction>`", "replaces", "mu_ref", "on its lane, if `lane_material` is on"
    ),
    FrictionWord(
        "`frictionScaleFactor`",
        "multiplies",
        "mu_ref",
        "everywhere, materials and patches included",
    ),
    FrictionWord(
        "weather",
        "multiplies",
        "weather",
        "the share that its water, ice or snow leaves at the speed driven",
    ),
    FrictionWord(
        "surface file, depths",
        "replaces",
        "weather",
        "with the deeper of patch and weather, by the physical model",
    ),
    FrictionWord(
        "surface file, `friction`", "multiplies", "weather", "the share that the weather leaves"
    ),
    FrictionWord("two patches at one place", "replaces", "weather", "the slippery one counts"),
    FrictionWord(
        "CARLA's physics control",
        "replaces",
        "tire_friction",
        "of a wheel; 3.5 is that of the blueprints",
    ),
    FrictionWord(
        "CARLA's friction trigger",
        "replaces",
        "tire_friction",
        "of every wheel inside, the physics control's too; of several triggers the slippery one counts",
    ),
)
