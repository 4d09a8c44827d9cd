"""Where equality of bytes is promised: equal fingerprints (decision X-2)."""

from __future__ import annotations

import hashlib
import platform
from dataclasses import asdict, dataclass

import llvmlite.binding as llvm
import msgspec
import numba
import numpy as np

import skidpad


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
        """Sixteen digits that differ when anything here does."""
        text = msgspec.json.encode(asdict(self), order="deterministic")
        return hashlib.sha256(text).hexdigest()[:16]


def fingerprint() -> Fingerprint:
    """The fingerprint of this process."""
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
