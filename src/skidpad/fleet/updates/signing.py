"""What is signed off line: the root of trust and the list of updates, each by two of three keys.

Source: The Update Framework specification 1.0, in the form of python-tuf.
"""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime, timedelta, timezone
from pathlib import Path
from typing import Any

from securesystemslib.signer import CryptoSigner
from tuf.api.metadata import Metadata, Root, TargetFile, Targets

from skidpad.core.errors import ConfigError
from skidpad.fleet import keys

KEYS, THRESHOLD = 3, 2
ROOT_VALID = timedelta(days=365)
TARGETS_VALID = timedelta(days=180)
ROLES = ("root", "targets")


def instant(seconds: float) -> datetime:
    """Returns s since 1970 as a UTC time in whole s, as TUF writes them."""
    return datetime.fromtimestamp(int(seconds), timezone.utc)


def new_key(path: Path) -> CryptoSigner:
    """Writes a fresh key to `path` and returns what signs by it; OutputError as `keys.new_key`."""
    return CryptoSigner(keys.new_key(path))


def load_key(path: Path) -> CryptoSigner:
    """Returns what signs by the key at `path`; FileError when it is none."""
    return CryptoSigner(keys.load_key(path))


def make_offline_keys(folder: Path, data: Path) -> dict[str, list[CryptoSigner]]:
    """Writes KEYS keys each for root and targets and returns them by role.

    Raises ConfigError for a folder that holds the data folder or lies in it.
    """
    inside = folder.resolve().is_relative_to(data.resolve())
    if inside or data.resolve().is_relative_to(folder.resolve()):
        raise ConfigError(f"--out {folder}: keys that sign must never lie with the data ({data})")
    return {
        role: [new_key(folder / f"{role}-{k}.key") for k in range(1, KEYS + 1)] for role in ROLES
    }


def make_root(signers: dict[str, list[CryptoSigner]], online: CryptoSigner, now: float) -> bytes:
    """Returns the first root, signed: it says whose keys may sign what, and vehicles pin it. now: s."""
    root = Root(version=1, expires=instant(now) + ROOT_VALID, consistent_snapshot=True)
    for role in ROLES:
        for signer in signers[role]:
            root.add_key(signer.public_key, role)
        root.roles[role].threshold = THRESHOLD
    for role in ("snapshot", "timestamp"):
        root.add_key(online.public_key, role)
    return _sign_metadata(Metadata(root), signers["root"][:THRESHOLD])


def empty_targets(signers: Sequence[CryptoSigner], now: float) -> bytes:
    """Returns the first list of updates, signed, which names none. now: s."""
    return _sign_metadata(
        Metadata(Targets(version=1, expires=instant(now) + TARGETS_VALID)), signers
    )


def add_target(
    current: bytes,
    payload: tuple[str, bytes],
    custom: dict[str, Any],
    signers: Sequence[CryptoSigner],
    now: float,
) -> bytes:
    """Returns the next list of updates: the current one and `payload` (name, content), signed anew.

    custom: what is said of it in the list. now: s.
    """  # fmt: skip
    metadata: Metadata[Targets] = Metadata.from_bytes(current)
    targets = metadata.signed
    name, content = payload
    target = TargetFile.from_data(name, content, ["sha256"])
    target.unrecognized_fields["custom"] = custom
    targets.targets[name] = target
    targets.version += 1
    targets.expires = instant(now) + TARGETS_VALID
    return _sign_metadata(Metadata(targets), signers)


def _sign_metadata(metadata: Metadata[Any], signers: Sequence[CryptoSigner]) -> bytes:
    """Returns the metadata as bytes, with the signature of each signer added."""
    for signer in signers:
        metadata.sign(signer, append=True)
    return metadata.to_bytes()
