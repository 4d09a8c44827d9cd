"""Opens what was asked to listen to a drive, and closes it whatever happens."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path

from skidpad.live.listener import Listener
from skidpad.live.monitor_link import MonitorLink
from skidpad.live.settings import Links, MonitorLinkSettings

MONITORED = ".monitor"  # suffix of the folder beside a recording


@contextmanager
def open_listeners(
    links: Links, channels: Sequence[str], recording: Path
) -> Iterator[list[Listener]]:
    """Yields the started listeners of a drive that is recorded as `recording`; closes them at the end."""
    with ExitStack() as stack:
        listeners: list[Listener] = []
        if links.monitor:
            settings = MonitorLinkSettings(flow=links.flow, pin=links.pin)
            listeners.append(MonitorLink(channels, recording.with_suffix(MONITORED), settings))
            stack.callback(listeners[-1].close)
        for name in links.publish:
            listeners.append(_publisher(name, links, channels, recording))
            stack.callback(listeners[-1].close)
        yield listeners


def _publisher(name: str, links: Links, channels: Sequence[str], recording: Path) -> Listener:
    """Returns the publisher that listens to a drive: over ROS 2 for "ros2", else for Foxglove."""
    if name == "ros2":
        from skidpad.live.ros2.publisher import RosPublisher

        return RosPublisher(channels, recording, links.flow, links.domain)
    from skidpad.live.scene import ScenePublisher

    return ScenePublisher(channels, recording, links.scene_port)
