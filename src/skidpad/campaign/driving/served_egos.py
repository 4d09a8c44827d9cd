"""The speed envelope around egos of `skidpad carla-server`, whatever program drives them.

An ego is a vehicle whose role_name is one of EGO_ROLES. What its client asks for is the command of a stack
that is governed as in every other drive, by a radar, rain sensor, thermometer and bus of the car's own.
"""

from __future__ import annotations

from math import inf

from skidpad.campaign.driving.governing import describe_envelope
from skidpad.core.errors import require_choice
from skidpad.core.frames import SensorFrame
from skidpad.core.geometry import Pose
from skidpad.core.specs import RadarSpec
from skidpad.core.states import EgoEstimate, VehicleCommand
from skidpad.core.vocabulary import Govern
from skidpad.envelope.envelope import AIR_ID, RAIN_ID
from skidpad.envelope.govern import GovernedStack
from skidpad.physics.grip import rain_rate
from skidpad.sensors.outside import read_thermometer, thermometer_error, wiper_stage
from skidpad.sensors.ranging.beam import beam_of
from skidpad.sensors.ranging.radar import Radar
from skidpad.simulation.carla_server.actors.registry import Actor
from skidpad.simulation.carla_server.episode import Episode
from skidpad.simulation.carla_server.vehicles.vehicles import Vehicle
from skidpad.simulation.world.feel import feel_motion

EGO_ROLES = ("hero", "ego", "ego_vehicle")  # of ScenarioRunner and examples; ROS bridges
RADAR = RadarSpec("envelope_radar", Pose(2.0, 0.0, 1.0))  # where the twelve sensors have theirs
# they need what a client's program does not give: the truth of the weather, or cameras of the stack
UNSERVED = (Govern.NONE, Govern.ORACLE, Govern.ORACLE_SIGHT, Govern.FULL)
SERVED = tuple(g for g in Govern if g not in UNSERVED)


class ClientStack:
    """A stack whose command is what the client asks for."""

    def __init__(self) -> None:
        self.command = VehicleCommand()

    def tick(self, frame: SensorFrame) -> VehicleCommand:
        """Returns the client's command, whatever the frame."""
        del frame
        return self.command


class GovernedEgo:
    """One ego: its radar, its thermometer and its governed stack."""

    def __init__(self, episode: Episode, govern: Govern, dt: float, seed: int) -> None:
        settings = describe_envelope(govern, dt, seed)
        assert settings is not None, "an ego that nothing governs"
        self.dt, self.client = dt, ClientStack()
        self.stack = GovernedStack(self.client, (RADAR,), episode.map.roads, settings)
        self.radar = Radar(RADAR, beam_of(RADAR, seed, dt), inf)
        self.error_c = thermometer_error(seed, AIR_ID)

    def hold_back(self, episode: Episode, vehicle: Vehicle, actor: Actor, tick: int) -> None:
        """Sets the most throttle and the least brake with which the vehicle drives in the coming tick."""
        c = vehicle.control
        self.client.command = VehicleCommand(c.throttle, c.brake, c.steer, c.hand_brake, c.reverse)
        after = self.stack.tick(self._sense(episode, vehicle, actor, tick))
        vehicle.most_throttle = after.throttle if after.throttle < c.throttle else 1.0
        vehicle.least_brake = after.brake if after.brake > c.brake else 0.0

    def _sense(self, episode: Episode, vehicle: Vehicle, actor: Actor, tick: int) -> SensorFrame:
        """Returns what the envelope reads: motion of the car, radar, rain sensor and thermometer."""
        around, weather = episode.surroundings, episode.sky.weather
        x, y, z, roll, pitch, yaw, speed, yaw_rate, ax, ay, *wheels = feel_motion(
            episode.moving.arena, episode.vehicles.row(actor.id)
        )
        pose = Pose(x, y, z, roll, pitch, yaw)
        pictured = around.picture()
        return SensorFrame(
            tick=tick,
            ego=EgoEstimate(
                pose, speed, yaw_rate, ax, ay, (wheels[0], wheels[1], wheels[2], wheels[3]),
                vehicle.gear(speed),
            ),
            images={},
            segments={},
            radar=self.radar.measure(tick, pose, pictured.live, pictured.rows.get(actor.id, -1)),
            lights={},
            extra={
                RAIN_ID: wiper_stage(rain_rate(weather)),
                AIR_ID: read_thermometer(weather.air_temperature_c, self.error_c),
            },
        )  # fmt: skip


class GovernedEgos:
    """All egos of a server; call it once before each tick."""

    def __init__(self, govern: Govern, seed: int) -> None:
        """Raises ConfigError for a word of --govern that needs more than a server has."""
        require_choice("--govern", govern.value, [g.value for g in SERVED])
        self.govern, self.seed = govern, seed
        self.episode: Episode | None = None
        self.egos: dict[int, GovernedEgo] = {}  # by actor id

    def __call__(self, episode: Episode, tick: int, dt: float) -> None:
        """Holds back every ego of the episode; one that is new, or has a new step, knows nothing yet."""
        if episode is not self.episode:
            self.episode, self.egos = episode, {}
        for vehicle in episode.vehicles:
            actor = episode.actors.get(vehicle.actor)
            if actor.attributes.get("role_name") not in EGO_ROLES:
                continue
            ego = self.egos.get(actor.id)
            if ego is None or ego.dt != dt:
                ego = self.egos[actor.id] = GovernedEgo(episode, self.govern, dt, self.seed)
            ego.hold_back(episode, vehicle, actor, tick)
