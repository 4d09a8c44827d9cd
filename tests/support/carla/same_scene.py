"""One scene on both backends: labels, depth, radar (decision K-6 b); printed as JSON."""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from math import tan
from typing import Any

import numpy as np

from skidpad.core.frames import RadarPoints
from skidpad.core.geometry import Pose
from skidpad.core.maths.lefthanded import pose_from_carla, pose_to_carla
from skidpad.core.setup import ActorSetup, Setup
from skidpad.core.states import VehicleCommand
from skidpad.core.vocabulary import Control, SensorLevel
from skidpad.sensors.raster.rays import make_hits, make_rays
from skidpad.simulation.carla.backend import CarlaBackend
from skidpad.simulation.carla.options import CarlaOptions
from skidpad.simulation.embedded.engine import EmbeddedBackend
from support.backend_contract import ALONE, MAP, START
from support.carla.replay import same_model, without_road_noise

EGO, LEAD, VAN = "vehicle.mini.cooper_s", "vehicle.tesla.model3", "vehicle.mercedes.sprinter"
RANGE_ERROR = 0.01  # m; directions travel in single precision and graze the road
CODED = 999.9  # m, beyond which the depth code says nothing
STEP = 1000.0 / (256.0**3 - 1.0)  # m, the 24-bit code


def scene(ego_speed: float, lead_speed: float) -> Setup:
    ahead, aside = MAP.ahead(START, 30.0), MAP.ahead(START, 45.0)
    assert ahead is not None
    assert aside is not None
    actors = (
        ActorSetup(
            name="lead", type=LEAD, place=ahead.pose, speed=lead_speed, driver=Control.SCRIPTED
        ),
        ActorSetup(name="van", type=VAN, place=aside.pose.moved(left=3.5), driver=Control.SCRIPTED),
    )
    ego = replace(ALONE.ego, type=EGO, speed=ego_speed)
    specs = tuple(replace(s, mount=as_sent(s.mount)) for s in ALONE.specs)
    return replace(ALONE, ego=ego, actors=actors, level=SensorLevel.PIXELS, specs=specs)


def as_sent(pose: Pose) -> Pose:
    """What is left of a mounting after the network, which carries single precision."""
    return pose_from_carla(*(float(np.float32(v)) for v in pose_to_carla(pose)))


def images(ours: EmbeddedBackend, theirs: CarlaBackend) -> dict[str, float]:
    """Differing labels, and the largest difference of depth in steps of the code."""
    setup = scene(0.0, 0.0)
    a, b = ours.reset(setup, 1), theirs.reset(setup, 1)
    out = {}
    for id in ("semantic_roof", "semantic_bumper"):
        one, two = a.images[id].labels, b.images[id].labels
        differ = one != two
        out[id] = int(differ.sum())
        near = a.images[id.replace("semantic", "depth")].depth() < CODED
        out[f"{id} near"] = int((differ & near).sum())
        out[f"{id} classes"] = len(np.unique(two))
    for id in ("depth_roof", "depth_bumper"):
        one, two = a.images[id].depth(), b.images[id].depth()
        there = np.isfinite(one) & (one < CODED)
        out[f"{id} missing"] = int((there != np.isfinite(two)).sum())
        both = there & np.isfinite(two)
        apart = np.abs(one[both].astype(np.float64) - two[both])
        allowed = STEP + 4e-7 * one[both]  # half a step of rounding, and float32 on both sides
        out[id] = float((apart / allowed).max())
    return out


def radar(ours: EmbeddedBackend, theirs: CarlaBackend) -> dict[str, float]:
    """Their rays, cast again through our scene."""
    setup = scene(20.0, 8.0)
    ours.reset(setup, 1)
    theirs.reset(setup, 1)
    off, speeds, count, velocities = 0, 0.0, 0, []
    for _ in range(10):
        without_road_noise(ours)
        ours.step(VehicleCommand())
        points = theirs.step(VehicleCommand()).radar
        again, velocity = recast(ours, points)
        near = np.abs(again - points.range) < RANGE_ERROR
        off += int((~near).sum())
        speeds = max(speeds, float(np.abs(velocity - points.velocity)[near].max()))
        count += len(near)
        velocities += points.velocity.tolist()
    return {
        "off": off,
        "velocity": speeds,
        "points": count,
        "fastest": float(np.min(velocities)),
        "lead": float(np.mean(np.abs(np.array(velocities) + 12.0) < 0.6)),
    }


def recast(ours: EmbeddedBackend, points: RadarPoints) -> tuple[np.ndarray, np.ndarray]:
    """Range and range rate along the same directions, from our scene and true motion."""
    suite = ours.sensing.suite
    one = suite.radars[0]
    ego = ours.truth().states.pose(0)
    view = one.view(ego)
    u = np.array([-tan(a) for a in points.azimuth])
    v = np.array([-tan(e) for e in points.altitude]) * np.sqrt(u * u + 1.0)
    rays, hits = make_rays(len(u), view.width, view.height), make_hits(len(u))
    rays.column[:], rays.row[:] = view.cx + view.focal * u, view.cy + view.focal * v
    suite.scene.cast(view, 0, 150.0, rays, hits)
    stretch = np.sqrt(u * u + v * v + 1.0)
    with np.errstate(divide="ignore"):
        distance = stretch / hits.inverse
    along = np.column_stack((np.ones(len(u)), -u, -v)) / stretch[:, None]
    along = along @ (ego @ one.spec.mount).rotation().T
    states = ours.truth().states
    rows = (hits.key.astype(np.int64) >> 16) - 1
    vx = np.where(rows >= 0, states.vx[rows], 0.0) - states.vx[0]
    vy = np.where(rows >= 0, states.vy[rows], 0.0) - states.vy[0]
    return distance, vx * along[:, 0] + vy * along[:, 1]


def main(port: int) -> dict[str, Any]:
    for id in (EGO, LEAD, VAN):
        same_model(id)
    ours, theirs = EmbeddedBackend(), CarlaBackend(CarlaOptions(port=port))
    out = {"images": images(ours, theirs), "radar": radar(ours, theirs)}
    theirs.close()
    return out


if __name__ == "__main__":
    print("RESULT", json.dumps(main(int(sys.argv[1]))), flush=True)
