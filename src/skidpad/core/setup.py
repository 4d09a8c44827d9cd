"""What a backend is told at reset, and what a scenario player tells actors while driving."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from skidpad.core.environment.lidar_effects import LidarEffects
from skidpad.core.environment.surface import SurfacePatch
from skidpad.core.environment.tyres import REFERENCE
from skidpad.core.geometry import Pose
from skidpad.core.objects.slots import fill_slots
from skidpad.core.specs import SensorSpec
from skidpad.core.states import VehicleCommand
from skidpad.core.vocabulary import (
    AntiLock,
    Bodywork,
    Control,
    GripModel,
    Headways,
    LidarModel,
    Quality,
    RadarModel,
    RadarOutput,
    RangeModel,
    Scenery,
    SensorLevel,
    StabilityControl,
    Stratum,
    TrafficStart,
)
from skidpad.core.weather import Weather

DT = 0.05  # s, the fixed step of the published runs; time is a count of these


@dataclass(frozen=True, slots=True)
class LanePosition:
    """A place on a lane in OpenDRIVE terms, `s` along the road reference line in m."""

    road: int
    lane: int
    s: float
    offset: float = 0.0  # m, left of the lane centre seen in driving direction


@dataclass(frozen=True, slots=True, kw_only=True)
class ActorSetup:
    """One actor at the start."""

    name: str
    type: str  # vehicle type id, "pedestrian", "bicycle" or a prop id
    place: Pose | LanePosition
    speed: float = 0.0  # m/s
    driver: Control = Control.AUTOPILOT
    tyres: str = ""  # by name, `core.tyres`; empty: those of the run (embedded backend)
    rgb: tuple[int, int, int] | None = None  # None: by index from the type's palette
    collides: bool = True  # False: it is seen and touches nothing (embedded backend)
    present: bool = True  # False: it is not there until it is told to appear (embedded backend)


VEHICLES_MAX = 80  # of the background
RESERVE_NAME = "reserve_"  # names of vehicles that wait to be called begin with this


@dataclass(frozen=True, slots=True, kw_only=True)
class TrafficSetup:
    """Background traffic placed by the backend."""

    mode: TrafficStart = TrafficStart.FIXED
    vehicles: int = 20
    allow_fewer: bool = False
    reserve: int = 0  # further vehicles, which enter when a command lets them appear
    variant: str = "listing"  # or "table": which published positions (D-085, D-086)
    initial_limit_kmh: float | None = None  # None: the map's limit at the place (decision M-6)
    slow_in_weather: bool = False  # the switch `drivers` (decisions M-1, R-5)
    sees_patches: bool = False  # with slow_in_weather: drivers slow for what lies on the road
    put_wrecks_back: bool = True  # decision M-7
    variety: bool = False  # drivers differ in speed, headway and acceleration (decision C-11)
    headways: Headways = Headways.COMFORT  # with variety
    stratum: Stratum = Stratum.NATURAL  # risky: with variety, tails are oversampled


@dataclass(frozen=True, slots=True)
class Wind:
    """What the air of a run does."""

    speed: float = 0.0  # m/s
    towards: float = 0.0  # rad counter-clockwise from the map's x axis, as OpenSCENARIO has it
    gusts: float = 0.0  # standard deviation over the speed


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraOptics:
    """What colour pictures show of the quantities of `physics.camera`; all off: the published pictures."""

    haze: bool = False  # contrast by visibility
    drops: bool = False  # of rain on the glass
    spray: bool = False  # behind vehicles on wet road
    exposure: bool = False  # by daylight, within a camera's limits


@dataclass(frozen=True, slots=True, kw_only=True)
class Setup:
    """Everything that a backend needs to begin a run.

    Attributes:
        map: Name of a bundled map, or a file.
        weather: Of the whole run, unless a file or a person changes it.
        specs: The sensors of the ego: the common ones and those that the stack asked for.
        ego: Vehicle and start of the ego.
        actors: Those who are there from the start, besides the ego and traffic.
        traffic: Background traffic; None: there is none.
        grip: How weather acts on tyres.
        range_model: How weather acts on what sensors see.
        camera_effect: Weather acts on RGB images.
        camera_optics: Of RGB images (embedded backend).
        rain_hides_night: In rain the camera effect of the night is left out (D-094).
        mu_ref: Friction at CARLA's tire_friction 3.5 on a dry road.
        tyres: Of vehicles that have none of their own (embedded backend).
        tyre_stiffness: Slip stiffness falls on water, snow and ice (embedded backend).
        water_drag: Wheels push water aside (embedded backend).
        sheet_flow: Rain is deeper where superelevation is low (embedded backend).
        material_base: mu_ref that <material friction> of the map replaces; None: it is not
            read (embedded backend).
        lidar: Of the lidars that a stack asks for (embedded backend).
        lidar_effects: On such lidars (embedded backend).
        spray: Behind vehicles, for such lidars (embedded backend).
        radar_model: Of the common radar (embedded backend).
        radar_multipath: Of such a radar.
        radar_interference: Share of vehicles whose radar disturbs such a radar.
        radar_output: Of such a radar.
        stability: All vehicles have stability and traction control (embedded backend).
        anti_lock: Of vehicles that have them (embedded backend).
        stability_control: Where there is one.
        roll_over: Vehicles can tip over their outer wheels (embedded backend).
        wind: That pushes vehicles; None: no air moves (embedded backend).
        wakes: Lorries, buses and vans push air aside (embedded backend).
        level: Whether cameras give images or boxes of objects.
        asked: Ids among specs whose readings go to `frame.extra` (L-3).
        render_all: Every image every tick, read or not.
        patches: Parts of the road with a surface of their own.
        scenery: Beside the roads (embedded backend).
        bodywork: Of all actors (embedded backend).
        quality: Of colour pictures (embedded backend).
        localisation_noise: m, standard deviation of the ego's x and y; 0: exact (L-3).
        dt: s, the length of a tick.
    """

    map: str | Path
    weather: Weather
    specs: tuple[SensorSpec, ...]
    ego: ActorSetup
    actors: tuple[ActorSetup, ...] = ()
    traffic: TrafficSetup | None = None
    grip: GripModel = GripModel.PHYSICAL
    range_model: RangeModel = RangeModel.PHYSICAL
    camera_effect: bool = True
    camera_optics: CameraOptics = CameraOptics()
    rain_hides_night: bool = False
    mu_ref: float = 0.9
    tyres: str = REFERENCE
    tyre_stiffness: bool = False
    water_drag: bool = False
    sheet_flow: bool = False
    material_base: float | None = None
    lidar: LidarModel = LidarModel.EXACT
    lidar_effects: LidarEffects = LidarEffects()
    spray: bool = False
    radar_model: RadarModel = RadarModel.GEOMETRIC
    radar_multipath: bool = False
    radar_interference: float = 0.0
    radar_output: RadarOutput = RadarOutput.POINTS
    stability: bool = False
    anti_lock: AntiLock = AntiLock.IDEAL
    stability_control: StabilityControl = StabilityControl.IDEAL
    roll_over: bool = False
    wind: Wind | None = None
    wakes: bool = False
    level: SensorLevel = SensorLevel.PIXELS
    asked: frozenset[str] = frozenset()
    render_all: bool = False
    patches: tuple[SurfacePatch, ...] = ()
    scenery: Scenery = Scenery.NONE
    bodywork: Bodywork = Bodywork.PLAIN
    quality: Quality = Quality.FULL
    localisation_noise: float = 0.0
    dt: float = DT


@fill_slots
@dataclass(frozen=True, slots=True)
class ActorCommand:
    """A scenario player's word to one actor for the coming step; one of the three forms.

    `place` moves it there with `speed` (ideal actors); `command` drives it through the physics;
    `present` lets it appear or vanish.
    """

    actor: str
    place: Pose | None = None
    speed: float | None = None
    command: VehicleCommand | None = None
    present: bool | None = None
