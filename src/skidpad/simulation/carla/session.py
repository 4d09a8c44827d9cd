"""One run on a server: its actors, the commands sent, and the readings that came back."""

from __future__ import annotations

import socket
from collections.abc import Iterable
from dataclasses import replace
from types import MappingProxyType
from typing import Any

import numpy as np

from skidpad.core.errors import BackendError, ConfigError
from skidpad.core.frames import SensorFrame
from skidpad.core.geometry import Pose
from skidpad.core.maths.randomness import stream
from skidpad.core.setup import ActorCommand, Setup
from skidpad.core.states import ActorStates, EgoEstimate, VehicleCommand, WorldTruth
from skidpad.core.vocabulary import LightState, TrafficStart
from skidpad.roads.bundled import load_map
from skidpad.roads.queries import LanePoint, RoadMap
from skidpad.simulation.carla import truth
from skidpad.simulation.carla.actor_rows import ActorRow, spawn_setup, table_of
from skidpad.simulation.carla.actor_set import EGO, ActorSet
from skidpad.simulation.carla.connection import Connection
from skidpad.simulation.carla.events import EgoEvents
from skidpad.simulation.carla.grip import prepare_grip
from skidpad.simulation.carla.options import Optimisation
from skidpad.simulation.carla.pictures import Pictures
from skidpad.simulation.carla.reader import Reader
from skidpad.simulation.carla.scene import load_scene, release, synchronise
from skidpad.simulation.carla.sensors import Sensors
from skidpad.simulation.carla.traffic import Traffic, spawn_fixed, spawn_random
from skidpad.simulation.carla.watchdog import rest
from skidpad.simulation.carla.weather import set_weather
from skidpad.simulation.world.actors import place_of
from skidpad.simulation.world.lights import Lights

TRACK = 0.8  # of a car's width, between its wheels
SETTLE = 8  # ticks in which vehicles fall onto the road and sensors begin to send
SETTLE_MAX = 60
SETTLE_PAUSE = 0.02  # s after each of them, for the wheel's threads to subscribe
STILL = 0.05  # m/s of vertical speed at which the ego stands on the road
HOLD = VehicleCommand(brake=1.0)


class Session:
    """Holds everything of one run on a server."""

    def __init__(self, connection: Connection, setup: Setup, seed: int) -> None:
        self.connection, self.setup, self.seed = connection, setup, seed
        self.carla, self.options = connection.carla, connection.options
        self.map = load_map(setup.map)
        self.tick = 0
        self.server_frame = 0
        self.players: list[ActorRow] = []
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
        """Spawns actors, sensors and grip, lets everything come to rest, and starts the clock.

        Ticks the server. BackendError and ConfigError as from these.
        """
        setup, players = self.setup, self.players
        self._spawn()
        n = len(players)
        self.table = table_of(players)
        self.states = ActorStates.empty(n)
        self.commands, self.mu = np.zeros((n, 5)), np.full((n, 4), np.nan)
        self.odometry = Odometry(self.seed, setup.localisation_noise, players[EGO].size[1])
        self.grip = prepare_grip(self.carla, self.world, setup)
        self.actor_set = ActorSet(self.carla, self.world, self.map, players, self.grip, setup.dt)
        self.programme = Programme(self.carla, self.world, self.map, self.seed, setup.dt)
        self.lights = TrafficLights(self.world, self.options.uses(Optimisation.LIGHT_CACHE))
        self.events = EgoEvents(self.map, players, setup.dt)
        ego = self.actor_set.ego
        self.sensors = Sensors(self.connection, self.world, ego, setup, self.events)
        pooled = self.options.uses(Optimisation.FEED_POOL)
        self.pictures = Pictures(setup, self.seed, self.sensors.silent, pooled)
        self.reader = Reader(self.map, self.table, setup, self.seed, self.pictures)
        self.reader.know(players)
        self._settle(self.sensors)
        self._engage()
        self.notices += self.grip.notices
        self._read()

    def _spawn(self) -> None:
        """Spawns the ego, the scenario's actors and the traffic, and notes the lane of the ego."""
        setup, world = self.setup, self.world
        for actor in (setup.ego, *setup.actors):
            self.players.append(spawn_setup(self.carla, world, self.map, actor))
        pose = place_of(self.map, setup.ego.place)
        point = self._lane_under(pose)
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
            players = spawn_random(self.carla, world, pose, traffic, self.seed)
        self.players += players

    def _lane_under(self, pose: Pose) -> LanePoint | None:
        """Returns the centreline point of the lane under a pose; None off the road."""
        point = self.map.project(pose.x, pose.y, pose.z)
        return None if point is None else replace(point, offset=0.0)

    def _settle(self, sensors: Sensors) -> None:
        """Ticks until the ego stands and its sensors send; BackendError after SETTLE_MAX ticks.

        Always SETTLE ticks where the server is quick, so that runs repeat.
        """
        self.actor_set.command_all(HOLD)
        for k in range(SETTLE_MAX):
            frame = self._advance()
            rest(SETTLE_PAUSE)
            ego = self.world.get_snapshot().find(self.actor_set.ego.id)
            if k + 1 < SETTLE or abs(ego.get_velocity().z) > STILL:
                continue
            found = sensors.collect(frame, timeout=1.0)
            if found is not None:
                self.messages = found
                return
        raise BackendError(
            f"CARLA at {self.options.address}: the ego or its sensors did not come to rest within "
            f"{SETTLE_MAX} ticks"
        )

    def _engage(self) -> None:
        """Releases the brakes, notes initial speeds and hands drivers on autopilot to the Traffic Manager."""
        setups = (self.setup.ego, *self.setup.actors)
        self._starting = {i: s.speed for i, s in enumerate(setups) if s.speed != 0.0}
        self.actor_set.command_all(VehicleCommand())
        if all(p.actor is not None and not p.autopilot for p in self.players):
            return
        self.traffic = Traffic(self.connection, free_port(), self.setup.dt, self.seed)
        self.actor_set.traffic = self.traffic
        for player in self.players:
            if player.autopilot:
                self.traffic.drive(player)
        self.traffic.wait_for([p for p in self.players if p.actor is None])

    # --- driving

    def step(self, command: VehicleCommand, actor_commands: Iterable[ActorCommand]) -> None:
        """Applies the commands, advances the server by one tick and reads what came.

        BackendError where a sensor's message does not come.
        """
        self.command = command
        self._push(EGO)
        self.actor_set.command(self.players[EGO], command)
        for word in actor_commands:
            self.actor_set.obey(word, self.states)
        for i in range(1, len(self.players)):
            self._push(i)
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
            self._top_up(self.traffic)
        self._read()

    def _push(self, i: int) -> None:
        """Gives actor i its initial speed along its yaw, where it has one."""
        v = self._starting.get(i)
        if v is not None:
            self.actor_set.push(i, float(self.states.yaw[i]), v)

    def _advance(self) -> int:
        """Ticks the world and returns its frame number; images of the last tick may no longer be read."""
        if self.pictures is not None:
            self.pictures.finish()
        self.server_frame = int(self.world.tick(self.options.timeout))
        return self.server_frame

    def _top_up(self, traffic: Traffic) -> None:
        """Spawns waiting vehicles and gives each that enters its grip and its size in the actor table."""
        for player in traffic.top_up(self.world, self.tick, self.states.pose(EGO)):
            self.actor_set.grip_on(player)
            i = self.actor_set.index[player.name]
            self.table.length[i], self.table.width[i], self.table.height[i] = player.size
            self.table.kind[i] = player.kind
            self.notices.append(f"{player.name} entered")

    def relocate(self, pose: Pose, v: float) -> None:
        """Puts the ego elsewhere, v in m/s along `pose`; it moves from there in the coming tick."""
        place = self.actor_set.relocate(pose, v)
        self.events.forget(self.tick)
        truth.move_row(self.states, EGO, place, v)

    # --- reading

    def _read(self) -> None:
        """Reads states, commands, friction, lights and events of this tick."""
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
        """Returns the ground truth of the present tick."""
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
        """Returns the frame of the ego's sensors at the present tick.

        Call it once per tick, as it draws noise.
        """
        seen, asked = self.reader.read(
            self.tick, self.messages, self.states, self.commands, self.light_states
        )
        gear = int(self.actor_set.ego.get_control().gear)
        return SensorFrame(
            tick=self.tick,
            ego=self.odometry.read(self.states, gear),
            images=seen.images,
            segments=seen.segments,
            radar=seen.radar,
            lights=MappingProxyType(self.light_states),
            contacts=self.contacts,
            invasions=self.invasions,
            extra=asked,
        )

    # --- end

    def close(self) -> None:
        """Leaves the server as it was found: without our actors, asynchronous."""
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


# --- a port for the wheel's Traffic Manager, which listens on one of its own


def free_port() -> int:
    """Returns a TCP port that no program listens on now."""
    with socket.socket() as probe:
        probe.bind(("", 0))
        return int(probe.getsockname()[1])


# Traffic lights by OpenDRIVE signal id: what they show, and our programme on them.


class TrafficLights:
    """Finds the lights once when cached, else at every reading."""

    def __init__(self, world: Any, cached: bool) -> None:
        self._world = world
        self._known = find_lights(world) if cached else None

    def read(self) -> dict[int, LightState]:
        """Returns states by signal id, from the client's newest snapshot."""
        known = find_lights(self._world) if self._known is None else self._known
        return {id: LightState(int(light.get_state())) for id, light in known}


def find_lights(world: Any) -> list[tuple[int, Any]]:
    """Returns lights with their OpenDRIVE signal ids, sorted by id; those without a number are left out."""
    found = []
    for light in world.get_actors().filter("traffic.traffic_light*"):
        text = light.get_opendrive_id()
        if text.lstrip("-").isdigit():  # a light that the map does not know cannot be named
            found.append((int(text), light))
    return sorted(found, key=lambda pair: pair[0])


class Programme:
    """The cycle of the embedded simulator, with the seed's phases (decision M-2), on the server.

    The server's own clocks stand still meanwhile.
    """

    def __init__(self, carla: Any, world: Any, map: RoadMap, seed: int, dt: float) -> None:
        self._carla = carla
        self._cycle, self._dt, self._tick = Lights.build_pretimed(map, seed, dt), dt, 0
        self._lights = find_lights(world)
        self._shown: dict[int, LightState] = {}
        world.freeze_all_traffic_lights(True)
        self.show(0)

    def hold(self, held: Iterable[tuple[int, LightState]]) -> None:
        """Holds lights in states that a client has set, by signal id, from the next `show` on."""
        self._cycle.hold(held)

    def show(self, tick: int) -> None:
        """Sets the lights as belongs to this tick; the server shows it in the coming one."""
        while self._tick < tick:
            self._cycle.advance(self._dt)
            self._tick += 1
        for id, light in self._lights:
            state = self._cycle.by_id.get(id)
            if state is not None and self._shown.get(id) is not state:
                light.set_state(self._carla.TrafficLightState.values[int(state)])
                self._shown[id] = state


# What the ego's localisation and its own sensors say of itself.


class Odometry:
    """Pose with noise; rims turn as the body moves (CARLA tells no wheel speeds)."""

    def __init__(self, seed: int, sigma: float, width: float) -> None:
        """sigma: m, noise of the position. width: m, of the ego."""
        self._rng = stream(seed, "ego", "localisation")
        self._sigma, self._half_track = sigma, TRACK * width / 2.0

    def read(self, s: ActorStates, gear: int) -> EgoEstimate:
        """Returns the estimate of this tick; call it once per tick, for the noise is drawn anew."""
        pose = s.pose(EGO)
        if self._sigma > 0.0:
            dx, dy = self._rng.normal(0.0, self._sigma, 2).tolist()
            pose = replace(pose, x=pose.x + dx, y=pose.y + dy)
        v, yaw_rate = truth.along(s, EGO), float(s.yaw_rate[EGO])
        left, right = v - yaw_rate * self._half_track, v + yaw_rate * self._half_track
        return EgoEstimate(
            pose=pose,
            speed=v,
            yaw_rate=yaw_rate,
            ax=float(s.ax[EGO]),
            ay=float(s.ay[EGO]),
            wheel_speeds=(left, right, left, right),
            gear=gear,
        )
