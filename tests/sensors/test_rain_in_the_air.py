"""Rain and snow in the air of pictures for people: depth, what hides them, what slants them."""

from dataclasses import replace

import numpy as np
import pytest

from skidpad.core.geometry import Pose
from skidpad.core.setup import CameraOptics
from skidpad.core.specs import CameraSpec, Modality
from skidpad.core.vocabulary import ActorKind
from skidpad.core.weather import Weather
from skidpad.physics.presets import preset
from skidpad.sensors.finish.extras import Extra
from skidpad.sensors.finish.falling import RAIN_FALL, draw_falling, falling_in
from skidpad.sensors.pictures.lighting import lighting
from skidpad.sensors.raster.view import camera_view
from skidpad.sensors.suite import PixelSettings, PixelSuite
from support.sensors.worlds import states_at, straight, table_of

EYE = CameraSpec("eye", Modality.RGB, 400, 300, 60.0, Pose(0.0, 0.0, 1.5))
RAIN = Weather(precipitation=80.0, cloudiness=100.0)
SNOWFALL = replace(RAIN, air_temperature_c=-3.0)
ONE = np.array([[10.0, 1.0]])  # m of edge, share
PLACES = np.random.default_rng(5).random((4000, 3))
GREY = np.uint32(0xFF505050)


def strokes(falling, velocity=(0.0, 0.0, 0.0), nearest=0.0, time=1.0, rows=None):
    """Pixels that strokes change in an even grey picture, with something `nearest` (1/m) before all of it."""
    view = camera_view(EYE, Pose(0.0, 0.0))
    if rows is not None:
        view = view._replace(top=rows.start, height=rows.stop)
    out = np.full((EYE.height, EYE.width), GREY)
    inverse = np.full(out.shape, nearest, dtype=np.float32)
    draw_falling(
        view,
        falling,
        lighting(RAIN),
        ONE,
        PLACES,
        time,
        np.array(velocity),
        np.zeros(4),
        inverse,
        out,
    )
    return out != GREY, out


def rain(**more):
    return falling_in(RAIN, lighting(RAIN))._replace(**more)


def slope(changed):
    """Mean columns per row along strokes: regression over how pixels agree with their neighbours below."""
    shifts = {
        k: (changed[:-1, 8:-8] & np.roll(changed, -k, axis=1)[1:, 8:-8]).sum() for k in (-1, 0, 1)
    }
    return (shifts[1] - shifts[-1]) / sum(shifts.values())


def test_what_stands_nearer_hides_strokes():
    open_air, wall_8, wall_3 = (
        strokes(rain(), nearest=w)[0].sum() for w in (0.0, 1 / 8.0, 1 / 3.0)
    )
    assert wall_3 < 0.5 * wall_8
    assert wall_8 < open_air
    assert not strokes(rain(), nearest=1.0)[0].any()


def test_rain_falls_upright_without_wind_and_slants_with_it():
    across = np.array([0.0, -RAIN_FALL, -RAIN_FALL])  # to the right
    still = np.array([0.0, 0.0, -RAIN_FALL])
    assert abs(slope(strokes(rain(velocity=still))[0])) < 0.03
    right, left = (slope(strokes(rain(velocity=v))[0]) for v in (across, across * (1, -1, 1)))
    assert right > 0.3
    assert left < -0.3


def test_strokes_run_away_from_where_a_fast_camera_goes():
    """At 25 m/s ahead, in the right half to the right, in the left half to the left."""
    still = np.array([0.0, 0.0, -0.01])
    changed, _ = strokes(rain(velocity=still), velocity=(25.0, 0.0, 0.0))
    lower = changed[160:]
    assert slope(lower[:, 210:]) > 0.1
    assert slope(lower[:, :190]) < -0.1


def test_flakes_are_wider_and_shorter_than_drops():
    flakes = falling_in(SNOWFALL, lighting(SNOWFALL))
    drops = rain()
    assert flakes.width > 2.0 * drops.width
    assert flakes.velocity[2] > 0.3 * drops.velocity[2]
    assert falling_in(Weather(), lighting(Weather())).share == 0.0


def test_strokes_of_some_rows_are_those_of_the_whole_and_move_with_time():
    whole, part = strokes(rain())[1], strokes(rain(), rows=range(100, 180))[1]
    assert np.array_equal(part[100:180], whole[100:180])
    assert not np.array_equal(whole, strokes(rain(), time=1.05)[1])
    assert np.array_equal(whole, strokes(rain())[1])


@pytest.mark.parametrize("weather", [RAIN, SNOWFALL], ids=["rain", "snow"])
def test_a_picture_has_them_instead_of_the_published_strokes(weather):
    def drawn(extras):
        settings = PixelSettings(extras=frozenset(extras), in_cockpit=False)
        suite = PixelSuite(straight(300), table_of([]), [EYE], weather, settings)
        image = suite.observe(3, states_at([(50, -7, 0, 0.0)]), {}).images["eye"].rgb.astype(int)
        return image, suite._degraded["eye"].strength.streaks

    published, streaks = drawn({Extra.CALM})
    mine, none = drawn({Extra.CALM, Extra.FALLING})
    assert streaks > 0.0 == none
    assert (np.abs(mine - published).max(axis=2) > 8).mean() > 0.005


def test_spray_for_people_is_that_of_the_setting():
    def drawn(**settings):
        table = table_of([ActorKind.TRUCK])
        states = states_at([(50, -7, 0, 0.0), (75, -7, 0, 0.0)])
        states.vx[:] = 25.0
        chosen = PixelSettings(camera_effect=False, **settings)
        suite = PixelSuite(straight(300), table, [EYE], preset("rain-noon"), chosen)
        return suite.observe(0, states, {}).images["eye"].rgb.copy()

    people = drawn(extras=frozenset({Extra.SPRAY}))
    assert np.array_equal(people, drawn(optics=CameraOptics(spray=True)))
    assert not np.array_equal(people, drawn())
