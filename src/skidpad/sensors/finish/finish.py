"""All additions to the pictures of one run, in one weather at a time."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from skidpad.core.geometry import Pose
from skidpad.core.maths.randomness import stream
from skidpad.core.states import ActorStates, ActorTable
from skidpad.core.vocabulary import Bodywork, LightState
from skidpad.core.weather import Weather
from skidpad.roads.roadside import Roadside
from skidpad.sensors.finish.casters import Bodies, bodies_of, join_bodies, standing
from skidpad.sensors.finish.clouds import DRIFT, SIZE, draw_clouds, layer_of
from skidpad.sensors.finish.edges import soften_edges
from skidpad.sensors.finish.extras import Extra
from skidpad.sensors.finish.falling import BOXES, DROPS, draw_falling, falling_in
from skidpad.sensors.finish.fog import fog_of, veil_sky
from skidpad.sensors.finish.glow import shine
from skidpad.sensors.finish.lamps import Lamps
from skidpad.sensors.finish.retro import gains, send_back
from skidpad.sensors.finish.shadows import GROUND_MASK, cast_shadows, shade_of
from skidpad.sensors.finish.stars import STARS, draw_stars, starlight_of
from skidpad.sensors.finish.sun import draw_sun, sun_of
from skidpad.sensors.finish.tone import curve_of, set_tone
from skidpad.sensors.pictures.colours import ROADLIKE
from skidpad.sensors.pictures.lighting import Lighting
from skidpad.sensors.raster.passes import Pass
from skidpad.sensors.raster.view import View
from skidpad.sensors.scene.materials import MATERIALS

STANDING_REACH = 70.0  # m, of shadows of what stands beside the road
LEAST_WET = 0.1  # of 1, below which a road mirrors no lamp
WETTABLE = np.zeros(MATERIALS, dtype=np.bool_)
WETTABLE[list(ROADLIKE)] = True


class Finish:
    """Lays the chosen additions over pictures; `look_out` in a new weather, `place` every tick."""

    def __init__(
        self,
        table: ActorTable,
        roadside: Roadside,
        dt: float,
        bodywork: Bodywork = Bodywork.PLAIN,
        seed: int = 0,
    ) -> None:
        """seed: of where drops and flakes are."""
        self._places = stream(seed, "falling").random((DROPS, 3))
        self._table, self._dt = table, dt
        self._furniture = standing(roadside.boxes)
        self._lamps = Lamps(table, roadside.heads, bodywork, roadside.boxes)

    def look_out(self, weather: Weather, light: Lighting) -> None:
        """Sets what the pictures take from the weather and its light."""
        self._light = light
        self._gains = gains(light)
        self._curve = curve_of(light)
        self._layer = layer_of(weather, light)
        self._stars = starlight_of(weather)
        self._fog = fog_of(weather, light)
        self._shade = shade_of(weather, light, self._fog)
        self._sun = sun_of(weather, light, self._fog)
        self._falling = falling_in(weather, light)
        self._wet = light.wet * (1.0 - light.snow) if light.wet > LEAST_WET else 0.0
        self._drift = DRIFT * self._dt * (0.2 + 0.8 * weather.wind_intensity / 100.0)

    def place(
        self,
        tick: int,
        states: ActorStates,
        lights: Mapping[int, LightState],
        braking: NDArray[np.bool_],
        indicating: NDArray[np.bool_],
    ) -> None:
        """Takes in where all actors are now, and what shines. indicating: (n, 2), left and right."""
        self._tick, self._ego = tick, states.pose(0)
        self._velocity = np.array([states.vx[0], states.vy[0], 0.0])
        self._bodies = bodies_of(self._table, states)
        present = self._bodies.present.copy()
        present[0] = False
        self._others = self._bodies._replace(present=present)
        self._near = _within(self._furniture, self._ego, STANDING_REACH)
        self._sources = self._lamps.shining(states, lights, braking, indicating, self._light)

    def add(
        self, extras: frozenset[Extra], view: View, own: bool, one: Pass, out: NDArray[np.uint32]
    ) -> None:
        """Draws the additions into the rows of a view's picture `out`. own: the ego's body is seen in it."""
        inverse, key, light = one.inverse, one.key, self._light
        if Extra.CLOUDS in extras and self._layer.strength > 0.0:
            shift = (self._drift * self._tick) % SIZE
            draw_clouds(view, self._layer, shift, inverse, out)
        if Extra.CLOUDS in extras and self._stars > 0.0:
            draw_stars(view, STARS, self._stars, inverse, out)
        if Extra.FOG in extras and self._fog.depth > 0.0:
            veil_sky(view, self._fog, inverse, out)
        if Extra.SHADOWS in extras:
            cars = self._bodies if own else self._others
            every = join_bodies(self._near, cars)
            cast_shadows(view, every, self._shade, GROUND_MASK, inverse, key, out)
        if Extra.RETRO in extras and light.headlights > 0.0 and light.lamps > 0.0:
            send_back(view, self._ego, light, self._gains, inverse, key, out)
        if Extra.EDGES in extras:
            soften_edges(view, key, out)
        if Extra.LAMPS in extras and self._sun.colour[0] > 0.0:
            draw_sun(view, self._sun, inverse, out)
        bloom, wet = Extra.LAMPS in extras, self._wet if Extra.REFLECTIONS in extras else 0.0
        if bloom or wet > 0.0:
            shine(view, self._sources, bloom, wet, light.air, WETTABLE, inverse, key, out)
        if Extra.FALLING in extras and self._falling.share > 0.0:
            time = self._tick * self._dt
            ego = np.array([self._ego.x, self._ego.y, self._ego.z, self._ego.yaw])
            moved = self._velocity
            draw_falling(
                view, self._falling, light, BOXES, self._places, time, moved, ego, inverse, out
            )
        if Extra.TONE in extras:
            set_tone(view, self._curve, out)


def _within(bodies: Bodies, ego: Pose, reach: float) -> Bodies:
    """Returns the bodies whose centre lies within `reach` m of the ego."""
    near = np.hypot(bodies.x - ego.x, bodies.y - ego.y) < reach
    return Bodies._make(field[near] for field in bodies)
