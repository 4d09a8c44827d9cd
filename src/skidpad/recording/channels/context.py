"""Words about a recorded drive."""

from __future__ import annotations

from skidpad.core.channels import Context
from skidpad.recording.channels.mcap_files import ChannelSource


def context_of(source: ChannelSource) -> dict[str, str]:
    """Returns all words of the recording; of those said twice the later ones."""
    words: dict[str, str] = {}
    for message in source.messages():
        if isinstance(message.item, Context):
            words |= message.item.entries
    return words
