"""Dynamic vision: an event for each step of brightness at a pixel, between two readings.

The event model of CARLA's DVS camera (its documentation, "DVS camera"; Gehrig et al. 2018, ESIM):
brightness changes linearly between two pictures, and each crossing of a threshold is an event.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats
from skidpad.simulation.carla_server.actors.registry import Actor
from skidpad.simulation.carla_server.clock import Clock
from skidpad.simulation.carla_server.sensing.images import Camera, make_camera
from skidpad.simulation.carla_server.sensing.sensor import Message, Sensor
from skidpad.simulation.carla_server.sensing.surroundings import Surroundings

EVENT = np.dtype([("x", "<u2"), ("y", "<u2"), ("t", "<i8"), ("polarity", "?")])  # 13 bytes, packed
GREY = np.array([0.2989, 0.587, 0.114])  # of red, green, blue: ITU-R BT.601
LEAST_CONTRAST = 0.01  # below which noise brings no threshold
CHANGE = 1e-6  # smaller changes are none
NS = 1e9  # per s


@dataclass(slots=True, eq=False)
class Retina:
    """A camera and the state of its pixels."""

    camera: Camera
    positive: float  # thresholds
    negative: float
    sigma_positive: float
    sigma_negative: float
    refractory_ns: int
    logarithmic: bool
    log_eps: float
    light: Floats | None = None  # at the last reading
    level: Floats | None = None  # at which the last event was
    last_ns: NDArray[np.int64] | None = None  # of the last event; 0: none
    time_ns: int = 0

    def threshold(self, rising: bool, rng: np.random.Generator, n: int) -> Floats:
        """Returns (n,) thresholds of pixels that become brighter or darker, LEAST_CONTRAST at least."""
        mean = self.positive if rising else self.negative
        sigma = self.sigma_positive if rising else self.sigma_negative
        drawn = mean + sigma * rng.standard_normal(n) if sigma > 0.0 else np.full(n, mean)
        found: Floats = np.maximum(drawn, LEAST_CONTRAST)
        return found


def make_retina(actor: Actor, seed: int) -> Retina:
    """Returns an event camera made from an actor's attributes; errors as of `make_camera`."""
    a = actor.attributes
    return Retina(
        make_camera(actor, seed),
        float(a["positive_threshold"]),
        float(a["negative_threshold"]),
        float(a["sigma_positive_threshold"]),
        float(a["sigma_negative_threshold"]),
        int(a["refractory_period_ns"]),
        a["use_log"].lower() == "true",
        float(a["log_eps"]),
    )


def dynamic_vision(around: Surroundings, clock: Clock, sensor: Sensor) -> list[Message]:
    """Returns one message with all events since the last reading, or none."""
    retina: Retina = sensor.equipment
    camera = retina.camera
    scene, view = camera.look(around, clock, sensor)
    camera.paint(around, sensor.actor, scene, view)
    shown = camera.finish(scene, view, sensor.share(clock))
    rgb = shown.view(np.uint8).reshape(*shown.shape, 4)[..., :3]
    grey: Floats = rgb @ GREY
    light = np.log(retina.log_eps + grey / 255.0) if retina.logarithmic else grey
    events = crossings(retina, light, round(clock.elapsed * NS), sensor.rng)
    return [(camera.head, events.tobytes())] if len(events) else []


def crossings(
    retina: Retina, light: Floats, time_ns: int, rng: np.random.Generator
) -> NDArray[np.void]:
    """Returns the events (EVENT) at all pixels until `time_ns`, when they see `light`, ordered by time.

    None at the first call. Moves the retina's state on.
    """
    before, since = retina.light, retina.time_ns
    retina.light, retina.time_ns = light, time_ns
    if before is None or retina.level is None or retina.last_ns is None:
        retina.level = light.copy()
        retina.last_ns = np.zeros(light.shape, dtype=np.int64)
        return np.zeros(0, dtype=EVENT)
    found = [np.zeros(0, dtype=EVENT)]
    for rising in (True, False):
        change = light - before if rising else before - light
        rows, columns = np.nonzero(change > CHANGE)
        sign = 1.0 if rising else -1.0
        step = sign * retina.threshold(rising, rng, len(rows))
        start, end = before[rows, columns], light[rows, columns]
        while len(rows):
            at = retina.level[rows, columns] + step
            met = (sign * at > sign * start) & (sign * at <= sign * end)
            rows, columns = rows[met], columns[met]
            step, start, end, at = step[met], start[met], end[met], at[met]
            retina.level[rows, columns] = at
            t = since + ((at - start) / (end - start) * (time_ns - since)).astype(np.int64)
            last = retina.last_ns[rows, columns]
            told = (last == 0) | (t - last >= retina.refractory_ns)
            retina.last_ns[rows[told], columns[told]] = t[told]
            events = np.zeros(int(told.sum()), dtype=EVENT)
            events["x"], events["y"], events["t"] = columns[told], rows[told], t[told]
            events["polarity"] = rising
            found.append(events)
    events = np.concatenate(found)
    return events[np.argsort(events["t"], kind="stable")]
