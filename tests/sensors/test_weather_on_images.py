"""What weather does to images: the published degradation, its noise, its mask, and its limits."""

import colorsys

import numpy as np
import pytest

from skidpad.cockpit.studio import SENSOR, Looks, Studio, plane
from skidpad.core.geometry import Pose
from skidpad.core.inputs import Beam, Outside
from skidpad.core.specs import CameraSpec, Modality
from skidpad.core.states import WorldTruth
from skidpad.core.vocabulary import (
    ActorKind,
    Bodywork,
    GripModel,
    LightState,
    RangeModel,
    Scenery,
    SemanticClass,
)
from skidpad.core.weather import Weather
from skidpad.physics.presets import preset
from skidpad.roads.roadside import SignalHead
from skidpad.sensors.finish.extras import NO_EXTRAS
from skidpad.sensors.pictures.degradation import (
    CameraNoise,
    Degradation,
    clear_of_weather,
    degradation,
    glass_mask,
)
from skidpad.sensors.pictures.perception_noise import PerceptionNoise
from skidpad.sensors.published_sensors import twelve_sensors
from skidpad.sensors.suite import PixelSettings, PixelSuite
from support.sensors.worlds import World, lanes_along, states_at, straight, table_of, traffic

SIX = ("clear-sunrise", "clear-noon", "clear-night", "rain-sunrise", "rain-noon", "rain-night")
GREY = 110


def flat(height=200, width=300, value=GREY):
    return np.full((height, width, 3), value, dtype=np.uint8)


def degraded(strength, tick=0, image=None, id="front", seed=1, noise=None):
    image = flat() if image is None else image
    packed = np.full(image.shape[:2], 0xFF000000, dtype="<u4")
    view = packed.view(np.uint8).reshape(*packed.shape, 4)[..., :3]
    view[:] = image
    (noise or CameraNoise(id, seed, strength)).apply(tick, packed)
    assert (packed >> 24 == 255).all()
    return view


@pytest.mark.req("A-222")
def test_rain_noise_has_the_published_strength_and_half_the_colour():
    out = degraded(Degradation(15.0, 0.5, False, 0.0)).astype(float)
    glass = ~clear_of_weather(200, 300)
    # Half of a channel's own noise plus half of the grey value's: var = s^2 (1/4 + w/2 + |w|^2/4).
    weights = np.array([0.299, 0.587, 0.114])
    expected = 15.0 * np.sqrt(0.25 + weights / 2 + (weights**2).sum() / 4)
    assert np.allclose(out[glass].std(axis=0), expected, rtol=0.02)
    assert np.allclose(out[glass].mean(axis=0), GREY, atol=0.3)
    red = np.zeros((200, 300, 3), dtype=np.uint8) + np.array([200, 60, 60], dtype=np.uint8)
    mixed = degraded(Degradation(1e-6, 0.5, False, 0.0), image=red)
    grey = 0.299 * 200 + 0.701 * 60
    assert np.allclose(mixed[glass], [(200 + grey) / 2, (60 + grey) / 2, (60 + grey) / 2], atol=0.6)


@pytest.mark.req("A-222")
def test_rain_noise_scales_with_precipitation():
    assert degradation(Weather(precipitation=40.0)).rain_sigma == pytest.approx(6.0)


@pytest.mark.req("A-223")
def test_night_darkens_lifts_and_adds_noise():
    out = degraded(Degradation(0.0, 0.0, True, 0.0)).astype(float)
    glass = ~clear_of_weather(200, 300)
    assert out[glass].mean() == pytest.approx(0.6 * GREY + 20.0, abs=0.2)
    assert out[glass].std() == pytest.approx(20.0, rel=0.02)


@pytest.mark.req("A-224", "A-225")
def test_which_stage_acts_when():
    both = degradation(preset("rain-night"))
    assert both.night
    assert both.rain_sigma == pytest.approx(15.0)
    assert not degradation(preset("rain-night"), exclusive=True).night
    assert degradation(preset("clear-night"), exclusive=True).night
    assert not degradation(preset("clear-noon")).any
    assert not degradation(preset("clear-sunrise")).any


@pytest.mark.req("A-226", "A-227", "A-264")
@pytest.mark.parametrize(("height", "width"), [(600, 800), (180, 450), (160, 160)])
def test_the_mask_is_the_published_windscreen(height, width):
    y, x = np.mgrid[0:height, 0:width]
    w, h = 0.18 * width, 0.35 * height
    pillar = (y > (h / w) * x + (0.85 * height - h)) & (x < w) & (y < 0.85 * height)
    assert np.array_equal(clear_of_weather(height, width), pillar | (y >= 0.85 * height))
    assert glass_mask(height, width, True) is glass_mask(height, width, True)


@pytest.mark.req("A-226", "A-228")
def test_cockpit_and_pillar_stay_clean_and_values_are_bytes():
    rng = np.random.default_rng(3)
    image = rng.integers(0, 256, (200, 300, 3), dtype=np.uint8)
    out = degraded(degradation(preset("rain-night")), image=image.copy())
    clean = clear_of_weather(200, 300)
    assert np.array_equal(out[clean], image[clean])
    assert out.dtype == np.uint8
    assert (out[~clean] != image[~clean]).mean() > 0.9


@pytest.mark.req("A-229")
def test_noise_depends_on_seed_sensor_tick_and_pixel_only():
    strength = degradation(preset("rain-night"))
    once = degraded(strength, tick=7)
    noise = CameraNoise("front", 1, strength)
    for tick in (3, 9):
        degraded(strength, tick, noise=noise)
    again = degraded(strength, 7, noise=noise)
    assert np.array_equal(once, again)
    for other in (
        degraded(strength, tick=8),
        degraded(strength, tick=7, seed=2),
        degraded(strength, tick=7, id="rear"),
    ):
        a, b = (i[:100, 100:].astype(float).ravel() for i in (once, other))
        assert abs(np.corrcoef(a, b)[0, 1]) < 0.03


def test_noise_of_neighbouring_pixels_rows_and_channels_is_unrelated():
    out = degraded(Degradation(0.0, 0.0, True, 0.0)).astype(float)[:100, 100:]
    for a, b in (
        (out[:, 1:], out[:, :-1]),
        (out[1:], out[:-1]),
        (out[..., 0], out[..., 1]),
    ):
        assert abs(np.corrcoef(a.ravel(), b.ravel())[0, 1]) < 0.03


@pytest.mark.req("A-221", "A-036")
def test_depth_and_labels_are_equal_in_all_presets_without_a_range_model():
    world = straight()
    table, states = traffic(world)
    frames = []
    for name in SIX:
        suite = PixelSuite(world, table, twelve_sensors(), preset(name), PixelSettings(seed=4))
        images = suite.observe(5, states, {}).images
        frames.append(
            b"".join(
                (
                    images["depth_roof"].inverse_depth.tobytes(),
                    images["depth_bumper"].inverse_depth.tobytes(),
                    images["semantic_roof"].labels.tobytes(),
                    images["semantic_bumper"].labels.tobytes(),
                )
            )
        )
    assert len(set(frames)) == 1


def test_fog_hides_what_lies_beyond_the_sight():
    fog = Weather(fog_density=95.0)
    world = straight()
    table, states = traffic(world)
    seen = {}
    for model in RangeModel.NONE, RangeModel.PHYSICAL:
        suite = PixelSuite(world, table, twelve_sensors(), fog, PixelSettings(range_model=model))
        images = suite.observe(0, states, {}).images
        seen[model] = (images["depth_roof"].depth().copy(), images["semantic_roof"].labels.copy())
    free, foggy = seen[RangeModel.NONE], seen[RangeModel.PHYSICAL]
    visible = np.isfinite(foggy[0])
    farthest = foggy[0][visible].max()
    assert 10.0 < farthest < 150.0
    assert np.array_equal(free[0][visible], foggy[0][visible])
    assert (foggy[1][free[0] > 3.0 * farthest] == SemanticClass.SKY).all()
    assert (free[1] == SemanticClass.ROAD).sum() > (foggy[1] == SemanticClass.ROAD).sum()


@pytest.mark.req("A-230")
def test_perception_noise_is_off_by_default_and_has_its_strength():
    world = straight()
    table, states = traffic(world)
    exact = PixelSuite(world, table, twelve_sensors(), Weather()).observe(0, states, {})
    noisy = PixelSuite(
        world,
        table,
        twelve_sensors(),
        Weather(),
        PixelSettings(perception_noise=PerceptionNoise(depth_sigma_ratio=0.02, label_dropout=0.1)),
    ).observe(0, states, {})
    a, b = exact.images["depth_roof"].depth(), noisy.images["depth_roof"].depth()
    near = np.isfinite(a)
    assert (b[near] / a[near] - 1.0).std() == pytest.approx(0.02, rel=0.03)
    labels = exact.images["semantic_roof"].labels, noisy.images["semantic_roof"].labels
    assert (labels[0] != labels[1]).mean() == pytest.approx(0.1, abs=0.003)


@pytest.mark.req("A-226")
def test_weather_noise_spares_the_mask_only_where_a_cockpit_is_shown():
    """People look with cameras outside of the car: none of the five views hides a cockpit."""
    world = straight()
    table, states = traffic(world)
    night, n = preset("rain-night"), len(table)
    outside = Outside(weather=night, grip=GripModel.NONE, range_model=RangeModel.NONE)
    shown = Studio(world, table, outside, 1, NO_EXTRAS, Looks(Scenery.NONE, Bodywork.PLAIN))
    read = PixelSuite(world, table, twelve_sensors(), night)
    for view, id in SENSOR.items():
        if not id.startswith("rgb"):
            continue
        ours, theirs = [], []
        for tick in (3, 4):  # nothing moves, and nobody brakes: what differs is noise
            truth = WorldTruth(tick, table, states, np.ones((n, 4)), np.zeros((n, 5)), {}, (), ())
            ours.append(plane(shown.look(truth)[view.value]).copy())
            theirs.append(read.observe(tick, states, {}).images[id].packed.copy())
        spared = clear_of_weather(*ours[0].shape)
        moved, stayed = ours[0] != ours[1], theirs[0] == theirs[1]
        assert stayed[spared].all(), id
        assert (~stayed[~spared]).mean() > 0.5, id
        assert moved[spared].mean() > 0.5, id
        assert moved[~spared].mean() > 0.5, id


EYE = CameraSpec("eye", Modality.RGB, 800, 600, 90.0, Pose(0.05, 0.35, 1.3))
MAP_EYE = CameraSpec("map", Modality.INSTANCE, 800, 600, 90.0, Pose(0.05, 0.35, 1.3))


def picture(world, weather, lights=None, braking=None, table=None, states=None, effect=False):
    if table is None:
        table, states = table_of([]), states_at([(100, -5.25, 0, 0)])
    suite = PixelSuite(
        world, table, [EYE, MAP_EYE], preset(weather), PixelSettings(camera_effect=effect)
    )
    images = suite.observe(0, states, lights or {}, braking).images
    return images["eye"].rgb, images["map"].instances


@pytest.mark.req("A-165", "A-218")
@pytest.mark.parametrize("distance", [14.0, 30.0, 45.0])
@pytest.mark.parametrize("weather", SIX)
@pytest.mark.parametrize(
    ("state", "low", "high"),
    [(LightState.RED, -20, 20), (LightState.YELLOW, 40, 70), (LightState.GREEN, 100, 170)],
)
def test_a_lit_lamp_has_its_hue_in_every_weather(distance, weather, state, low, high):
    world = straight(300, heads=[SignalHead(5, 100.0 + distance, -5.25, 4.0, 0.0)], rails=False)
    lit, _ = picture(world, weather, {5: state})
    dark, _ = picture(world, weather, {5: LightState.OFF})
    changed = (lit != dark).any(axis=2)
    assert changed.sum() >= 3
    hsv = np.array([colorsys.rgb_to_hsv(*(p / 255.0)) for p in lit[changed]])
    hue = (hsv[:, 0] * 360.0 + 180.0) % 360.0 - 180.0
    assert ((hue > low) & (hue < high)).all()
    assert (hsv[:, 1] > 80 / 255).all()
    assert (hsv[:, 2] > 80 / 255).all()


@pytest.mark.req("A-218")
def test_day_rain_and_night_read_at_a_glance():
    world = straight()
    mean = {name: picture(world, name)[0].mean(axis=(0, 1)) for name in SIX}
    assert mean["clear-noon"].mean() > 2.5 * mean["clear-night"].mean()
    assert mean["rain-noon"].mean() > 2.5 * mean["rain-night"].mean()
    assert np.ptp(mean["rain-noon"]) < 0.5 * np.ptp(mean["clear-noon"])
    assert mean["clear-sunrise"][0] > mean["clear-sunrise"][2]
    night, _ = picture(world, "clear-night")
    road_near, road_far = night[420:500, 350:450].mean(), night[310:316, 390:410].mean()
    assert road_near > 2.0 * road_far  # the ego's own headlights


def test_brake_lamps_brighten():
    world = straight()
    table = table_of([ActorKind.CAR])
    states = states_at([(100, -5.25, 0, 0), (112, -5.25, 0, 0)])
    off, where = picture(world, "clear-night", table=table, states=states)
    on, _ = picture(
        world, "clear-night", braking=np.array([False, True]), table=table, states=states
    )
    changed = (on != off).any(axis=2)
    assert 20 < changed.sum() < 4000
    assert (where[changed] == 2).all()
    assert (on[changed][:, 0] > on[changed][:, 1] + 100).all()


def mirrored_world():
    """A level road and its mirror image in the plane y = 0."""
    x = np.arange(401, dtype=float)
    zero = np.zeros_like(x)
    one = World(*lanes_along(x, zero + 7.0, zero, zero))
    s, lanes = lanes_along(x, zero + 7.0, zero, zero)
    two = World(
        s._replace(y=-s.y, marking_left=s.marking_right, marking_right=s.marking_left),
        lanes._replace(left=lanes.right, right=lanes.left, lane_id=lanes.lane_id[::-1].copy()),
    )
    return one, two


@pytest.mark.req("A-016")
def test_a_mirrored_scene_gives_mirrored_images():
    one, two = mirrored_world()
    table = table_of([ActorKind.CAR, ActorKind.TRUCK])
    poses = np.array([(100, 1.0, 0, 0.1), (118, 3.0, 0, -0.2), (135, -4.0, 0, 0.3)])
    specs = [
        CameraSpec(m.value, m, 320, 240, 90.0, Pose(1.5, 0.3, 2.4, yaw=0.05))
        for m in (Modality.DEPTH, Modality.SEMANTIC, Modality.RGB)
    ]
    flipped = [
        CameraSpec(s.id, s.modality, 320, 240, 90.0, Pose(1.5, -0.3, 2.4, yaw=-0.05)) for s in specs
    ]
    a = PixelSuite(one, table, specs, Weather()).observe(0, states_at(poses), {}).images
    b = PixelSuite(two, table, flipped, Weather())
    b = b.observe(0, states_at(poses * (1, -1, 1, -1)), {}).images
    assert np.allclose(a["depth"].inverse_depth, b["depth"].inverse_depth[:, ::-1], rtol=1e-4) or (
        np.isclose(a["depth"].inverse_depth, b["depth"].inverse_depth[:, ::-1], rtol=1e-4).mean()
        > 0.999
    )
    assert (a["semantic"].labels == b["semantic"].labels[:, ::-1]).mean() > 0.999
    different = np.abs(a["rgb"].rgb.astype(int) - b["rgb"].rgb[:, ::-1]).max(axis=2) > 3
    assert different.mean() < 0.004


def test_an_even_road_is_evenly_lit_up_to_the_borders_of_the_image():
    rgb, _ = picture(straight(300, rails=False), "clear-noon")
    column = rgb[520:, 400].astype(int)
    row = rgb[590, [0, 1, 400, 798, 799]].astype(int)
    assert np.ptp(column, axis=0).max() <= 2
    assert np.ptp(row, axis=0).max() <= 2


@pytest.mark.parametrize("beam", [None, *Beam])
def test_a_suite_whose_weather_changed_sees_as_one_that_began_with_it(beam):
    world = straight()
    table, states = traffic(world)
    night = preset("rain-night")
    settings = PixelSettings(range_model=RangeModel.PHYSICAL, seed=4)
    changed = PixelSuite(world, table, twelve_sensors(), preset("clear-noon"), settings)
    changed.observe(0, states, {})
    outside = Outside(
        weather=night, grip=GripModel.NONE, range_model=RangeModel.PHYSICAL, beam=beam
    )
    changed.change(outside)
    began = PixelSuite(world, table, twelve_sensors(), night, settings)
    if beam is not None:
        began.change(outside)
    a, b = changed.observe(1, states, {}), began.observe(1, states, {})
    for id in ("rgb_front", "rgb_top"):
        assert np.array_equal(a.images[id].rgb, b.images[id].rgb)
    assert np.array_equal(
        a.images["depth_roof"].inverse_depth, b.images["depth_roof"].inverse_depth
    )
    assert np.array_equal(a.images["semantic_roof"].labels, b.images["semantic_roof"].labels)
    assert all(np.array_equal(p, q) for p, q in zip(a.radar, b.radar, strict=True))


@pytest.mark.req("A-219")
def test_a_high_beam_lights_the_road_farther_and_nothing_else_changes():
    world = straight(400, rails=False)
    table, states = traffic(world)
    eyes = PixelSuite(world, table, twelve_sensors(), preset("clear-night"))
    seen = {}
    for beam in (None, *Beam):
        eyes.change(
            Outside(
                weather=preset("clear-night"),
                grip=GripModel.NONE,
                range_model=RangeModel.PHYSICAL,
                beam=beam,
            )
        )
        images = eyes.observe(0, states, {}).images
        depth = images["depth_roof"].inverse_depth.copy()
        rgb = images["rgb_front"].rgb.astype(float)
        # the ego's own lane at 15 m and 60 m, 1.3 m below the camera: rows from focal length 400
        near, far = (rgb[300 + round(400 * 1.3 / d), 380:420].mean() for d in (15.0, 60.0))
        seen[beam] = near, far, depth, images["semantic_roof"].labels.copy()
    off, low, high = (seen[beam] for beam in Beam)
    assert off[0] + 10 < low[0] <= high[0] + 1
    assert high[1] > low[1] + 5 > off[1] + 5
    assert seen[None][:2] == low[:2]  # by night the low beam is on by itself
    far_off, far_low, far_high = (
        np.count_nonzero(s[3] == SemanticClass.CAR) for s in (off, low, high)
    )
    assert far_off <= far_low <= far_high
