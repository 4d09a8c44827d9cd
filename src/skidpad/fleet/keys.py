"""Private keys in files that their owner alone may read."""

from __future__ import annotations

import os
from pathlib import Path
from secrets import token_hex

from cryptography.hazmat.primitives import serialization
from cryptography.hazmat.primitives.asymmetric.ec import EllipticCurvePrivateKey
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey

from skidpad.core.errors import FileError, OutputError
from skidpad.core.text.told import on_a_line
from skidpad.recording.files import output_error, write_secret


def secret_pem(key: Ed25519PrivateKey | EllipticCurvePrivateKey) -> bytes:
    """Returns the private key as PEM, not encrypted."""
    return key.private_bytes(
        serialization.Encoding.PEM,
        serialization.PrivateFormat.PKCS8,
        serialization.NoEncryption(),
    )


def new_key(path: Path) -> Ed25519PrivateKey:
    """Writes a fresh Ed25519 key to `path` and returns it; OutputError when a file is there already."""
    key = Ed25519PrivateKey.generate()
    temporary = path.with_name(f".{path.name}.{token_hex(8)}")
    write_secret(temporary, secret_pem(key))
    try:
        os.link(temporary, path)  # in contrast to a rename it replaces nothing
    except FileExistsError:
        raise OutputError(f"{path} exists, and a key is never replaced") from None
    except OSError as error:
        raise output_error(path, error) from error
    finally:
        temporary.unlink()
    return key


def load_key(path: Path) -> Ed25519PrivateKey:
    """Returns the Ed25519 key at `path`; FileError when it is none."""
    try:
        key = serialization.load_pem_private_key(path.read_bytes(), None)
    except (OSError, ValueError, TypeError) as error:
        raise FileError(f"{path}: is not a private key ({on_a_line(error)})") from error
    if not isinstance(key, Ed25519PrivateKey):
        raise FileError(f"{path}: is not an Ed25519 key")
    return key
