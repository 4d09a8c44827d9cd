"""All pixel-level sensors of one ego: give it the state of the world, read its frames."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.errors import BackendError
from skidpad.core.frames import CameraImage, PartialImages, RadarPoints
from skidpad.core.geometry import Pose
from skidpad.core.inputs import Beam, Outside
from skidpad.core.setup import DT, CameraOptics
from skidpad.core.specs import CameraSpec, Modality, RadarSpec, SensorSpec
from skidpad.core.states import ActorStates, ActorTable
from skidpad.core.vocabulary import Bodywork, LightState, Quality, RangeModel
from skidpad.core.weather import Weather
from skidpad.physics.grip import rain_rate, road_surface
from skidpad.physics.optics import depth_range, label_range, radar_range
from skidpad.sensors.finish.clouds import FLATTEST
from skidpad.sensors.finish.extras import COSTLY, NO_EXTRAS, Extra
from skidpad.sensors.finish.finish import Finish
from skidpad.sensors.finish.fog import light_fog
from skidpad.sensors.finish.stars import light_night
from skidpad.sensors.pictures.degradation import CameraNoise, degradation
from skidpad.sensors.pictures.exposure import expose
from skidpad.sensors.pictures.lens import LensDrops
from skidpad.sensors.pictures.lighting import lighting
from skidpad.sensors.pictures.perception_noise import PerceptionNoise
from skidpad.sensors.pictures.shading import shade_scene
from skidpad.sensors.pictures.spray import veil_by_spray
from skidpad.sensors.ranging.beam import beam_of
from skidpad.sensors.ranging.clouds import SprayClouds
from skidpad.sensors.ranging.radar import Radar
from skidpad.sensors.raster.live_scene import LiveScene, SceneMap
from skidpad.sensors.raster.passes import NOTHING, UNLIMITED, Pass, Sight, poison
from skidpad.sensors.raster.rasteriser import AUTO_LEVEL
from skidpad.sensors.raster.view import View, camera_view

EGO = 0
BEAM_ONSET = (
    4.0  # m before the lamps, where the ground is lit in full, in a picture for people; by eye
)
CALM = 0.3  # share of the published camera effect in a calm picture for people; by eye
NO_NOISE = PerceptionNoise()


class Observation(NamedTuple):
    """One tick of cameras and radar."""

    images: Mapping[str, CameraImage]  # by sensor id, rendered when first read
    radar: RadarPoints


@dataclass(frozen=True, slots=True, kw_only=True)
class PixelSettings:
    """How pixels come about, apart from what is looked at."""

    range_model: RangeModel = RangeModel.NONE
    camera_effect: bool = True  # degrade RGB images
    optics: CameraOptics = CameraOptics()
    in_cockpit: bool = True  # weather spares what the published windscreen mask hides
    extras: frozenset[Extra] = NO_EXTRAS  # additions to colour images, for people only
    exclusive_stages: bool = False  # rain switches the night stage off (D-094)
    perception_noise: PerceptionNoise = NO_NOISE
    seed: int = 0
    dt: float = DT  # s
    render_all: bool = False
    level: int = AUTO_LEVEL  # one level of detail for all (tests)
    bodywork: Bodywork = Bodywork.PLAIN
    quality: Quality = Quality.FULL
    poison_old: bool = False  # spoil buffers that went stale (tests)

    @property
    def drawn_extras(self) -> frozenset[Extra]:
        """Returns the additions that are drawn in this quality."""
        return self.extras - COSTLY if self.quality is Quality.DRAFT else self.extras


class PixelSuite:
    """Cameras and radar at pixel level (A-018 to A-028).

    Buffers belong to the suite: an observation is valid until the next one (X-11); reading an
    image later is an error. Cameras of equal `view` share one raster pass, unless weather limits
    the sight of one of them only.
    """

    UNSAVED = ("_rgb",)

    def __init__(
        self,
        map: SceneMap,
        table: ActorTable,
        specs: Sequence[SensorSpec],
        weather: Weather,
        settings: PixelSettings = PixelSettings(),
    ) -> None:
        """Specs that are neither camera nor radar are ignored."""
        self.cameras = {s.id: s for s in specs if isinstance(s, CameraSpec)}
        self.settings, self._table, self._specs = settings, table, specs
        widest = max((c.width for c in self.cameras.values()), default=1)
        self.scene = LiveScene(map, table, widest, settings.bodywork)
        self._rgb = {
            c.id: np.zeros((c.height, c.width), dtype=np.dtype("<u4"))
            for c in self.cameras.values()
            if c.modality is Modality.RGB
        }
        self._finish = Finish(table, map.roadside, settings.dt, settings.bodywork, settings.seed)
        self._look_out(weather, settings.range_model, None)
        self._ego = Pose(0.0, 0.0)
        self.tick = -1

    def change(self, outside: Outside, extras: frozenset[Extra] | None = None) -> None:
        """Sets weather and headlights from the next observation on; extras, where given, too."""
        if extras is not None:
            self.settings = replace(self.settings, extras=extras)
        self._look_out(outside.weather, outside.range_model, outside.beam)

    def _look_out(self, weather: Weather, range_model: RangeModel, beam: Beam | None) -> None:
        """Sets light, sight and noise for a weather, and makes the passes, noises and radars anew."""
        settings, seed, dt = self.settings, self.settings.seed, self.settings.dt
        limited = range_model is RangeModel.PHYSICAL
        labels = label_range(weather, Beam.LOW if beam is None else beam)
        sight = Sight(depth_range(weather), labels) if limited else UNLIMITED
        extras = settings.drawn_extras
        foggy = Extra.FOG in extras
        light = lighting(
            weather,
            beam,
            haze=settings.optics.haze or foggy,
            ground=self.scene.ground if foggy else None,
        )
        if settings.optics.exposure:
            light = expose(light, weather)
        if Extra.CLOUDS in extras:
            light = light._replace(dome=FLATTEST)
        if Extra.LAMPS in extras:
            light = light_fog(light_night(light), weather)._replace(onset=BEAM_ONSET, glow=0.0)
        snowed = Extra.SNOW in extras
        self.shading = shade_scene(self.scene.static, self._table, light, settings.quality, snowed)
        if extras:
            self._finish.look_out(weather, light)
        self._passes: dict[tuple[object, Sight], Pass] = {}
        self._pass_of: dict[str, Pass] = {}
        for camera in self.cameras.values():
            eye = UNLIMITED if camera.modality is Modality.RGB else sight
            key = (camera.view, eye)
            self._pass_of[camera.id] = self._passes.setdefault(key, Pass(camera, eye))
        effect = degradation(weather, exclusive=settings.exclusive_stages)
        share = CALM if Extra.CALM in extras else 1.0
        effect = replace(effect, glass=settings.in_cockpit, share=share)
        if Extra.FALLING in extras:
            effect = replace(effect, streaks=0.0)
        self._degraded = (
            {id: CameraNoise(id, seed, effect) for id in self._rgb}
            if settings.camera_effect
            else {}
        )
        self._drops: dict[str, LensDrops] = {}
        if settings.optics.drops:
            rain = rain_rate(weather)
            self._drops = {id: LensDrops(self.cameras[id], seed, rain, dt) for id in self._rgb}
        self._spray: SprayClouds | None = None
        if settings.optics.spray or Extra.SPRAY in extras:
            self._spray = SprayClouds(self._table, road_surface(weather).film_mm / 1000.0)
        self._clouds = np.empty((0, 8))
        self.radars = [
            Radar(s, beam_of(s, seed, dt), radar_range(weather, s.range) if limited else s.range)
            for s in self._specs
            if isinstance(s, RadarSpec)
        ]

    def observe(
        self,
        tick: int,
        states: ActorStates,
        lights: Mapping[int, LightState],
        braking: NDArray[np.bool_] | None = None,
        indicating: NDArray[np.bool_] | None = None,
    ) -> Observation:
        """Returns what the sensors see of this state; images are drawn when they are first read.

        lights: by signal id. braking: (n,) whose brake lamps are lit; None: as they were.
        indicating: (n, 2) whose left and right indicators are lit; None: as they were.
        """
        self.tick = tick
        self._ego = states.pose(EGO)
        self.scene.place(states, self.settings.dt)
        self.scene.show(lights)
        if braking is not None:
            self.shading.set_braking(braking)
        if indicating is not None:
            self.shading.set_indicating(indicating)
        if self.settings.drawn_extras:
            n = len(self._table)
            lit = np.zeros(n, dtype=np.bool_) if braking is None else braking
            turns = np.zeros((n, 2), dtype=np.bool_) if indicating is None else indicating
            self._finish.place(tick, states, lights, lit, turns)
        speed = float(np.hypot(states.vx[EGO], states.vy[EGO]))
        for drops in self._drops.values():
            drops.move(tick, speed)
        if self._spray is not None:
            self._clouds = self._spray.at(states)
        for one in self._passes.values():
            one.drawn = NOTHING
            if self.settings.poison_old:
                poison(one.inverse, one.key)
        if self.settings.poison_old:
            poison(*self._rgb.values())
        images = LazyImages(self, tick)
        if self.settings.render_all:
            images = LazyImages(self, tick, {id: self.render(id) for id in self.cameras})
        return Observation(images, self._measure(tick))

    def render(self, id: str, rows: range | None = None) -> CameraImage:
        """Returns the image of one camera in the current state; with `rows`, at least those of it.

        Its arrays are buffers of the suite, which later calls overwrite; KeyError for an unknown camera.
        """
        camera, one = self.cameras[id], self._pass_of[id]
        noise, seed = self.settings.perception_noise, self.settings.seed
        whole = range(camera.height)
        if rows is None or noise != NO_NOISE:  # noise is drawn for whole images
            rows = whole
        view = camera_view(camera, self._ego)
        if camera.modality is Modality.RGB:  # a normal is read off the rows above and below
            self._draw(camera, view, one, range(max(rows.start - 1, 0), rows.stop + 1))
            return self._picture(id, view._replace(top=rows.start, height=rows.stop), one)
        self._draw(camera, view, one, rows)
        if camera.modality is Modality.DEPTH:
            noisy = noise.on_depth(one.inverse, seed, id, self.tick)
            return CameraImage(inverse_depth=noisy)
        if camera.modality is Modality.SEMANTIC:
            labels = noise.on_labels(one.labels, seed, id, self.tick)
            return CameraImage(labels=labels)
        return CameraImage(instances=one.instances)

    def _draw(self, camera: CameraSpec, view: View, one: Pass, rows: range) -> None:
        """Draws rows of a pass unless they show the present already."""
        missing = one.missing(range(rows.start, min(rows.stop, camera.height)))
        if not missing:
            return
        view = view._replace(top=missing.start, height=missing.stop)
        self.scene.draw(view, -1 if camera.shows_own_body else EGO, self.settings.level, one)
        one.limit_sight(view)
        one.drawn = missing

    def _picture(self, id: str, view: View, one: Pass) -> CameraImage:
        """Returns a colour image whose rows of the view are painted, with additions and noise."""
        packed = self._rgb[id]
        self.shading.paint(view, self._ego, one.inverse, one.key, packed)
        extras = self.settings.drawn_extras
        if extras:
            own = self.cameras[id].shows_own_body
            self._finish.add(extras, view, own, one, packed)
        if len(self._clouds):
            veil_by_spray(view, self._clouds, one.inverse, self.shading.light.horizon, packed)
        if id in self._drops:
            self._drops[id].draw(view, self.shading.light, packed)
        if id in self._degraded:
            self._degraded[id].apply(self.tick, packed, range(view.top, view.height))
        rgb = packed.view(np.uint8).reshape(*packed.shape, 4)[..., :3]
        return CameraImage(rgb=rgb, packed=packed)

    def snapshot(self, *ids: str) -> dict[str, NDArray[np.uint8]]:
        """Returns copies (H, W, 3) of RGB views as they are now, for a file (A-257); none given: all."""
        return {
            id: np.ascontiguousarray(rgb)
            for id in (ids or tuple(self._rgb))
            if (rgb := self.render(id).rgb) is not None
        }

    def _measure(self, tick: int) -> RadarPoints:
        """Returns the points of the first radar in this tick; empty where there is no radar."""
        if not self.radars:
            return RadarPoints.none()
        return self.radars[0].measure(tick, self._ego, self.scene, EGO)


class LazyImages(PartialImages):
    """Images by sensor id, each rendered when it is first read."""

    def __init__(
        self, suite: PixelSuite, tick: int, ready: dict[str, CameraImage] | None = None
    ) -> None:
        self._suite, self._tick = suite, tick
        self._ready = ready if ready is not None else {}

    def __getitem__(self, id: str) -> CameraImage:
        if id not in self._ready:
            self._check(id)
            self._ready[id] = self._suite.render(id)
        return self._ready[id]

    def rows(self, id: str, first: int, end: int) -> CameraImage:
        """Returns an image in which at least rows first to end - 1 are drawn.

        KeyError for an unknown camera, BackendError for an image of an older tick.
        """
        if id in self._ready:
            return self._ready[id]
        self._check(id)
        return self._suite.render(id, range(first, end))

    def _check(self, id: str) -> None:
        """Raises KeyError for an unknown camera and BackendError for an image of an older tick."""
        if id not in self._suite.cameras:
            raise KeyError(id)
        if self._suite.tick != self._tick:
            raise BackendError(
                f"image {id} of tick {self._tick} was first read after tick {self._suite.tick}; "
                "a frame is valid until the next step"
            )

    def __contains__(self, id: object) -> bool:
        return id in self._suite.cameras

    def __iter__(self) -> Iterator[str]:
        return iter(self._suite.cameras)

    def __len__(self) -> int:
        return len(self._suite.cameras)
