"""The words that appear in recordings. Decisions compare these, never text for people."""

from __future__ import annotations

from enum import Enum, IntEnum


class DetectionStatus(IntEnum):
    """Where the measured distance of a tick comes from (A-085)."""

    NO_TARGET = 0
    FUSION_DETECT = 1
    FUSION_PERSIST = 2
    RADAR_ACTIVE = 3
    SAFETY_PERSIST = 4  # compatibility profiles only


class Tier(IntEnum):
    """The mode of the tick: which rule of the seven-tier hierarchy acted (A-111, A-139)."""

    NONE = 0
    HARD_STOP = 1  # tier 1
    STOPPED_TOO_CLOSE = 2  # tier 2
    EMERGENCY = 3  # tier 3
    STOPPED_BEHIND_CAR = 4  # tier 4, holding at a red light
    APPROACH = 5  # tier 4, approaching a red light behind a lead
    ACC_HOLD = 6  # tier 5, zone A
    ACC_OPEN = 7  # tier 5, zone B
    ACC_CLOSE = 8  # tier 5, zone C
    LIGHT_STOP = 9  # tier 6, approaching
    HOLDING_AT_LINE = 10  # tier 6, standing
    COAST = 11  # tier 7
    CRUISE = 12  # tier 7
    BEND = 13  # slower than any tier asks for, as the road bends


class LightState(IntEnum):
    """State of a traffic light; numbers as in CARLA's protocol."""

    RED = 0
    YELLOW = 1
    GREEN = 2
    OFF = 3
    UNKNOWN = 4


class LightSource(IntEnum):
    """How the light assist found a light (A-161)."""

    NO_LIGHT = 0
    IMMEDIATE_TRIGGER = 1
    MAP_SCAN = 2
    NO_WAYPOINT = 3


class Supervision(IntEnum):
    """Phase of the recovery supervisor; it pre-empts the stack unless it is NONE (A-179, A-186)."""

    NONE = 0
    BRAKE = 1
    REVERSE = 2
    REALIGN = 3
    WARM_UP = 4


class TrafficStart(str, Enum):
    """Where background vehicles start, and whether they stay near."""

    FIXED = "fixed"
    RANDOM = "random"
    PACK = "pack"  # ours: around the ego, which mostly follows


class Stratum(str, Enum):
    """Which background drivers one meets."""

    NATURAL = "natural"  # nothing is staged: how often an alarm is right in this traffic
    RISKY = "risky"  # the tails of how they drive, oversampled: what is missed


class Headways(str, Enum):
    """How closely background drivers follow: `comfort` as when told to keep a comfortable distance, with
    the plain car-following model; `field` as measured on roads, which the model's gaps then are."""

    COMFORT = "comfort"
    FIELD = "field"


class Control(str, Enum):
    """What decides the motion of an actor."""

    AUTOPILOT = "autopilot"  # a driver of the background
    SCRIPTED = "scripted"  # commands from outside


class Clearance(str, Enum):
    """How a free place is searched for an ego that is put back (D-080)."""

    OTHERS = "others"  # the ego is no obstacle, and the last place is checked too
    NONE = "none"  # no search: the nearest place is taken, free or not (F-30)
    LISTING = "listing"  # as printed: the ego counts, and after four shifts the place is taken


class RelocationReason(IntEnum):
    """Why the supervisor put the ego somewhere else (A-194)."""

    COLLISION = 1
    WRONG_WAY = 2
    STUCK = 3
    OFF_ROAD = 4
    ROAD_END = 5  # the map ends there: no driver's fault
    ROLL_OVER = 6  # it lay on its side


class Scenery(str, Enum):
    """What is generated beside the roads of a map (decision T-14)."""

    NONE = "none"  # only what its file names
    FULL = "full"  # buildings, trees, lamps, hedges, kerbs, by the type of the road


class Bodywork(str, Enum):
    """What vehicles and people look like to cameras, lidars and radars that see surfaces."""

    PLAIN = "plain"  # one coarse body per kind, as in the published profiles
    SHAPED = "shaped"  # a body per type, with wheels that turn, lamps, mirrors and plates


class Quality(str, Enum):
    """How much of a picture's colours is drawn; size, depth, classes and instances are the same."""

    FULL = "full"
    DRAFT = (
        "draft"  # without grain and tracks of the ground, veils of the sky, and costly additions
    )


class Outcome(str, Enum):
    """How a run ended; the last three leave every denominator, counted (decision L-7)."""

    COMPLETED = "completed"
    COLLISION = "collision"
    ROLL_OVER = "roll_over"  # the ego of a scenario lay on its side
    NOT_TRIGGERED = "not_triggered"
    AGENT_ERROR = "agent_error"
    CRASHED = "crashed"
    TIMEOUT = "timeout"


ENDED = (Outcome.COLLISION, Outcome.ROLL_OVER)  # what ends a drive before its route does


class HazardType(str, Enum):
    """Hazards and candidate hazards of the channels monitor (C-120, C-127 to C-129)."""

    INCONSISTENT_LOCALISATION = "inconsistent_localisation"
    EGO_TAILGATING = "ego_tailgating"
    EGO_TAILGATED = "ego_tailgated"
    CROSSING_OBJECT = "crossing_object"
    CONFLICTING_PATHS = "conflicting_paths"
    STUCK_VEHICLE = "stuck_vehicle"
    UNSEEN_BY_A_CHANNEL = "unseen_by_a_channel"


class ActorKind(IntEnum):
    """What an actor is. Vehicles come first: `kind <= MOTORCYCLE`."""

    CAR = 0
    VAN = 1
    TRUCK = 2
    BUS = 3
    MOTORCYCLE = 4
    BICYCLE = 5
    PEDESTRIAN = 6
    PROP = 7


class SemanticClass(IntEnum):
    """CityScapes class ids as CARLA 0.9.15 numbers them."""

    NONE = 0
    ROAD = 1
    SIDEWALK = 2
    BUILDING = 3
    WALL = 4
    FENCE = 5
    POLE = 6
    TRAFFIC_LIGHT = 7
    TRAFFIC_SIGN = 8
    VEGETATION = 9
    TERRAIN = 10
    SKY = 11
    PEDESTRIAN = 12
    RIDER = 13
    CAR = 14
    TRUCK = 15
    BUS = 16
    TRAIN = 17
    MOTORCYCLE = 18
    BICYCLE = 19
    STATIC = 20
    DYNAMIC = 21
    OTHER = 22
    WATER = 23
    ROAD_LINE = 24
    GROUND = 25
    BRIDGE = 26
    RAIL_TRACK = 27
    GUARD_RAIL = 28


LABELS = frozenset(map(int, SemanticClass))


def class_of(label: int) -> SemanticClass:
    """Returns the class of what a channel saw; a car's for -1, unknown, and for numbers beyond CARLA's."""
    return SemanticClass(label) if label in LABELS else SemanticClass.CAR


class GripModel(str, Enum):
    """How weather acts on tyres."""

    NONE = "none"
    STATISTICAL = "statistical"
    PHYSICAL = "physical"


class RangeModel(str, Enum):
    """How weather acts on depth, labels and radar; `none` as in CARLA."""

    NONE = "none"
    PHYSICAL = "physical"


class LidarModel(str, Enum):
    """What a lidar's beam knows of the air: `exact` returns every surface, `physical` has a threshold."""

    EXACT = "exact"
    PHYSICAL = "physical"


class RadarModel(str, Enum):
    """What a radar returns: `geometric` what its rays meet, `physical` what stands out of its noise."""

    GEOMETRIC = "geometric"
    PHYSICAL = "physical"


class RadarOutput(str, Enum):
    """What a physical radar hands on: `points` of its cells, `detections` of objects, their `tracks`."""

    POINTS = "points"
    DETECTIONS = "detections"
    TRACKS = "tracks"


class AntiLock(str, Enum):
    """How anti-lock brakes work: `ideal` knows the grip, `wheel_speeds` cycles without knowing it."""

    IDEAL = "ideal"
    WHEEL_SPEEDS = "wheel_speeds"


class StabilityControl(str, Enum):
    """How stability and traction control work: `ideal` is told the grip, `wheel_speeds` measures motion."""

    IDEAL = "ideal"
    WHEEL_SPEEDS = "wheel_speeds"


class SensorLevel(str, Enum):
    """Real images and radar points, or geometric detection from boxes (decision M-3)."""

    PIXELS = "pixels"
    OBJECTS = "objects"


# Vans count as cars in semantic images, as the published stack looks for car, truck and bus.
LABEL_OF_KIND = {
    ActorKind.CAR: SemanticClass.CAR,
    ActorKind.VAN: SemanticClass.CAR,
    ActorKind.TRUCK: SemanticClass.TRUCK,
    ActorKind.BUS: SemanticClass.BUS,
    ActorKind.MOTORCYCLE: SemanticClass.MOTORCYCLE,
    ActorKind.BICYCLE: SemanticClass.BICYCLE,
    ActorKind.PEDESTRIAN: SemanticClass.PEDESTRIAN,
    ActorKind.PROP: SemanticClass.DYNAMIC,
}


class Govern(str, Enum):
    """What keeps the driver's speed inside its grip and sight (docs/envelope.md)."""

    NONE = "none"
    ENVELOPE = "envelope"  # grip and sight from own signals
    ORACLE = "oracle"  # the same with true grip, for studies
    ORACLE_SIGHT = "oracle-sight"  # the same with the true range of the radar, for studies
    WATCH = "watch"  # records what the envelope would allow, and lets the stack drive
    TABLE = "table"  # a rival: three speeds by wiper stage and temperature
    FIXED = "fixed"  # another one: 80 km/h always
    RSS = "rss"  # another one: RSS distances with constant grip
    PULSES = "pulses"  # the envelope, with brake pulses where nothing is known of the grip
    ONLY_SIGHT = "only-sight"  # one limit of the envelope alone
    ONLY_LEAD = "only-lead"
    ONLY_BEND = "only-bend"
    ONLY_WATER = "only-water"
    GRIP_LOW = "grip-low"  # an estimate of grip that is 30 % too low
    GRIP_HIGH = "grip-high"  # and 30 % too high
    FULL = "full"  # the envelope, also with lane boundaries, walkers and bridges of the map
