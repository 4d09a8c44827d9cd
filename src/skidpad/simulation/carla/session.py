"""One run on a server: who is there, what was asked of it, and what came back."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from math import cos, inf, sin
from types import MappingProxyType
from typing import Any

import numpy as np

from skidpad.core.errors import BackendError, ConfigError
from skidpad.core.frames import LidarPoints, RadarPoints, SensorFrame
from skidpad.core.geometry import Pose
from skidpad.core.lefthanded import mirrored
from skidpad.core.setup import ActorCommand, Setup
from skidpad.core.specs import LidarSpec, RadarSpec
from skidpad.core.states import ActorStates, VehicleCommand, WorldTruth
from skidpad.core.vocabulary import RangeModel, SensorLevel, TrafficStart
from skidpad.physics.optics import radar_range
from skidpad.roads.bundled import load_map
from skidpad.roads.queries import LanePoint
from skidpad.sensors.asked import AskedSensors
from skidpad.simulation.carla import decode, truth
from skidpad.simulation.carla.axes import to_transform, to_vector
from skidpad.simulation.carla.cast import Player, spawn_setup, table_of
from skidpad.simulation.carla.connection import Connection
from skidpad.simulation.carla.events import EgoEvents
from skidpad.simulation.carla.grip import prepare_grip
from skidpad.simulation.carla.lights import Programme, TrafficLights
from skidpad.simulation.carla.odometry import Odometry
from skidpad.simulation.carla.options import Optimisation
from skidpad.simulation.carla.pacer import rest
from skidpad.simulation.carla.pictures import Pictures
from skidpad.simulation.carla.ports import free_port
from skidpad.simulation.carla.scene import load_scene, release, synchronise
from skidpad.simulation.carla.sensors import Sensors
from skidpad.simulation.carla.traffic import Traffic, spawn_fixed, spawn_random
from skidpad.simulation.carla.weather import set_weather
from skidpad.simulation.sensing import Objects, Readings

EGO = 0
SETTLE = 8  # ticks in which vehicles fall onto the road and sensors begin to send
SETTLE_MAX = 60
SETTLE_PAUSE = 0.02  # s after each of them, for the wheel's threads to subscribe
STILL = 0.05  # m/s of vertical speed at which the ego stands on the road
HOLD = VehicleCommand(brake=1.0)
GROUND_GAP = 0.1  # m above our map's road at which relocated vehicles are put


class Session:
    """Everything of one run."""

    def __init__(self, connection: Connection, setup: Setup, seed: int) -> None:
        self.connection, self.setup, self.seed = connection, setup, seed
        self.carla, self.options = connection.carla, connection.options
        self.map = load_map(setup.map)
        self.tick = 0
        self.server_frame = 0
        self.players: list[Player] = []
        self.sensors: Sensors | None = None
        self.traffic: Traffic | None = None
        self.pictures: Pictures | None = None
        self.notices: list[str] = []
        self.command = VehicleCommand()
        self.world = load_scene(connection, setup)
        synchronise(self.world, setup)
        set_weather(self.carla, self.world, setup.weather)
        self.world.set_pedestrians_seed(seed % 2**31)

    # --- beginning

    def begin(self) -> None:
        """Actors, sensors, grip; then let everything come to rest and start the clock."""
        self._spawn()
        n = len(self.players)
        self.table = table_of(self.players)
        self.states = ActorStates.empty(n)
        self.commands, self.mu = np.zeros((n, 5)), np.full((n, 4), np.nan)
        self.index = {p.name: i for i, p in enumerate(self.players)}
        width = self.players[EGO].size[1]
        self.odometry = Odometry(self.seed, self.setup.localisation_noise, width)
        self.grip = prepare_grip(self.carla, self.world, self.setup)
        for player in self.players:
            self._grip_on(player)
        self.programme = Programme(self.carla, self.world, self.map, self.seed, self.setup.dt)
        self.lights = TrafficLights(self.world, self.options.uses(Optimisation.LIGHT_CACHE))
        self.events = EgoEvents(self.map, self.players, self.setup.dt)
        ego = self.players[EGO].actor
        self.sensors = Sensors(self.connection, self.world, ego, self.setup, self.events)
        self._make_readers()
        self._settle()
        self._engage()
        self.notices += self.grip.notices
        self._read()

    def _spawn(self) -> None:
        setup, world = self.setup, self.world
        for actor in (setup.ego, *setup.actors):
            self.players.append(spawn_setup(self.carla, world, self.map, actor))
        point = self._ego_point()
        where = f"road {point.road}, lane {point.lane_id}" if point else "no lane"
        self.notices.append(f"ego: {self.players[EGO].type} on {where}")
        traffic = setup.traffic
        if traffic is None or traffic.vehicles == 0:
            return
        if traffic.mode is TrafficStart.FIXED:
            if point is None:
                raise ConfigError("fixed traffic needs an ego that starts on a driving lane")
            players, told = spawn_fixed(self.carla, world, self.map, point, traffic, self.seed)
            self.notices += told
        else:
            players = spawn_random(self.carla, world, self._ego_pose(), traffic, self.seed)
        self.players += players

    def _ego_pose(self) -> Pose:
        place = self.setup.ego.place
        if isinstance(place, Pose):
            return place
        point = self.map.place(place)
        return point.pose.moved(left=point.offset)

    def _ego_point(self) -> LanePoint | None:
        pose = self._ego_pose()
        point = self.map.project(pose.x, pose.y, pose.z)
        return None if point is None else replace(point, offset=0.0)

    def _grip_on(self, player: Player) -> None:
        """Only vehicles have tyres (B-065)."""
        if player.actor is not None and player.is_vehicle:
            self.grip.apply(player.actor)

    def _make_readers(self) -> None:
        setup = self.setup
        self.objects = None
        if setup.level is SensorLevel.OBJECTS:
            self.objects = Objects(self.map, self.table, setup, self.seed)
        assert self.sensors is not None
        pooled = self.options.uses(Optimisation.FEED_POOL)
        self.pictures = Pictures(setup, self.seed, self.sensors.silent, pooled)
        for i, player in enumerate(self.players):
            if player.actor is not None:
                self.pictures.rows[player.actor.id % len(self.pictures.rows)] = i + 1
        self.asked = None
        if setup.asked:
            self.asked = AskedSensors(self.map, self.table, setup, self._lidar)
        self.radar_id = next((s.id for s in setup.specs if isinstance(s, RadarSpec)), None)
        self.radar_limit = inf
        for spec in setup.specs:
            if isinstance(spec, RadarSpec) and setup.range_model is RangeModel.PHYSICAL:
                self.radar_limit = radar_range(setup.weather, spec.range)

    def _settle(self) -> None:
        """Always the same number of ticks where the server is quick, so that runs repeat."""
        assert self.sensors is not None
        for player in self.players:
            if player.actor is not None and player.is_vehicle:
                player.actor.apply_control(self._control(HOLD))
        for k in range(SETTLE_MAX):
            frame = self._advance()
            rest(SETTLE_PAUSE)
            ego = self.world.get_snapshot().find(self.players[EGO].actor.id)
            if k + 1 < SETTLE or abs(ego.get_velocity().z) > STILL:
                continue
            found = self.sensors.collect(frame, timeout=1.0)
            if found is not None:
                self.messages = found
                return
        raise BackendError(
            f"CARLA at {self.options.address}: the ego or its sensors did not come to rest within "
            f"{SETTLE_MAX} ticks"
        )

    def _engage(self) -> None:
        """Start: initial speeds, drivers on their seats."""
        setups = (self.setup.ego, *self.setup.actors)
        self._starting = {i: s.speed for i, s in enumerate(setups) if s.speed != 0.0}
        for player in self.players:
            if player.actor is not None and player.is_vehicle:
                player.actor.apply_control(self._control(VehicleCommand()))
        if all(p.actor is not None and not p.autopilot for p in self.players):
            return
        self.traffic = Traffic(self.connection, free_port(), self.setup.dt, self.seed)
        for player in self.players:
            if player.autopilot:
                self.traffic.drive(player)
        self.traffic.wait_for([p for p in self.players if p.actor is None])

    # --- driving

    def step(self, command: VehicleCommand, actor_commands: Iterable[ActorCommand]) -> None:
        """One tick."""
        self.command = command
        self._push(EGO, self.players[EGO])
        self.players[EGO].actor.apply_control(self._control(command))
        for word in actor_commands:
            self._obey(word)
        for i, player in enumerate(self.players[1:], start=1):
            self._push(i, player)
        self._starting.clear()
        self.programme.show(self.tick + 1)
        frame = self._advance()
        self.tick += 1
        assert self.sensors is not None
        found = self.sensors.collect(frame)
        assert found is not None, "without a timeout of its own, collect raises"
        self.messages = found
        self.notices = []
        if self.traffic is not None:
            self._top_up()
        self._read()

    def _push(self, i: int, player: Player) -> None:
        """An initial speed: the wheel's target velocity acts in the coming tick."""
        v = self._starting.get(i)
        if v is not None and player.actor is not None:
            yaw = float(self.states.yaw[i])
            player.actor.set_target_velocity(to_vector(self.carla, v * cos(yaw), v * sin(yaw)))

    def _advance(self) -> int:
        """Tick the world; its frame number. The images of the last tick are no longer needed."""
        if self.pictures is not None:
            self.pictures.finish()
        self.server_frame = int(self.world.tick(self.options.timeout))
        return self.server_frame

    def _top_up(self) -> None:
        assert self.traffic is not None
        for player in self.traffic.top_up(self.world, self.tick, self.states.pose(EGO)):
            self._grip_on(player)
            i = self.index[player.name]
            self.table.length[i], self.table.width[i], self.table.height[i] = player.size
            self.table.kind[i] = player.kind
            self.notices.append(f"{player.name} entered")

    def _control(self, c: VehicleCommand) -> Any:
        return self.carla.VehicleControl(
            throttle=c.throttle,
            steer=mirrored(c.steer),
            brake=c.brake,
            hand_brake=c.handbrake,
            reverse=c.reverse,
        )

    def _obey(self, word: ActorCommand) -> None:
        """Follow a player's word."""
        i = self.index.get(word.actor)
        if i is None:
            raise ConfigError(f"there is no actor {word.actor!r} in this run")
        player = self.players[i]
        if word.present is not None:
            self._appear(i, player, word.present)
        if player.actor is None:
            return
        if word.command is not None or word.place is not None:
            self._release(player)
        if word.command is not None:
            player.actor.apply_control(self._control(word.command))
        if word.place is not None:
            self._place(player, word.place, word.speed or 0.0)

    def _release(self, player: Player) -> None:
        if self.traffic is not None:
            self.traffic.release(player)

    def _place(self, player: Player, pose: Pose, v: float) -> None:
        """Stand at `pose` with speed v when the coming tick ends: begin it so much further back."""
        start = self._on_road(pose).moved(forward=-v * self.setup.dt)
        player.actor.set_transform(to_transform(self.carla, player.origin(start)))
        velocity = to_vector(self.carla, v * cos(pose.yaw), v * sin(pose.yaw))
        player.actor.set_target_velocity(velocity)
        if player.type.startswith("walker."):
            direction = to_vector(self.carla, cos(pose.yaw), sin(pose.yaw))
            player.actor.apply_control(self.carla.WalkerControl(direction, v, False))

    def _on_road(self, pose: Pose) -> Pose:
        """The height of our map's road at this place."""
        point = self.map.project(pose.x, pose.y, pose.z, driving=False)
        return pose if point is None else replace(pose, z=point.z + GROUND_GAP)

    def _appear(self, i: int, player: Player, present: bool) -> None:
        """Enter the world where it was left, or leave it."""
        if present and player.actor is None and player.rested is not None:
            blueprint = self.world.get_blueprint_library().find(player.type)
            pose = player.origin(player.rested).moved(up=GROUND_GAP)
            player.actor = self.world.spawn_actor(blueprint, to_transform(self.carla, pose))
            self._grip_on(player)
        elif not present and player.actor is not None:
            player.rested = self.states.pose(i)
            self._release(player)
            player.actor.destroy()
            player.actor = None

    def relocate(self, pose: Pose, v: float) -> None:
        """Put the ego elsewhere; it moves from there in the coming tick."""
        ego = self.players[EGO]
        place = self._on_road(pose)
        ego.actor.set_transform(to_transform(self.carla, ego.origin(place)))
        velocity = to_vector(self.carla, v * cos(pose.yaw), v * sin(pose.yaw))
        ego.actor.set_target_velocity(velocity)
        ego.actor.set_target_angular_velocity(self.carla.Vector3D())
        self.events.forget(self.tick)
        truth.move_row(self.states, EGO, replace(place, z=place.z - GROUND_GAP), v)

    # --- reading

    def _read(self) -> None:
        """States, commands, lights and events of this tick."""
        local = self.options.uses(Optimisation.LOCAL_TRUTH)
        source = self.world.get_snapshot() if local else self.world.get_actors()
        truth.read_states(self.players, source, self.states)
        for i, v in self._starting.items():
            truth.move_row(self.states, i, self.states.pose(i), v)
        truth.read_commands(self.players, self.command, self.commands)
        truth.read_mu(self.players, self.grip, self.states, self.mu)
        self.light_states = self.lights.read()
        self.contacts = self.events.contacts(self.tick, self.server_frame)
        self.events.remember(self.server_frame, self.states)
        self.invasions = self.events.invasions(self.tick, self.states)

    def truth(self) -> WorldTruth:
        """Ground truth of the moment."""
        return WorldTruth(
            tick=self.tick,
            table=self.table,
            states=self.states,
            mu=self.mu,
            commands=self.commands,
            lights=self.light_states,
            contacts=self.contacts,
            invasions=self.invasions,
            notices=tuple(self.notices),
        )

    def frame(self) -> SensorFrame:
        """What the ego's sensors say."""
        seen, asked = self._readings(), self.asked
        gear = int(self.players[EGO].actor.get_control().gear)
        return SensorFrame(
            tick=self.tick,
            ego=self.odometry.read(self.states, gear),
            images=seen.images,
            segments=seen.segments,
            radar=seen.radar,
            lights=MappingProxyType(self.light_states),
            contacts=self.contacts,
            invasions=self.invasions,
            extra={} if asked is None else asked.read(self.tick, self.states, seen.images),
        )

    def _lidar(self, spec: LidarSpec) -> LidarPoints:
        """The server's; GNSS, IMU and speedometer are read off the body, as in our own world."""
        assert self.pictures is not None
        assert self.asked is not None
        raw = self.messages[spec.id].raw_data
        return decode.lidar_points(raw, self.pictures.rows, self.asked.air)

    def _readings(self) -> Readings:
        if self.objects is not None:
            braking = self.commands[:, 1] > 0.0
            return self.objects.read(self.tick, self.states, self.light_states, braking)
        assert self.pictures is not None
        images = self.pictures.of(self.tick, self.messages)
        radar = RadarPoints.none()
        if self.radar_id is not None:
            radar = decode.radar_points(self.messages[self.radar_id].raw_data, self.radar_limit)
        return Readings(images, {}, radar)

    # --- end

    def close(self) -> None:
        """Leave the server as it was found: nobody of ours, asynchronous."""
        if self.pictures is not None:
            self.pictures.close()
        if self.sensors is not None:
            self.sensors.close()
        if self.traffic is not None:
            self.traffic.close()
        leaving = [p.actor for p in self.players if p.actor is not None]
        commands = [self.carla.command.DestroyActor(actor) for actor in leaving]
        self.connection.client.apply_batch_sync(commands, False)
        release(self.world)
