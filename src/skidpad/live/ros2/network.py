"""The DDS domain, and how readers and writers meet."""

from __future__ import annotations

import logging
import os
import threading
from typing import Any

from skidpad.core.errors import MissingExtra
from skidpad.live.settings import Flow

try:
    from cyclonedds.core import Policy, Qos
    from cyclonedds.domain import Domain, DomainParticipant
    from cyclonedds.util import duration
except ImportError as error:
    raise MissingExtra("ROS 2 topics", "live") from error

# This machine only, unless CYCLONEDDS_URI says otherwise; 127.0.0.1 as peer needs no multicast.
LOOPBACK = """<CycloneDDS><Domain><General><Interfaces><NetworkInterface name="lo"/></Interfaces>
<AllowMulticast>false</AllowMulticast></General><Discovery><ParticipantIndex>auto</ParticipantIndex>
<MaxAutoParticipantIndex>60</MaxAutoParticipantIndex><Peers><Peer address="127.0.0.1"/></Peers>
</Discovery></Domain></CycloneDDS>"""
BLOCKING = 120.0  # s that a lossless writer waits for a reader's room
_DOMAINS: dict[int, Any] = {}  # a process may configure a domain once
_LOCK = threading.Lock()
log = logging.getLogger(__name__)


def participant(domain: int) -> Any:
    """Returns a new participant of a DDS domain; the first one logs what that opens."""
    with _LOCK:
        if domain not in _DOMAINS:
            log.warning(
                "DDS domain %d: its sockets are bound to all interfaces of this machine, and whoever"
                " reaches them is believed, unauthenticated",
                domain,
            )
            said = os.environ.get("CYCLONEDDS_URI")
            _DOMAINS[domain] = None if said else Domain(domain, LOOPBACK)
        return DomainParticipant(domain)


def qos(flow: Flow, announced: bytes = b"") -> Any:
    """Returns the policies of a flow: lossless keeps all, live keeps the newest 10 and never waits."""
    kept = [Policy.Reliability.Reliable(duration(seconds=0)), Policy.History.KeepLast(10)]
    if flow is Flow.LOSSLESS:
        kept = [Policy.Reliability.Reliable(duration(seconds=BLOCKING)), Policy.History.KeepAll]
    said = [Policy.Userdata(announced)] if announced else []
    return Qos(*kept, *said)


def like(writer: Any) -> Any:
    """Returns the policies of a reader that fits a writer's: its reliability, and all of its history."""
    reliability = Policy.Reliability.Reliable(duration(seconds=BLOCKING))
    if Policy.Reliability.BestEffort in writer:
        reliability = Policy.Reliability.BestEffort
    return Qos(reliability, Policy.History.KeepAll)


def said_of_type(writer: Any) -> str:
    """Returns the type hash that a writer announces, "" where it says none."""
    data = writer[Policy.Userdata].data if Policy.Userdata in writer else b""
    text = bytes(data).decode(errors="replace")
    return next(
        (w.removeprefix("typehash=") for w in text.split(";") if w.startswith("typehash=")), ""
    )
