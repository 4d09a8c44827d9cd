"""Words about a recorded drive."""

from __future__ import annotations

from skidpad.core.channels import Context
from skidpad.recording.channels import ChannelSource


def route_of(source: ChannelSource) -> str | None:
    """The route that the recording names first; None when it names none."""
    for message in source.messages():
        if isinstance(message.item, Context) and "route" in message.item.entries:
            return message.item.entries["route"]
    return None
