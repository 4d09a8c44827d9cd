"""Random identifiers, credentials, and the hashes that are kept of them."""

from __future__ import annotations

import hashlib
import secrets

ID_BYTES = 16
TOKEN_BYTES = 32
PREFIX = "skidpad-"


def new_id() -> str:
    """Returns a random identifier of 32 hexadecimal digits."""
    return secrets.token_hex(ID_BYTES)


def new_token() -> str:
    """Returns a new credential of 256 random bits."""
    return PREFIX + secrets.token_urlsafe(TOKEN_BYTES)


def token_hash(token: str) -> str:
    """Returns the SHA-256 of a credential, all that is kept of it.

    It has 256 random bits, so a plain hash cannot be searched.
    """
    return digest(token.encode("utf-8", "surrogatepass"))


def digest(content: bytes) -> str:
    """Returns the SHA-256 of content as hexadecimal digits."""
    return hashlib.sha256(content).hexdigest()
