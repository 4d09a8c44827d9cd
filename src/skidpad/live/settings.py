"""Settings of the links between a drive and its listeners."""

from __future__ import annotations

from enum import Enum
from typing import Annotated

from msgspec import Meta, Struct

from skidpad.core.errors import ConfigError, require_choice

PUBLISHERS = ("ros2", "foxglove")


class Flow(str, Enum):
    """Whether the drive waits for its listeners."""

    LOSSLESS = "lossless"  # the drive waits: campaigns, recordings
    LIVE = "live"  # the drive never waits: what does not fit in the queue is dropped and counted


class Links(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The listeners of a drive of channels. They change nothing of the drive, so no run value has them."""

    monitor: Annotated[
        bool,
        Meta(description="Judge each drive while it goes on: NAME.monitor beside its recording."),
    ] = False
    live: Annotated[
        bool,
        Meta(description="Hold drives at real time; what a listener is too slow for is dropped."),
    ] = False
    publish: Annotated[
        tuple[str, ...],
        Meta(description="ros2: topics over DDS; foxglove: a live scene.", extra={"parted": True}),
    ] = ()
    domain: Annotated[int, Meta(ge=0, le=232, description="DDS domain (ROS_DOMAIN_ID).")] = 0
    scene_port: Annotated[
        int, Meta(ge=0, le=65535, description="Of the live scene for Foxglove; 0: any free one.")
    ] = 8765
    pin: Annotated[
        int | None, Meta(ge=0, description="Processor for the monitor, at highest priority.")
    ] = None

    def __post_init__(self) -> None:
        for name in self.publish:
            require_choice("--publish", name, PUBLISHERS)
        if self.pin is not None and not self.monitor:
            raise ConfigError("--pin gives the monitor a processor and needs --monitor")

    @property
    def flow(self) -> Flow:
        """Returns the flow: live drives never wait for their listeners, others do."""
        return Flow.LIVE if self.live else Flow.LOSSLESS


class MonitorLinkSettings(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A monitor in a process of its own."""

    flow: Flow = Flow.LOSSLESS
    capacity: int = 20  # cycles that wait in the drive's process: 2 s
    patience: float = 120.0  # s without any progress after which the monitor counts as hanging
    pin: int | None = None  # processor for the monitor alone (C-231)

    def __post_init__(self) -> None:
        if self.capacity < 1:
            raise ConfigError(f"capacity of a link must be at least 1 cycle, got {self.capacity}")
