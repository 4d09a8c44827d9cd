"""What each effect of a colour picture costs, in ns of processor time per pixel, and its budget.

    python tools/effects_bench.py [ROUNDS]

One picture of 800 x 600 in town with scenery, shaped bodies and 20 vehicles, at noon and at night in rain.
Printed: the 20th percentile of ROUNDS, so that other work on the machine counts little. An effect costs
what a picture with it costs more than one without it.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from functools import partial
from typing import Any

import cv2
import numpy as np

from skidpad.cockpit.pictures import QUALITY, colours
from skidpad.core.geometry import Pose
from skidpad.core.specs import CameraSpec, Modality
from skidpad.core.vocabulary import Bodywork, Quality, Scenery
from skidpad.physics.presets import preset
from skidpad.roads.bundled import load_map
from skidpad.scenery.dressing import dress_map
from skidpad.sensors.bench import convoy
from skidpad.sensors.finish.extras import ALL_EXTRAS, COSTLY, Extra
from skidpad.sensors.pictures.shading import shade_scene
from skidpad.sensors.raster.rasteriser import AUTO_LEVEL
from skidpad.sensors.raster.view import camera_view
from skidpad.sensors.suite import PixelSettings, PixelSuite
from skidpad.simulation.carla_server.sensing.pixels import bgra_from_rgb

CAMERA = CameraSpec("front", Modality.RGB, 800, 600, 75.0, Pose(-8.5, 0.0, 3.4), True)
# ns per pixel. Five views of the cockpit have 687 000 pixels; in 8 ms on two cores a pixel may take 23 ns.
BUDGET = {
    "triangles": 7.5,
    "shading": 5.0,
    "grain, tracks, veils": 4.0,
    "shadows": 1.0,
    "lamps": 0.3,
    "reflections": 0.5,
    "retro": 0.7,
    "clouds": 1.0,
    "fog": 1.7,
    "falling": 1.2,
    "edges": 1.0,
    "tone": 1.5,
    "camera effect": 1.0,
    "message of the server": 1.0,
    "JPEG of the cockpit": 6.0,
}


def cost(call: Callable[[], object], rounds: int) -> float:
    """Returns ns of processor time per pixel of a call."""
    took = []
    for _ in range(rounds):
        begin = time.thread_time_ns()
        call()
        took.append(time.thread_time_ns() - begin)
    return float(np.percentile(took, 20)) / (CAMERA.width * CAMERA.height)


def effects(weather: str, rounds: int) -> dict[str, float]:
    """Returns ns per pixel of each effect in a weather."""
    bare = load_map("town")
    map, (table, states) = dress_map(bare, Scenery.FULL), convoy(bare)
    settings = PixelSettings(extras=ALL_EXTRAS, bodywork=Bodywork.SHAPED, in_cockpit=False)
    suite = PixelSuite(map, table, [CAMERA], preset(weather), settings)
    suite.observe(0, states, {}, np.arange(len(table)) % 2 == 0)
    suite.render(CAMERA.id)
    one, out = suite._pass_of[CAMERA.id], suite._rgb[CAMERA.id]
    view, ego = camera_view(CAMERA, states.pose(0)), states.pose(0)
    plain = shade_scene(suite.scene.static, table, suite.shading.light, Quality.DRAFT, True)
    bgra = np.zeros((*out.shape, 4), dtype=np.uint8)

    def paint(shading: Any) -> float:
        return cost(lambda: shading.paint(view, ego, one.inverse, one.key, out), rounds)

    def message() -> bytes:
        bgra_from_rgb(out, bgra)
        return bgra.tobytes()

    found = {
        "triangles": cost(lambda: suite.scene.draw(view, -1, AUTO_LEVEL, one), rounds),
        "shading": paint(plain),
    }
    found["grain, tracks, veils"] = paint(suite.shading) - found["shading"]
    for extra in Extra:
        if extra.value in BUDGET:
            only = frozenset((extra,))
            found[extra.value] = cost(
                partial(suite._finish.add, only, view, True, one, out), rounds
            )
    noise = suite._degraded[CAMERA.id]
    found["camera effect"] = cost(lambda: noise.apply(0, out, range(view.top, view.height)), rounds)
    found["message of the server"] = cost(message, rounds)
    quality = [cv2.IMWRITE_JPEG_QUALITY, QUALITY]
    found["JPEG of the cockpit"] = cost(lambda: cv2.imencode(".jpg", colours(out), quality), rounds)
    return found


def main() -> None:
    """Measure and print."""
    rounds = int(sys.argv[1]) if len(sys.argv) > 1 else 25
    cv2.setNumThreads(1)
    noon, night = (effects(weather, rounds) for weather in ("clear-noon", "rain-night"))
    print("| ns per pixel | noon | rain at night | budget |\n|---|---|---|---|")
    for name, budget in BUDGET.items():
        missed = ": missed" if max(noon[name], night[name]) > budget else ""
        print(f"| {name} | {noon[name]:.1f} | {night[name]:.1f} | {budget:g}{missed} |")
    for quality, left in (("full", set()), ("draft", LEFT_OUT)):
        sums = [sum(v for k, v in one.items() if k not in left | AROUND) for one in (noon, night)]
        print(f"| a picture of the cockpit, {quality} | {sums[0]:.1f} | {sums[1]:.1f} | |")


LEFT_OUT = {"grain, tracks, veils", *(extra.value for extra in COSTLY)}  # of a draft
AROUND = {"message of the server", "JPEG of the cockpit"}

if __name__ == "__main__":
    main()
