"""The stack that drives a run: its class and settings, built, and the sensors that it asks for."""

from __future__ import annotations

from collections.abc import Mapping
from copy import deepcopy
from dataclasses import asdict, replace

from skidpad.campaign.driving.governing import apply_envelope
from skidpad.campaign.driving.run_setup import Stage
from skidpad.core.errors import ConfigError, StackError
from skidpad.core.frames import SensorFrame
from skidpad.core.run import (
    AdasDriver,
    AgentDriver,
    CameraDriver,
    Passenger,
    ReferenceDriver,
    RunSpec,
    StackDriver,
)
from skidpad.core.setup import Setup
from skidpad.core.states import ActorTable, StackReport, VehicleCommand
from skidpad.physics.types import EGO_TYPE, vehicle_type
from skidpad.sensors.pictures.overlay import Lens
from skidpad.stack.adas import AdasStack
from skidpad.stack.agents import load_agent
from skidpad.stack.channels.settings import CarModel
from skidpad.stack.interface import Stack
from skidpad.stack.loading import GuardedStack, load_stack


class StackAtWheel:
    """A stack that drives: it is given frames, and never the truth."""

    def __init__(self, stack: GuardedStack, lens: Lens | None = None) -> None:
        """lens: with rain drops on it, before all cameras (B-160)."""
        self.stack, self.lens = stack, lens

    @property
    def report(self) -> StackReport:
        """Returns what the stack reports of its last tick."""
        return self.stack.report

    @property
    def mode(self) -> str:
        """Returns the stack's mode in its own words."""
        return self.stack.mode

    def begin(self, table: ActorTable) -> None:
        """Does nothing: a stack does not know the other actors."""

    def act(self, frame: SensorFrame) -> VehicleCommand:
        """Returns the stack's answer to the frame."""
        if self.lens is not None:
            images, extra = self.lens.add_drops(frame.images), self.lens.add_drops(frame.extra)
            frame = replace(frame, images=images, extra=extra)
        return self.stack.tick(frame)


class Seated:
    """Drives nothing: the scenario moves the ego."""

    def __init__(self, specs: object, map: object, settings: object) -> None:
        del specs, map, settings

    def tick(self, frame: SensorFrame) -> VehicleCommand:
        """Returns a command with no pedal pressed."""
        del frame
        return VehicleCommand()


def driver_of(spec: RunSpec, stage: Stage, kind: type[Stack] | None = None) -> StackAtWheel:
    """Returns the driver of a run, built; StackError when it cannot be. kind: its class, if loaded."""
    found, settings = _class_of(spec, stage, kind)
    # our own stack gives the map's arrays to kernels, which know one type of array
    chosen = kind or found
    map = stage.map if chosen is AdasStack else stage.map.read_only()
    chosen = apply_envelope(chosen, spec, stage.setup)
    common = tuple(spec for spec in stage.setup.specs if spec.id not in stage.setup.asked)
    stack = GuardedStack(chosen, common, map, settings)
    return StackAtWheel(stack, Lens(spec.weather, spec.seed) if spec.overlay else None)


def _class_of(
    spec: RunSpec, stage: Stage, kind: type[Stack] | None
) -> tuple[type[Stack], Mapping[str, object]]:
    """Returns the driver's class and its settings; ConfigError for channels, which need a route.

    kind: the class, if loaded, as a user's file runs once.
    """
    driver = spec.driver
    cruise = {} if stage.cruise_kmh is None else {"cruise_kmh": stage.cruise_kmh}
    match driver:
        case StackDriver():
            # a copy: whatever it does to them
            return kind or load_stack(driver.where), {**cruise, **deepcopy(driver.options)}
        case AgentDriver():
            return load_agent(driver.where), {}
        case Passenger():
            return Seated, {}
        case CameraDriver():
            from skidpad.stack.camera import driver as camera  # its network is read with it

            return camera.CameraDriver, cruise
        case ReferenceDriver():
            from skidpad.stack.reference.driver import ReferenceStack

            return ReferenceStack, {"seed": spec.seed, "car": asdict(ego_model()), **cruise}
        case AdasDriver():
            if driver.cruise_kmh is not None:
                cruise = {"cruise_kmh": driver.cruise_kmh}
            return AdasStack, {
                "functions": [*sorted(f.value for f in driver.functions), *driver.added],
                "profile": spec.settings.profile,
                "set": spec.settings.stack.to_plain(),
                **cruise,
            }
    raise ConfigError(f"{driver.label} needs a route to drive")


def ego_model() -> CarModel:
    """Returns what a driver knows of the ego's car."""
    t = vehicle_type(EGO_TYPE)
    return CarModel(
        length=t.length,
        width=t.width,
        wheelbase=t.wheelbase,
        steer_max=t.steer_max,
        a_drive=t.a_drive,
        a_brake=t.a_brake,
    )


def with_sensors(setup: Setup, stack: GuardedStack) -> Setup:
    """Returns the set-up with the further sensors that the stack asks for (L-3).

    A sensor that is there already as another stack asked for it is shared; StackError for a name
    that stands for another one.
    """
    there = {spec.id: spec for spec in setup.specs}
    wanted = stack.sensors()
    for spec in wanted:
        if there.get(spec.id, spec) != spec:
            raise StackError(f"{stack.name}.sensors(): {spec.id!r} is another sensor already")
    more = tuple(spec for spec in wanted if spec.id not in there)
    asked = setup.asked | {spec.id for spec in wanted}
    return replace(setup, specs=(*setup.specs, *more), asked=asked)
