"""Background traffic through CARLA's Traffic Manager (A-202 to A-211)."""

from __future__ import annotations

from typing import Any

from skidpad.core.errors import ConfigError
from skidpad.core.geometry import Pose
from skidpad.core.maths.randomness import stream
from skidpad.core.setup import TrafficSetup
from skidpad.roads.queries import LanePoint, RoadMap
from skidpad.simulation.carla import blueprints
from skidpad.simulation.carla.actor_rows import ActorRow, make_row, make_row_in_waiting, try_spawn
from skidpad.simulation.carla.axes import from_transform
from skidpad.simulation.carla.connection import Connection
from skidpad.simulation.world.traffic.placement import fixed_spawns, random_factors

TOP_UP_EVERY = 20  # ticks between attempts to let missing vehicles in
NEAR, FAR = 25.0, 250.0  # m from the ego, where random vehicles begin; TM's own respawn bounds
MANAGER_SEEDS = 2**31 - 1


class Traffic:
    """The Traffic Manager of one run, and the vehicles that it drives."""

    def __init__(self, connection: Connection, port: int, dt: float, seed: int) -> None:
        self._carla, self._client, self.port = connection.carla, connection.client, port
        self.dt = dt
        self.manager = self._client.get_trafficmanager(port)
        self.manager.set_synchronous_mode(True)
        self.manager.set_random_device_seed(seed % MANAGER_SEEDS)
        self._waiting: list[ActorRow] = []
        self._seed = seed
        self.notices: list[str] = []

    def drive(self, player: ActorRow) -> None:
        """Hands a vehicle to the Traffic Manager, with its desired speed and lamps (A-207)."""
        player.actor.set_autopilot(True, self.port)
        percent = 100.0 * (1.0 - player.factor)  # positive is slower
        self.manager.vehicle_percentage_speed_difference(player.actor, percent)
        self.manager.update_vehicle_lights(player.actor, True)

    def release(self, player: ActorRow) -> None:
        """Takes a vehicle back from the Traffic Manager, for good."""
        if player.autopilot and player.actor is not None:
            player.actor.set_autopilot(False, self.port)
        player.autopilot = False

    def wait_for(self, players: list[ActorRow]) -> None:
        """Notes vehicles that enter when there is room; random drivers choose their ways (A-209)."""
        self._waiting = list(players)
        self.manager.set_respawn_dormant_vehicles(True)
        self.manager.set_boundaries_respawn_dormant_vehicles(NEAR, FAR)

    def top_up(self, world: Any, tick: int, ego: Pose) -> list[ActorRow]:
        """Spawns vehicles that wait, every TOP_UP_EVERY ticks, and returns those that entered now."""
        if not self._waiting or tick % TOP_UP_EVERY:
            return []
        points = places_around(world, ego, stream(self._seed, "traffic", "top up", tick))
        entered, still = [], []
        library = world.get_blueprint_library()
        for player in self._waiting:
            blueprint = blueprints.find(library, player.type)
            actor = _first_free(self._carla, world, blueprint, points)
            if actor is None:
                still.append(player)
                continue
            fresh = make_row(player.name, actor)
            player.actor, player.offset = fresh.actor, fresh.offset
            player.size, player.kind = fresh.size, fresh.kind
            player.autopilot = True
            self.drive(player)
            entered.append(player)
        self._waiting = still
        return entered

    def close(self) -> None:
        """Shuts the Traffic Manager and its thread down."""
        self.manager.set_synchronous_mode(False)
        self.manager.shut_down()


def spawn_fixed(
    carla: Any, world: Any, map: RoadMap, ego: LanePoint, setup: TrafficSetup, seed: int
) -> tuple[list[ActorRow], list[str]]:
    """Spawns vehicles at the published positions; returns them and what could not be placed, in words.

    ConfigError where one is refused and fewer are not allowed (A-202 to A-208).
    """
    kinds = blueprints.traffic_blueprints(world.get_blueprint_library())
    players, refused = [], []
    for i, spawn in enumerate(fixed_spawns(map, ego, setup, seed)):
        assert spawn.place is not None
        blueprint = kinds[i % len(kinds)]
        blueprints.paint(blueprint, i)
        actor = try_spawn(carla, world, blueprint, spawn.place.pose)
        if actor is None:
            refused.append(f"{blueprint.id} at ({spawn.place.x:.0f}, {spawn.place.y:.0f})")
            continue
        player = make_row(f"traffic_{i + 1:02d}", actor)
        player.factor, player.autopilot = spawn.factor, True
        players.append(player)
    if refused and not setup.allow_fewer:
        raise ConfigError(
            f"traffic: CARLA refused {len(refused)} of {setup.vehicles} vehicles "
            f"({', '.join(refused)}); choose fewer vehicles or allow fewer"
        )
    return players, [f"traffic: CARLA refused {text}" for text in refused]


def spawn_random(
    carla: Any, world: Any, ego: Pose, setup: TrafficSetup, seed: int
) -> list[ActorRow]:
    """Spawns vehicles on recommended points around the ego; returns rows for all, some still waiting."""
    kinds = blueprints.traffic_blueprints(world.get_blueprint_library())
    points = places_around(world, ego, stream(seed, "traffic", "places"))
    players = []
    for i, factor in enumerate(random_factors(setup.vehicles, seed)):
        blueprint = kinds[i % len(kinds)]
        blueprints.paint(blueprint, i)
        actor = _first_free(carla, world, blueprint, points)
        name = f"traffic_{i + 1:02d}"
        player = make_row_in_waiting(name, blueprint) if actor is None else make_row(name, actor)
        player.factor, player.autopilot = float(factor), actor is not None
        players.append(player)
    return players


def places_around(world: Any, ego: Pose, random: Any) -> list[Pose]:
    """Returns the recommended spawn points between NEAR and FAR m from the ego in a drawn order."""
    poses = [from_transform(t) for t in world.get_map().get_spawn_points()]
    near = [p for p in poses if NEAR < ((p.x - ego.x) ** 2 + (p.y - ego.y) ** 2) ** 0.5 < FAR]
    return [near[i] for i in random.permutation(len(near))]


def _first_free(carla: Any, world: Any, blueprint: Any, points: list[Pose]) -> Any:
    """Spawns at the first point that is free and returns the actor; None where none is.

    Points that were tried are removed from `points`, from its end.
    """
    while points:
        actor = try_spawn(carla, world, blueprint, points.pop())
        if actor is not None:
            return actor
    return None
