"""How many examples a property is tried with: a share of what it asks for, set by the profile."""

from __future__ import annotations

from hypothesis import settings

FULL = 100  # `max_examples` of the profile `ci`: a property gets as many examples as it asks for
PROFILES = {"quick": FULL // 5, "ci": FULL, "nightly": 20 * FULL}
LEAST = 5  # examples that a property gets under any profile


def register_profiles() -> None:
    """Registers the profiles, and loads the one that holds without `--hypothesis-profile`."""
    for name, count in PROFILES.items():
        # no test judges by the wall clock: a busy machine is no fault
        settings.register_profile(name, deadline=None, max_examples=count)
    settings.load_profile("ci")


def examples(count: int) -> int:
    """Returns the number of examples under this profile of a property that asks for `count`."""
    return max(LEAST, count * settings().max_examples // FULL)
