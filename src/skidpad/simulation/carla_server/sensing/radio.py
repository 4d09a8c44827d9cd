"""Radio between V2X sensors: the stations that send in a tick, and what power arrives.

Loss and fading are those of CARLA's V2X sensors (public source, PathLossModel), which name ETSI TR
103 257-1 and WINNER+ D5.3. Other than there, an obstacle's height counts above the line between the
antennas, and the ground is no obstacle.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from enum import Enum
from math import cos, hypot, log10, pi, sin, sqrt

import numpy as np
from numpy.typing import NDArray

from skidpad.simulation.carla_server.actors.boxes import Boxes
from skidpad.simulation.carla_server.actors.registry import Actor, Box
from skidpad.simulation.carla_server.protocol import wire
from skidpad.simulation.carla_server.protocol.wire import Vector

LIGHT = 299_792_458.0  # m/s
PERMITTIVITY = 1.02  # of the ground, relative; CARLA's
LOWEST = 0.1  # m over the ground, of an antenna (assumed)
NEAREST = 0.1  # m between antennas, below which loss no longer falls (assumed)


class Way(Enum):
    """What lies between two antennas."""

    CLEAR = "clear"
    VEHICLE = "vehicle"
    BUILDING = "building"


FADING = {  # dB, standard deviation by scenario; rural: the middle of the others
    Way.CLEAR: {"highway": 3.3, "rural": 4.25, "urban": 5.2},
    Way.VEHICLE: {"highway": 3.8, "rural": 4.55, "urban": 5.3},
    Way.BUILDING: {"highway": 6.8, "rural": 6.8, "urban": 6.8},
}


@dataclass(frozen=True, slots=True)
class Radio:
    """A sensor's attributes of the radio."""

    channel: str
    frequency_ghz: float
    power: float  # dBm, sent
    sensitivity: float  # dBm
    gain: float  # dB, of both antennas
    scenario: str
    exponent: float  # of the loss behind buildings
    d_ref: float  # m
    reach: float  # m
    fading: float | None  # dB; None: ETSI's
    geometric: bool  # two rays instead of WINNER

    @property
    def wavelength(self) -> float:
        """Returns the wavelength of the carrier in m."""
        return LIGHT / (self.frequency_ghz * 1e9)

    def deviation(self, way: Way) -> float:
        """Returns the standard deviation in dB of fading by shadows."""
        return FADING[way][self.scenario] if self.fading is None else self.fading


def make_radio(actor: Actor) -> Radio:
    """Returns a radio made from an actor's attributes; WireError when they cannot be used."""
    a = actor.attributes
    frequency, d_ref = float(a["frequency_ghz"]), float(a["d_ref"])
    for name, value in (("frequency_ghz", frequency), ("d_ref", d_ref)):
        if not 1e-3 <= value <= 1e3:
            raise wire.WireError(f"v2x {name} must be between 0.001 and 1000, got {value:g}")
    deviation = float(a["custom_fading_stddev"])
    if deviation < 0.0:
        raise wire.WireError(f"v2x custom_fading_stddev must not be negative, got {deviation:g}")
    return Radio(
        a["channel_id"],
        frequency,
        float(a["transmit_power"]),
        float(a["receiver_sensitivity"]),
        float(a["combined_antenna_gain"]),
        a["scenario"],
        float(a["path_loss_exponent"]),
        d_ref,
        float(a["filter_distance"]),
        None if a["use_etsi_fading"].lower() == "true" else deviation,
        a["path_loss_model"] == "geometric",
    )


@dataclass(frozen=True, slots=True)
class Call:
    """What one sensor sends in a tick."""

    sensor: int  # its actor
    kind: str  # blueprint; only equal ones hear each other
    channel: str
    power: float  # dBm
    place: Vector  # of the antenna
    ground: float  # m, height of what its carrier stands on
    carrier: int  # actor, 0: none
    messages: list[NDArray[np.void]]


@dataclass(slots=True)
class Air:
    """The calls of the newest tick."""

    frame: int = -1
    calls: list[Call] = field(default_factory=list)

    def send(self, frame: int, call: Call) -> None:
        """Adds a call that is heard in this frame only; those of other frames are dropped."""
        if frame != self.frame:
            self.frame, self.calls = frame, []
        self.calls.append(call)

    def receive_calls(self, frame: int, own: Call) -> list[Call]:
        """Returns what other stations of the same kind send on the same channel in this frame."""
        if frame != self.frame:
            return []
        same = (c for c in self.calls if c.kind == own.kind and c.channel == own.channel)
        return [c for c in same if c.sensor != own.sensor]


def find_crossed_boxes(
    among: Boxes, a: Vector, b: Vector, besides: tuple[int, ...] = ()
) -> list[Box]:
    """Returns the boxes that the line from a to b goes through, without those of `besides`."""
    near, far = among.spans(a, (b[0] - a[0], b[1] - a[1], b[2] - a[2]))
    hit = np.flatnonzero((near <= far) & (far >= 0.0) & (near <= 1.0)).tolist()
    return [among.boxes[i] for i in hit if among.owners[i] not in besides]


def knife_edge(box: Box, a: Vector, b: Vector, wavelength: float) -> float:
    """Returns the dB lost over the top of a vehicle between two antennas; 0 well below the line."""
    centre, half = box
    d1, d2 = hypot(centre.x - a[0], centre.y - a[1]), hypot(b[0] - centre.x, b[1] - centre.y)
    if not d1 or not d2:
        return 0.0
    line = a[2] + (b[2] - a[2]) * d1 / (d1 + d2)
    v = (centre.z + half[2] - line) * sqrt(2.0 * (d1 + d2) / (wavelength * d1 * d2))
    return 6.9 + 20.0 * log10(sqrt((v - 0.1) ** 2 + 1.0) + v - 0.1) if v >= -0.78 else 0.0


def free_space(radio: Radio, distance: float) -> float:
    """Returns the loss in dB over `distance` m in free space, without antenna gains (Friis)."""
    return 20.0 * log10(4.0 * pi * distance / radio.wavelength)


def two_rays(radio: Radio, distance: float, h_a: float, h_b: float) -> float:
    """Returns the dB lost by a direct ray and one off the ground; distance and heights over it in m."""
    reflected = sqrt(distance**2 + 4.0 * h_a * h_b)
    across = sqrt(max(distance**2 - (h_a - h_b) ** 2, NEAREST**2))
    sine, cosine = (h_a + h_b) / reflected, across / reflected
    root = sqrt(PERMITTIVITY - min(cosine, 1.0) ** 2)
    gamma = (sine - root) / (sine + root)
    phi = 2.0 * pi / radio.wavelength * (distance - reflected)
    sum_of_rays = sqrt((1.0 + gamma * cos(phi)) ** 2 + (gamma * sin(phi)) ** 2)
    return free_space(radio, across) - 20.0 * log10(max(sum_of_rays, 1e-6))


def winner(radio: Radio, way: Way, distance: float) -> float:
    """Returns the path loss in dB by WINNER+ over `distance` m."""
    d, f = log10(distance), log10(radio.frequency_ghz)
    if way is Way.BUILDING:
        return 36.85 + 30.0 * d + 18.9 * f
    if radio.scenario == "highway":
        return 32.4 + 20.0 * d + 20.0 * f
    return 38.77 + 16.7 * d + 18.2 * f


def loss(
    radio: Radio, way: Way, call: Call, place: Vector, ground: float, tops: Iterable[Box]
) -> float:
    """Returns the dB between a call's antenna and one at `place`, without fading.

    ground: m, height below that one; tops: vehicles between, which count for Way.VEHICLE only.
    """
    a = call.place
    distance = max(sqrt(sum((p - q) ** 2 for p, q in zip(a, place, strict=True))), NEAREST)
    edges = [knife_edge(box, a, place, radio.wavelength) for box in tops]
    edge = max(edges, default=0.0) if way is Way.VEHICLE else 0.0
    if not radio.geometric:
        return winner(radio, way, distance) + edge
    if way is Way.BUILDING:
        return free_space(radio, radio.d_ref) + 10.0 * radio.exponent * log10(
            distance / radio.d_ref
        )
    if way is Way.VEHICLE:
        return free_space(radio, distance) + edge
    level = min(ground, call.ground)
    return two_rays(radio, distance, max(a[2] - level, LOWEST), max(place[2] - level, LOWEST))
