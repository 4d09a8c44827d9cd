"""The served simulation: an episode, and what a tick does to it and tells of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from skidpad.core.vocabulary import LightState
from skidpad.simulation.carla_server import snapshot
from skidpad.simulation.carla_server.clock import Clock, EpisodeSettings
from skidpad.simulation.carla_server.episode import Episode, Stock
from skidpad.simulation.carla_server.maps.landscape import ALL_LAYERS
from skidpad.simulation.carla_server.maps.maps import MapStore
from skidpad.simulation.carla_server.options import ServerOptions
from skidpad.simulation.carla_server.protocol.streams import EPISODE_STREAM, StreamHub
from skidpad.simulation.carla_server.recording.recorder import Recorder
from skidpad.simulation.carla_server.recording.replayer import Replayer
from skidpad.simulation.carla_server.ros_output import RosOutput


@dataclass(slots=True)
class TrafficManagers:
    """Addresses at which clients' Traffic Managers said that they listen."""

    by_port: dict[int, str] = field(default_factory=dict)


class Served:
    """What clients' calls act on."""

    def __init__(self, options: ServerOptions, hub: StreamHub) -> None:
        self.options, self.hub = options, hub
        self.maps = MapStore(options.maps, options.scenery)
        self.stock = Stock(options, hub)
        self.clock = Clock()
        self.recorder = Recorder(options.data_dir)
        self.replayer = Replayer()
        self.managers = TrafficManagers()
        self.platform_time: Callable[[], float] = lambda: 0.0
        self.announce: Callable[[int], None] = lambda _: None  # a stream that is about to be heard
        self.follows_batch = (
            False  # the request at hand came right after a batch of the same client
        )
        self.before_sensing: Callable[[], None] | None = None  # once, before the first reading
        # called with frame and step in s before each tick: what holds vehicles back
        self.before_tick: Callable[[Episode, int, float], None] | None = None
        self.ros: RosOutput | None = None  # where sensors publish that clients enable for ROS 2
        self.last_snapshot: bytes | None = None
        self._map_changed = True  # until the first snapshot of the episode has been sent
        self._lights_told: dict[int, LightState] = {}
        hub.on_subscribe = self._latest
        self.episode = Episode(self.maps.load(options.map), self.stock, self.clock)
        self._publish_snapshot()

    def _latest(self, stream: int) -> bytes | None:
        """Returns the newest snapshot for its stream, None for others.

        So a second client in synchronous mode gets it at once.
        """
        return self.last_snapshot if stream == EPISODE_STREAM else None

    def load(self, name: str, reset_settings: bool, layers: int = ALL_LAYERS) -> None:
        """Loads another map, or with "" the same one anew; a map that cannot be served changes nothing.

        CallError for that.
        """
        map = self.episode.map if name == "" else self.maps.load(name)
        episode = Episode(map, self.stock, self.clock, layers)
        self.hub.hold(EPISODE_STREAM)
        self.replayer.release()
        self.recorder.stop()
        self.episode.end()
        self.episode = episode
        self.clock.renew(reset_settings)
        episode.moving.set_step(self.clock.step)
        self._map_changed = True
        self._publish_snapshot()

    def apply(self, settings: EpisodeSettings) -> None:
        """Applies settings from the next tick on."""
        self.clock.settings = settings
        self.episode.moving.set_step(settings.step)

    def tick(self) -> int:
        """Advances by one step, publishes snapshot and sensors, and returns the new frame's number."""
        clock, episode = self.clock, self.episode
        if self.before_tick is not None:
            self.before_tick(episode, clock.frame, clock.step)
        clock.advance()
        episode.move(clock.step)
        self.replayer.tick(clock.step)
        episode.follow()
        episode.debug.age(clock.step)
        self._publish_snapshot()
        episode.vehicles.let_go()
        self.recorder.tick(clock, episode)
        if self.ros is not None:
            self.ros.tick(episode, clock)
        if self.before_sensing is not None and episode.sensors.has_listeners(self.hub):
            self.before_sensing()
            self.before_sensing = None
        episode.sensors.produce(episode.surroundings, clock, self.hub)
        return clock.frame

    def _publish_snapshot(self) -> None:
        """Makes the snapshot of the tick, keeps it, and publishes it where it has listeners."""
        lights = self.episode.moving.lights.by_id
        bits = snapshot.MAP_CHANGED if self._map_changed else 0
        if lights != self._lights_told:
            bits |= snapshot.LIGHTS_CHANGED
        self._lights_told = lights
        self.episode.fill_rows(self.clock.step)
        self.last_snapshot = snapshot.message(
            self.clock, self.episode.rows, self.platform_time(), bits
        )
        if self.hub.has_listeners(EPISODE_STREAM):
            self.hub.publish(EPISODE_STREAM, self.last_snapshot)
            self._map_changed = False
