"""Where equality of bytes is promised: equal fingerprints (decision X-2)."""

from __future__ import annotations

import hashlib
import platform
from collections.abc import Collection
from dataclasses import asdict, dataclass
from functools import cache

import msgspec
import numpy as np

import skidpad
from skidpad.core.text.wording import list_text


@dataclass(frozen=True, slots=True)
class Fingerprint:
    """What can change the last bit of a result."""

    cpu: str
    cpu_features: str  # hash of the features that the compiler uses
    libc: str
    python: str
    numpy: str
    numba: str
    skidpad: str

    @property
    def short(self) -> str:
        """Returns sixteen digits that differ when anything here does."""
        text = msgspec.json.encode(asdict(self), order="deterministic")
        return hashlib.sha256(text).hexdigest()[:16]


def comparison_text(a: Collection[str], b: Collection[str]) -> str:
    """Returns in words whether hashes of drives on these fingerprints may be compared; empty: not known."""
    if a and b and len({*a, *b}) == 1:
        return f"hashes may be compared: same processor features, libraries and version ({next(iter(a))})"
    places = [", ".join(sorted(side)) or "not known" for side in (a, b)]
    return (
        "hashes may not be compared, equal drives may differ in theirs: other processor features, "
        f"libraries or version ({places[0]} against {places[1]})"
    )


def reach_text(places: Collection[str]) -> str:
    """Returns in words with what a hash of drives on these fingerprints may be compared; empty: not known."""
    if not places:
        return "Its hash may not be compared with another: its fingerprint was not recorded."
    driven = list_text(sorted(places))
    if len(places) > 1:
        return f"Its hash may not be compared with another: it was driven on several fingerprints, {driven}."
    return (
        "Its hash may be compared with that of a campaign on the same processor features, libraries "
        f"and version alone: fingerprint {driven}."
    )


@cache
def fingerprint() -> Fingerprint:
    """Returns the fingerprint of this process."""
    import llvmlite.binding as llvm  # slow to load, and readers of logs do not need it
    import numba

    features = llvm.get_host_cpu_features().flatten()
    return Fingerprint(
        cpu=llvm.get_host_cpu_name(),
        cpu_features=hashlib.sha256(features.encode()).hexdigest()[:16],
        libc=" ".join(platform.libc_ver()),
        python=platform.python_version(),
        numpy=np.__version__,
        numba=numba.__version__,
        skidpad=skidpad.__version__,
    )
