"""A port for the wheel's Traffic Manager, which listens on one of its own."""

from __future__ import annotations

import socket


def free_port() -> int:
    """Returns a TCP port that no program listens on now."""
    with socket.socket() as probe:
        probe.bind(("", 0))
        return int(probe.getsockname()[1])
