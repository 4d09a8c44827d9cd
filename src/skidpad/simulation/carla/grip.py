"""Weather on tyres, once: by the server itself, or by scaling every wheel (K-2, B-060 to B-068)."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from skidpad.core.geometry import mps_from_kmh
from skidpad.core.setup import Setup
from skidpad.core.vocabulary import GripModel
from skidpad.physics.grip import GripParams, grip_params, mu_at, ratio_at
from skidpad.physics.types import TIRE_FRICTION_REFERENCE

BLUEPRINTS = ("skidpad.weather.grip", "skidpad.weather")  # of our servers now and before
V_RATIO = mps_from_kmh(
    80.0
)  # tire_friction knows no speed: the ratio at the published cruise speed


@dataclass(slots=True)
class Grip:
    """How weather reaches the tyres in one run, and what every vehicle had before it (B-067)."""

    setup: Setup
    served: bool  # the server does it
    ratio: float  # by which we scale; 1 where the server does it
    params: GripParams
    original: dict[int, tuple[float, ...]] = field(default_factory=dict)  # f0 by actor id
    emitter: Any = None  # the actor of the blueprint
    notices: list[str] = field(default_factory=list)

    def apply(self, vehicle: Any) -> None:
        """Scales the wheels of a vehicle by the ratio, and adds a notice; a second call finds f0 kept.

        Does nothing where the server lets weather act, or grip is off.
        Every other property of every wheel is copied from the spawned vehicle (B-063, B-064).
        """
        if self.served or self.setup.grip is GripModel.NONE:
            return
        control = vehicle.get_physics_control()
        wheels = list(control.wheels)
        before = self.original.setdefault(vehicle.id, tuple(float(w.tire_friction) for w in wheels))
        for wheel, f0 in zip(wheels, before, strict=True):
            wheel.tire_friction = f0 * self.ratio
        control.wheels = wheels
        vehicle.apply_physics_control(control)
        self.notices.append(
            f"grip: {vehicle.type_id} ({vehicle.id}), weather {self.setup.weather.name or 'given'}: "
            f"tire_friction {', '.join(f'{f:g}' for f in before)} x {self.ratio:.4f} = "
            f"{', '.join(f'{f * self.ratio:.4g}' for f in before)}"
        )

    def mu(self, speed: float) -> float:
        """Returns the nominal friction at a tyre of tire_friction 3.5, at a speed in m/s.

        It is what our model says, not a measurement.
        """
        if self.served or self.setup.grip is GripModel.NONE:
            return mu_at(self.params, speed)
        return self.setup.mu_ref * self.ratio

    def scale(self, actor: int) -> float:
        """Returns a vehicle's tyres over the reference; 1 where its wheels were never read."""
        wheels = self.original.get(actor)
        return sum(wheels) / len(wheels) / TIRE_FRICTION_REFERENCE if wheels else 1.0


def in_force(blueprint: Any, setup: Setup) -> tuple[GripModel, float]:
    """Returns the model and mu_ref that the server says it uses; ours where it does not say."""
    if not (blueprint.has_attribute("weather_grip") and blueprint.has_attribute("mu_ref")):
        return setup.grip, setup.mu_ref
    model = GripModel(blueprint.get_attribute("weather_grip").as_str())
    return model, float(blueprint.get_attribute("mu_ref").as_float())


def prepare_grip(carla: Any, world: Any, setup: Setup) -> Grip:
    """Returns how weather reaches the tyres: by the server's own model, or by a ratio that we set.

    The server's model is told the ice, by an actor that stays in its world; notices say which holds.
    """
    params = grip_params(setup.weather, setup.grip, setup.mu_ref)
    library = world.get_blueprint_library()
    emitter = next((b for name in BLUEPRINTS for b in library if b.id == name), None)
    if emitter is None:
        ratio = float(ratio_at(params, V_RATIO))
        return Grip(setup, False, ratio, params)
    model, mu_ref = in_force(emitter, setup)
    emitter.set_attribute("ice_thickness", f"{setup.weather.ice_thickness:g}")
    actor = world.spawn_actor(emitter, carla.Transform())
    params = grip_params(setup.weather, model, mu_ref)
    grip = Grip(setup, True, 1.0, params, emitter=actor)
    grip.notices.append(
        f"grip: the server lets weather act on tyres ({emitter.id}): {model.value}, mu_ref {mu_ref:g}"
    )
    if setup.grip is not GripModel.NONE and (model, mu_ref) != (setup.grip, setup.mu_ref):
        grip.notices.append(
            f"grip: {setup.grip.value} with mu_ref {setup.mu_ref:g} was asked for, "
            "but the server's holds"
        )
    if setup.grip is GripModel.NONE:
        grip.notices.append("grip: none was asked for, but the server was started with one")
    return grip
