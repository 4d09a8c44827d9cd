"""Additions to pictures for people: where each one may change a pixel, and that nothing else changes."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from skidpad.core.geometry import Pose
from skidpad.core.inputs import Beam, Outside
from skidpad.core.specs import CameraSpec, Modality
from skidpad.core.vocabulary import ActorKind, GripModel, LightState, RangeModel, SemanticClass
from skidpad.core.weather import Weather
from skidpad.physics.optics import transmission
from skidpad.physics.presets import preset
from skidpad.roads.roadside import Box, Shape, SignalHead
from skidpad.sensors.finish.extras import ALL_EXTRAS, NO_EXTRAS, Extra
from skidpad.sensors.finish.fog import fog_of
from skidpad.sensors.finish.outline import MOST, spans
from skidpad.sensors.finish.stars import light_night, starlight_of
from skidpad.sensors.finish.sun import sun_of
from skidpad.sensors.finish.tone import CURVE, curve_of, set_tone
from skidpad.sensors.pictures.lighting import lighting
from skidpad.sensors.raster.view import camera_view
from skidpad.sensors.scene.materials import Material
from skidpad.sensors.suite import PixelSettings, PixelSuite
from support.sensors.worlds import states_at, straight, table_of

DRIVER = Pose(0.5, 0.0, 1.4, 0.0, 0.0, 0.0)
SIGN = Box(SemanticClass.TRAFFIC_SIGN, 130.0, -15.0, 2.0, 0.0, 0.1, 1.5, 1.5, rgb=(200, 200, 210))
HOUSE = Box(SemanticClass.BUILDING, 140.0, 12.0, 0.0, 0.0, 12.0, 8.0, 9.0, rgb=(150, 120, 100))
HEAD = SignalHead(7, 140.0, -8.75, 5.2, 0.0)
MOMENT = [(100.0, -8.75, 0.0, 0.0), (114.0, -5.25, 0.0, 0.0), (130.0, -12.25, 0.0, np.pi)]


class Seen:
    """One moment in colours, and what stands behind each pixel."""

    def __init__(self, weather, extras, moment=MOMENT, beam=None, camera_effect=False):
        cameras = [
            CameraSpec(m.value, m, 400, 300, 75.0, DRIVER)
            for m in (Modality.RGB, Modality.DEPTH, Modality.SEMANTIC)
        ]
        settings = PixelSettings(camera_effect=camera_effect, extras=frozenset(extras))
        world = straight(300, boxes=[SIGN, HOUSE], heads=[HEAD])
        suite = PixelSuite(world, table_of([ActorKind.CAR] * 2), cameras, weather, settings)
        if beam is not None:
            suite.change(Outside(weather=weather, grip=GripModel.PHYSICAL,
                                 range_model=RangeModel.NONE, beam=beam))  # fmt: skip
        braking = np.array([False, True, False])
        images = suite.observe(40, states_at(moment), {7: LightState.RED}, braking).images
        self.rgb = images["rgb"].rgb.astype(int)
        self.labels = images["semantic"].labels.copy()
        self.depth = images["depth"].inverse_depth.copy()
        self.instance = (suite._pass_of["rgb"].key >> 16).copy()
        self.material = (suite._pass_of["rgb"].key & 255).copy()
        self.suite = suite


def both(weather, extra, **more):
    """The plain picture and the one with an addition, which changes neither depth nor classes."""
    plain, added = Seen(weather, NO_EXTRAS, **more), Seen(weather, {extra}, **more)
    assert np.array_equal(plain.depth, added.depth)
    assert np.array_equal(plain.labels, added.labels)
    return plain, added, (plain.rgb != added.rgb).any(axis=2)


def test_clouds_change_the_sky_only_and_drift():
    weather = Weather(cloudiness=50.0, wind_intensity=100.0)
    plain, _, changed = both(weather, Extra.CLOUDS)
    sky = plain.labels == SemanticClass.SKY
    assert changed[sky].mean() > 0.3
    assert not changed[~sky].any()
    assert not both(Weather(cloudiness=0.0), Extra.CLOUDS)[2].any()


def test_a_low_sun_has_a_disc_and_its_glare_lies_over_what_stands_before_the_sky():
    low = Weather(sun_altitude_deg=6.0, sun_azimuth_deg=0.0)  # straight ahead
    plain, added, changed = both(low, Extra.LAMPS)
    sky = plain.labels == SemanticClass.SKY
    white = sky & (added.rgb.min(axis=2) > 250)
    rows, columns = np.nonzero(white)
    focal = 200.0 / np.tan(np.radians(37.5))
    assert abs(columns.mean() - 200.0) < 8.0
    assert abs(150.0 - rows.mean() - focal * np.tan(np.radians(6.0))) < 8.0
    assert changed[~sky].mean() > 0.5
    fog = replace(low, fog_density=90.0)
    light = lighting(fog)
    assert sun_of(fog, light, fog_of(fog, light)).colour.max() == 0.0
    for hidden in (replace(low, cloudiness=100.0), replace(low, sun_azimuth_deg=180.0)):
        plain, added, _ = both(hidden, Extra.LAMPS)
        lit = (added.rgb - plain.rgb)[np.isin(plain.labels, (SemanticClass.TERRAIN,))]
        assert abs(lit).mean() < 1.0


def test_stars_shine_in_a_clear_night_sky_only():
    plain, added, changed = both(preset("clear-night"), Extra.CLOUDS)
    sky = plain.labels == SemanticClass.SKY
    assert 10 < changed.sum() < 0.05 * sky.sum()
    assert not changed[~sky].any()
    assert (added.rgb >= plain.rgb).all()
    assert not both(preset("rain-night"), Extra.CLOUDS)[2].any()


def test_the_night_sky_is_brighter_and_redder_towards_the_horizon_and_the_day_as_it_was():
    night, noon = (Seen(preset(f"clear-{sun}"), {Extra.LAMPS}) for sun in ("night", "noon"))
    sky = night.labels == SemanticClass.SKY
    rows = [night.rgb[row][sky[row]].mean(axis=0) for row in (5, 140)]
    assert (rows[1] > rows[0] + 10.0).all()
    assert rows[1][0] > rows[1][2]
    day = lighting(preset("clear-noon"))
    assert np.array_equal(noon.suite.shading.light.horizon, day.horizon)


def test_stars_come_after_dusk_and_no_rain_falls_from_them():
    night = preset("clear-night")
    share = [
        starlight_of(w)
        for w in (replace(night, sun_altitude_deg=sun) for sun in (3.0, -5.0, -9.0, -13.0))
    ]
    assert share[0] == share[1] == 0.0 < share[2] < share[3]
    shower = replace(night, precipitation=20.0)
    assert starlight_of(shower) == 0.0


def test_dense_fog_hides_the_sky_as_it_hides_the_ground():
    def spread(seen):
        light = (seen.rgb[seen.labels == SemanticClass.SKY] / 255.0) ** 2
        return (light.std(axis=0) / light.mean(axis=0)).max()

    clear = Weather(cloudiness=60.0)
    plain, foggy, _ = both(replace(clear, fog_density=90.0), Extra.FOG)
    sky = foggy.labels == SemanticClass.SKY
    ground = np.abs((plain.rgb / 255.0) ** 2 - (foggy.rgb / 255.0) ** 2)[~sky]
    assert ground.max() < 0.03, "by two laws of contrast"
    assert spread(foggy) < 0.02
    assert spread(Seen(clear, {Extra.CLOUDS})) > 0.08
    haze = 255.0 * np.sqrt(foggy.suite.shading.light.horizon)
    assert np.abs(foggy.rgb[sky] - haze).max() < 6.0, "one colour with what the ground fades into"


def painted(suite):
    """Red of the picture without what is laid over it, bloom among it."""
    camera, one, ego = suite.cameras["rgb"], suite._pass_of["rgb"], suite._ego
    packed = np.zeros((300, 400), dtype=np.uint32)
    suite.shading.paint(camera_view(camera, ego), ego, one.inverse, one.key, packed)
    return packed.view(np.uint8).reshape(300, 400, 4)[..., 0].astype(int)


def test_the_pool_of_the_headlights_begins_without_a_line_beside_the_car():
    behind = Pose(-8.5, 0.0, 3.4, 0.0, np.radians(9.0), 0.0)
    camera = CameraSpec("rgb", Modality.RGB, 400, 300, 75.0, behind, shows_own_body=True)

    def steepest(extras):
        settings = PixelSettings(camera_effect=False, extras=frozenset(extras))
        table = table_of([ActorKind.CAR] * 2)
        suite = PixelSuite(straight(300), table, [camera], preset("clear-night"), settings)
        _ = suite.observe(40, states_at(MOMENT), {}).images["rgb"].rgb
        road = (suite._pass_of["rgb"].key & 255) == Material.ASPHALT
        red = painted(suite)
        assert red[road].max() > 60, "the road is lit"
        return np.abs(np.diff(red, axis=0))[road[1:] & road[:-1]].max()

    assert steepest(NO_EXTRAS) > 24
    assert steepest({Extra.LAMPS}) < 12


def test_in_fog_at_night_lamps_and_walls_fade_into_one_dim_light():
    fog = Weather(cloudiness=100.0, fog_density=90.0, sun_altitude_deg=-30.0)
    seen = Seen(fog, {Extra.LAMPS}, beam=Beam.OFF)
    red = (painted(seen.suite) / 255.0) ** 2
    left, haze = transmission(fog, 40.0), float(seen.suite.shading.light.horizon[0])
    lamp = np.median(red[seen.material == Material.LAMP_RED])
    assert lamp == pytest.approx(left + (1.0 - left) * haze, abs=0.03)
    wall = red[seen.labels == SemanticClass.BUILDING]
    assert wall.min() > 0.6 * haze
    assert haze > 3.0 * lighting(fog).horizon[0]
    clear = replace(fog, fog_density=0.0)
    plain = light_night(lighting(clear))
    assert Seen(clear, {Extra.LAMPS}).suite.shading.light.horizon[0] == plain.horizon[0]


def test_edges_are_softened_where_two_surfaces_meet_and_nowhere_else():
    plain, added, changed = both(preset("clear-noon"), Extra.EDGES)
    seen = plain.labels.astype(int) << 16 | plain.instance << 8 | plain.material
    edge = np.zeros(seen.shape, dtype=bool)
    for axis in (0, 1):
        differs = np.diff(seen, axis=axis) != 0
        before, behind = [slice(None)] * 2, [slice(None)] * 2
        before[axis], behind[axis] = slice(None, -1), slice(1, None)
        edge[tuple(before)] |= differs
        edge[tuple(behind)] |= differs
    assert not changed[~edge].any()
    assert changed[edge].mean() > 0.8

    def steepest(rgb):
        return np.percentile(np.abs(np.diff(rgb, axis=1)).max(axis=2)[edge[:, 1:]], 90)

    assert steepest(added.rgb) < 0.8 * steepest(plain.rgb)


def test_snow_lies_on_the_road_for_people_only():
    plain, added, changed = both(preset("snow"), Extra.SNOW)
    asphalt = plain.material == Material.ASPHALT
    assert changed[asphalt].all()
    others = ~asphalt & (plain.material != Material.MARKING)
    vehicles = plain.instance > 0
    assert vehicles.any()
    assert not changed[vehicles | (plain.labels == SemanticClass.SKY)].any()
    assert changed[others].mean() < 0.1, "elsewhere it lies on what looks up only"
    assert added.rgb[asphalt].mean() > plain.rgb[asphalt].mean() + 40.0
    assert not both(preset("clear-noon"), Extra.SNOW)[2].any()


def test_no_dots_of_snow_lie_along_the_ridges_of_a_conifer():
    """A pixel of a ridge has one slope of either face, which together may look up where neither does."""
    cone = Box(
        SemanticClass.VEGETATION, 116.0, -1.0, 1.0, 0.2, 4.0, 4.0, 7.0, rgb=(40, 80, 45),
        shape=Shape.CONE,
    )  # fmt: skip
    camera = CameraSpec("rgb", Modality.RGB, 800, 600, 75.0, DRIVER)
    settings = PixelSettings(camera_effect=False, extras=frozenset({Extra.SNOW}))
    suite = PixelSuite(
        straight(300, boxes=[cone]), table_of([]), [camera], preset("snow"), settings
    )
    suite.shading._grain[:] = 0.0  # snow on even needles
    rgb = suite.observe(0, states_at(MOMENT[:1]), {}).images["rgb"].rgb.astype(int).max(axis=2)
    tree = (suite._pass_of["rgb"].key & 255) == Material.FIRST_FREE
    assert 5000 < tree.sum() < 100_000
    inside = tree[:, 1:-1] & tree[:, :-2] & tree[:, 2:]
    above = rgb[:, 1:-1] - np.maximum(rgb[:, :-2], rgb[:, 2:])
    assert (above[inside] < 40).mean() > 0.999, "all but rims of skirts"


def test_ice_lies_on_the_road_for_people_only():
    icy = preset("icy_70")
    plain, added, changed = both(icy, Extra.SNOW)
    assert np.array_equal(plain.rgb, Seen(replace(icy, ice_thickness=0.0), NO_EXTRAS).rgb)
    asphalt = plain.material == Material.ASPHALT
    assert changed[asphalt].all()
    assert not changed[(plain.instance > 0) | (plain.labels == SemanticClass.SKY)].any()
    wet, ice = plain.rgb[asphalt].mean(axis=0), added.rgb[asphalt].mean(axis=0)
    assert (ice > wet + 25.0).all()
    assert ice[2] - ice[0] > wet[2] - wet[0] + 5.0, "and it is bluish"
    snow = Seen(preset("snow"), {Extra.SNOW}).rgb[asphalt].mean(axis=0)
    assert (ice < snow - 15.0).all()
    thin = Seen(preset("icy_10"), {Extra.SNOW}).rgb[asphalt].mean(axis=0)
    assert (thin < ice).all(), "2 mm of ice are nearly black"


def test_markings_signs_and_plates_send_the_headlights_back():
    plain, added, changed = both(preset("clear-night"), Extra.RETRO)
    returned = np.isin(plain.labels, [SemanticClass.ROAD_LINE, SemanticClass.TRAFFIC_SIGN])
    returned |= plain.material == Material.PLATE
    assert not changed[~returned].any()
    assert (added.rgb >= plain.rgb).all()
    sign = plain.labels == SemanticClass.TRAFFIC_SIGN
    line = plain.labels == SemanticClass.ROAD_LINE
    assert changed[sign].mean() > 0.9
    assert changed[line].any()
    icy = replace(preset("clear-night"), ice_thickness=50.0)
    assert not both(icy, Extra.RETRO)[2][line].any(), "under milky ice"
    for weather, beam in ((preset("clear-noon"), None), (preset("clear-night"), Beam.OFF)):
        assert not both(weather, Extra.RETRO, beam=beam)[2].any()


def test_lamps_bloom_where_they_are_seen():
    plain, added, _ = both(preset("clear-night"), Extra.LAMPS)
    far = plain.depth < 1.0 / 6.0  # nearer, the beam rises
    assert (added.rgb >= plain.rgb)[far].all()
    red = added.rgb[..., 0] - plain.rgb[..., 0]
    for material in (Material.TAIL_LAMP, Material.HEADLAMP, Material.LAMP_RED):
        rows, columns = np.nonzero(plain.material == material)
        assert len(rows), material
        near = red[rows.min() - 6 : rows.max() + 7, columns.min() - 6 : columns.max() + 7]
        assert near.max() > 20, material
    ground = far & (plain.labels != SemanticClass.SKY)
    assert (red[ground] > 6).mean() < 0.2
    # a lamp behind another vehicle, and one that looks away, shine on nothing
    hidden = [MOMENT[0], (106.0, -8.75, 0.0, 0.0), (114.0, -8.75, 0.0, np.pi)]
    behind = [MOMENT[0], (80.0, -8.75, 0.0, 0.0), (60.0, -8.75, 0.0, 0.0)]
    _, with_both, _ = both(preset("clear-night"), Extra.LAMPS, moment=hidden)
    _, alone, _ = both(preset("clear-night"), Extra.LAMPS, moment=[*hidden[:2], behind[2]])
    visible = with_both.labels == alone.labels
    assert np.abs(with_both.rgb - alone.rgb)[visible].max() <= 1


def test_a_wet_road_mirrors_lamps_below_them():
    plain, added, changed = both(preset("rain-night"), Extra.REFLECTIONS)
    road = np.isin(plain.material, [Material.ASPHALT, Material.MARKING, Material.SHOULDER])
    assert changed.sum() > 50
    assert not changed[~road].any()
    tails = np.nonzero((plain.material == Material.TAIL_LAMP) & (plain.rgb[..., 0] > 100))
    below = changed[tails[0].max() :, tails[1].min() : tails[1].max() + 1]
    assert below.any()
    assert (added.rgb >= plain.rgb).all()
    assert not both(preset("clear-night"), Extra.REFLECTIONS)[2].any()


def test_what_stands_beside_the_road_has_a_shadow_too():
    low = Weather(sun_altitude_deg=30.0, sun_azimuth_deg=270.0)  # from the left
    plain, added, changed = both(low, Extra.SHADOWS, moment=[MOMENT[0]] + MOMENT[1:2] * 2)
    left = np.arange(400) < 190
    grass = np.isin(plain.material, [Material.GRASS, Material.EMBANKMENT, Material.SHOULDER])
    assert (changed & grass & left).sum() > 20
    assert (added.rgb <= plain.rgb).all()


def test_a_calm_picture_has_less_noise_and_the_streaks():
    loud = Seen(preset("rain-night"), NO_EXTRAS, camera_effect=True).rgb
    calm = Seen(preset("rain-night"), {Extra.CALM}, camera_effect=True).rgb
    assert calm[:100].std() < 0.6 * loud[:100].std()
    assert (np.abs(calm - Seen(preset("rain-night"), NO_EXTRAS).rgb).max(axis=2) > 20).any()


def test_tone_makes_corners_darker_at_noon_and_contrast_by_day_only():
    for weather, contrast in (("clear-noon", True), ("clear-night", False)):
        seen, other, _ = both(preset(weather), Extra.TONE)
        curve = curve_of(seen.suite.shading.light)
        assert (curve > 0.5) == contrast
    seen, other, _ = both(preset("clear-noon"), Extra.TONE)
    corner, middle = (slice(0, 20), slice(0, 20)), (slice(100, 120), slice(190, 210))
    brighter = [other.rgb[at].mean() / seen.rgb[at].mean() for at in (corner, middle)]
    assert brighter[0] < 0.97 * brighter[1]


@pytest.mark.parametrize("curve", [0.0, CURVE])
def test_the_curve_of_tone_keeps_the_order_of_all_greys(curve):
    camera = CameraSpec("a", Modality.RGB, 64, 256, 1.0, DRIVER)  # so narrow that no light is lost
    grey = np.arange(256, dtype=np.uint32)[:, None]
    out = np.repeat(grey | grey << 8 | grey << 16 | np.uint32(0xFF000000), 64, axis=1)
    set_tone(camera_view(camera, Pose(0.0, 0.0)), curve, out)
    found = out.view(np.uint8).reshape(256, 64, 4).astype(int)
    assert (found[..., :3] == found[..., :1]).all()
    found = found[..., 0].mean(axis=1)  # noise hides the steps between bytes
    assert (np.diff(found) >= -0.05).all()
    assert found[[0, 255]].tolist() == [0.0, 255.0]
    steepest = np.diff(found)[80:120].mean()
    assert (steepest > 1.2) == (curve > 0.0)


def test_switched_off_again_the_picture_is_the_plain_one():
    seen, plain = Seen(preset("rain-night"), ALL_EXTRAS), Seen(preset("rain-night"), NO_EXTRAS)
    assert (seen.rgb != plain.rgb).any()
    outside = Outside(
        weather=preset("rain-night"), grip=GripModel.PHYSICAL, range_model=RangeModel.NONE
    )
    for extras, wanted in ((NO_EXTRAS, plain.rgb), (ALL_EXTRAS, seen.rgb)):
        seen.suite.change(outside, extras)
        braking = np.array([False, True, False])
        images = seen.suite.observe(40, states_at(MOMENT), {7: LightState.RED}, braking).images
        assert np.array_equal(images["rgb"].rgb, wanted)


@given(
    st.lists(st.tuples(*[st.floats(-12.0, 12.0)] * 3), min_size=4, max_size=16),
    st.lists(st.floats(0.0, 1.0), min_size=16, max_size=16),
    st.floats(-3.1, 3.1),
)
@pytest.mark.filterwarnings("error")
def test_spans_hold_every_point_of_a_volume(corners, weights, yaw):
    camera = CameraSpec("c", Modality.RGB, 200, 150, 80.0, Pose(0.0, 0.0, 1.0, 0.0, 0.1, yaw))
    view = camera_view(camera, Pose(0.0, 0.0))
    points, ring = np.empty((MOST, 2)), np.empty(2 * MOST, dtype=np.int64)
    columns = np.empty((150, 2), dtype=np.int64)
    volume = np.array(corners)
    first, end = spans(view, volume, points, ring, columns)
    share = np.array(weights[: len(corners)]) + 1e-3
    inside = [*volume, share @ volume / share.sum()]
    for point in inside:
        x, y, z = view.rotation @ (point - view.centre)
        if z <= 0.31:
            continue
        u, v = view.cx + view.focal * x / z, view.cy + view.focal * y / z
        if 0.01 < u < 199.99 and 0.01 < v < 149.99:
            assert first <= int(v) < end
            assert columns[int(v), 0] <= int(u) < columns[int(v), 1]
