"""What a run asks of its actors on the server: commands, places, coming and going."""

from __future__ import annotations

from dataclasses import replace
from math import cos, sin
from typing import Any

from skidpad.core.errors import ConfigError
from skidpad.core.geometry import Pose
from skidpad.core.maths.lefthanded import mirror_value
from skidpad.core.setup import ActorCommand
from skidpad.core.states import ActorStates, VehicleCommand
from skidpad.roads.queries import RoadMap
from skidpad.simulation.carla.actor_rows import ActorRow
from skidpad.simulation.carla.axes import to_transform, to_vector
from skidpad.simulation.carla.grip import Grip
from skidpad.simulation.carla.traffic import Traffic

EGO = 0
GROUND_GAP = 0.1  # m above our map's road at which relocated vehicles are put


class ActorSet:
    """The actors of one run in the order of their rows."""

    def __init__(
        self, carla: Any, world: Any, map: RoadMap, players: list[ActorRow], grip: Grip, dt: float
    ) -> None:
        self.players = players
        self.index = {p.name: i for i, p in enumerate(players)}
        self.traffic: Traffic | None = None  # of those on autopilot
        self._carla, self._world, self._map, self._grip, self._dt = carla, world, map, grip, dt
        for player in players:
            self.grip_on(player)

    @property
    def ego(self) -> Any:
        """Returns the carla.Vehicle of the ego."""
        return self.players[EGO].actor

    def grip_on(self, player: ActorRow) -> None:
        """Applies the grip to the actor where it is a vehicle: only vehicles have tyres (B-065)."""
        if player.actor is not None and player.is_vehicle:
            self._grip.apply(player.actor)

    def command(self, player: ActorRow, c: VehicleCommand) -> None:
        """Applies pedals and steer to a vehicle, steer mirrored into CARLA's axes."""
        control = self._carla.VehicleControl(
            throttle=c.throttle,
            steer=mirror_value(c.steer),
            brake=c.brake,
            hand_brake=c.handbrake,
            reverse=c.reverse,
        )
        player.actor.apply_control(control)

    def command_all(self, c: VehicleCommand) -> None:
        """Applies pedals and steer to every vehicle that is there."""
        for player in self.players:
            if player.actor is not None and player.is_vehicle:
                self.command(player, c)

    def push(self, i: int, yaw: float, v: float) -> None:
        """Sets a speed in m/s along a heading in rad on the actor of row i; it acts in the coming tick.

        Does nothing for one that is not there.
        """
        actor = self.players[i].actor
        if actor is not None:
            actor.set_target_velocity(to_vector(self._carla, v * cos(yaw), v * sin(yaw)))

    def obey(self, word: ActorCommand, states: ActorStates) -> None:
        """Applies a command of the scenario to its actor: presence first, then pedals, then place.

        ConfigError for an unknown name. Pedals or a place take it out of the Traffic Manager's hands. states:
        where all actors are now.
        """
        i = self.index.get(word.actor)
        if i is None:
            raise ConfigError(f"there is no actor {word.actor!r} in this run")
        player = self.players[i]
        if word.present is not None:
            self._appear(player, word.present, states.pose(i))
        if player.actor is None:
            return
        if word.command is not None or word.place is not None:
            self._release(player)
        if word.command is not None:
            self.command(player, word.command)
        if word.place is not None:
            self._place(i, word.place, word.speed or 0.0)

    def relocate(self, pose: Pose, v: float) -> Pose:
        """Puts the ego elsewhere, from where it moves in the coming tick; returns where it then stands.

        v: m/s along `pose`; the height is that of the map's road.
        """
        place = self._on_road(pose)
        self.ego.set_transform(to_transform(self._carla, self.players[EGO].origin(place)))
        self.push(EGO, pose.yaw, v)
        self.ego.set_target_angular_velocity(self._carla.Vector3D())
        return replace(place, z=place.z - GROUND_GAP)

    def _release(self, player: ActorRow) -> None:
        """Takes an actor out of the Traffic Manager's hands, where there is traffic."""
        if self.traffic is not None:
            self.traffic.release(player)

    def _place(self, i: int, pose: Pose, v: float) -> None:
        """Puts row i so far back that it is at `pose` with speed v when the coming tick ends."""
        player = self.players[i]
        start = self._on_road(pose).moved(forward=-v * self._dt)
        player.actor.set_transform(to_transform(self._carla, player.origin(start)))
        self.push(i, pose.yaw, v)
        if player.type.startswith("walker."):
            direction = to_vector(self._carla, cos(pose.yaw), sin(pose.yaw))
            player.actor.apply_control(self._carla.WalkerControl(direction, v, False))

    def _on_road(self, pose: Pose) -> Pose:
        """Returns the pose GROUND_GAP above our map's road; unchanged off every lane."""
        point = self._map.project(pose.x, pose.y, pose.z, driving=False)
        return pose if point is None else replace(pose, z=point.z + GROUND_GAP)

    def _appear(self, player: ActorRow, present: bool, now: Pose) -> None:
        """Lets an actor enter the world where it left it, or destroys it and notes its place.

        One that has never left does not enter.
        """
        if present and player.actor is None and player.rested is not None:
            blueprint = self._world.get_blueprint_library().find(player.type)
            pose = player.origin(player.rested).moved(up=GROUND_GAP)
            player.actor = self._world.spawn_actor(blueprint, to_transform(self._carla, pose))
            self.grip_on(player)
        elif not present and player.actor is not None:
            player.rested = now
            self._release(player)
            player.actor.destroy()
            player.actor = None
