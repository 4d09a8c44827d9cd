"""CARLA's own settings of cameras: each moves the picture the documented way, and by default none does."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest

from skidpad.core.geometry import Pose
from skidpad.physics.presets import preset
from skidpad.sensors.pictures.lens_distortion import LensShape, source_pixels
from skidpad.simulation.carla_server.actors.catalogue import load_catalogue
from skidpad.simulation.carla_server.sensing.exposure_control import brightness
from skidpad.simulation.carla_server.weather import PACKED
from support.carla_stage import IMAGE_HEAD, SIZE, Stage, pictures

LEADERBOARD = {"lens_circle_multiplier": 3.0, "lens_circle_falloff": 3.0}
NIGHT = {"sun_altitude_deg": -30.0}
DULL = {"sun_altitude_deg": 8.0, "cloudiness": 100.0}
CAMERAS = [
    f"sensor.camera.{kind}"
    for kind in ("rgb", "depth", "semantic_segmentation", "instance_segmentation", "normals")
]


def shots(sensor: str, *variants: dict[str, Any], **weather: float) -> list[np.ndarray]:
    """The first pictures of cameras with these attributes, of one moment, a car ahead."""
    stage = Stage(**weather)
    stage.spawn("vehicle.audi.etron", Pose(14.0, 0.0))
    told = stage.run(sensor, *({**SIZE, **v} for v in variants), ticks=1)
    return [pictures(m)[0][..., :3] for m in told]


def light(picture: np.ndarray) -> np.ndarray:
    """Linear light of a colour picture, 1 being white."""
    return np.square(picture / 255.0)


@cache
def quiet() -> Stage:
    """A stage for cameras that are never made."""
    return Stage()


def index() -> np.ndarray:
    shape = LensShape(3.0, 3.0, -1.0, 0.0, 0.08, 0.08)
    return source_pixels(shape, SIZE["image_size_x"], SIZE["image_size_y"])


# --- defaults and wrong values


@pytest.mark.parametrize("sensor", ["sensor.camera.rgb", "sensor.camera.dvs"])
def test_the_defaults_given_are_no_attribute_at_all(sensor: str) -> None:
    catalogue = load_catalogue()[sensor].attributes
    given = {
        name: a.recommended[0] for name, a in catalogue.items() if a.modifiable and name not in SIZE
    }
    stage = Stage()
    plain, same = stage.run(sensor, SIZE, {**given, **SIZE}, ticks=3)
    assert plain == same


@pytest.mark.parametrize(
    ("name", "value", "sentence"),
    [
        ("lens_circle_falloff", "11", "a number between 0 and 10, got '11'"),
        ("lens_x_size", "-0.1", "a number between 0 and 1, got '-0.1'"),
        ("lens_k", "a", "a float, got 'a'"),
        ("gamma", "0", "a number between 0.1 and 10, got '0'"),
        ("iso", "-100", "a number between 1 and 1e+06, got '-100'"),
        ("fstop", "0", "a number between 0.1 and 64, got '0'"),
        ("exposure_mode", "auto", "one of histogram, manual, got 'auto'"),
        ("exposure_min_bright", "13", "at most exposure_max_bright, 12, got '13'"),
        ("tint", "2", "a number between -1 and 1, got '2'"),
        ("chromatic_aberration_intensity", "-1", "a number between 0 and 100, got '-1'"),
    ],
)
def test_a_wrong_value_is_one_sentence(name: str, value: str, sentence: str) -> None:
    stage = quiet()
    before = len(stage.served.episode.actors)
    told = str(stage.attach("sensor.camera.rgb", **{name: value}))
    assert f"sensor.camera.rgb: {name} must be {sentence}" in told
    assert len(stage.served.episode.actors) == before


# --- the lens


def test_every_camera_shows_the_nearest_pixel_of_its_straight_picture() -> None:
    """So depth, tags and ids are values of the straight picture, and cameras agree pixel by pixel."""
    stage = Stage()
    stage.spawn("vehicle.audi.etron", Pose(14.0, 0.0))
    streams = [stage.attach_all(c, SIZE, {**SIZE, **LEADERBOARD}) for c in CAMERAS]
    stage.ticks(1)
    for straight, bent in ([pictures(stage.told(s))[0] for s in pair] for pair in streams):
        assert np.array_equal(bent, straight.reshape(-1, 4)[index()])
        assert not np.array_equal(bent, straight)


def test_flow_has_the_vectors_of_the_straight_picture() -> None:
    stage = Stage()
    told = stage.run("sensor.camera.optical_flow", SIZE, {**SIZE, **LEADERBOARD}, ticks=2)
    straight, bent = (np.frombuffer(m[1][IMAGE_HEAD:], "<f4").reshape(-1, 2) for m in told)
    assert straight.any()
    assert np.array_equal(bent.reshape(*index().shape, 2), straight[index()])


def test_events_come_from_the_bent_picture() -> None:
    stage = Stage()
    sensor = "sensor.camera.dvs"
    plain, bent = stage.run(sensor, SIZE, {**SIZE, "lens_circle_multiplier": 6.0}, ticks=3)
    assert plain != bent


# --- exposure


def test_one_step_of_compensation_is_twice_the_light() -> None:
    """Compared where neither picture is white: before the curve, so in linear light."""
    plain, more, less = shots(
        "sensor.camera.rgb", {}, {"exposure_compensation": 1.0}, {"exposure_compensation": -2.0}
    )
    dark = (plain > 40) & (plain < 150)
    assert dark.sum() > 1000
    assert np.median(light(more)[dark] / light(plain)[dark]) == pytest.approx(2.0, abs=0.02)
    assert np.median(light(less)[dark] / light(plain)[dark]) == pytest.approx(0.25, abs=0.02)


def test_darkening_brings_back_what_was_white() -> None:
    plain, less = shots("sensor.camera.rgb", {}, {"exposure_compensation": -3.0})
    white = (plain == 255).all(axis=-1)
    if white.any():
        assert less[white].max() < 255
    assert less.max() < plain.max()


def test_a_manual_exposure_follows_aperture_time_and_sensitivity() -> None:
    """EV100 12 is clear noon as it is shown; each doubling of light on the sensor is one step."""
    noon = {"sun_altitude_deg": 60.0, "cloudiness": 0.0}
    base = {"exposure_mode": "manual", "iso": 100.0, "fstop": 8.0, "shutter_speed": 64.0}  # 12.0
    variants = (
        {}, base, {**base, "iso": 50.0}, {**base, "shutter_speed": 128.0},
        {**base, "fstop": 8.0 * 2**0.5}, {**base, "exposure_compensation": -1.0},
    )  # fmt: skip
    shown, same, *halved = shots("sensor.camera.rgb", *variants, **noon)
    scene = brightness(Stage(**noon).weather)
    step = 2.0 ** (min(scene, 12.0) - 12.0)
    dark = (shown > 40) & (shown < 150)
    assert np.median(light(same)[dark] / light(shown)[dark]) == pytest.approx(step, rel=0.02)
    for picture in halved:
        assert np.median(light(picture)[dark] / light(same)[dark]) == pytest.approx(0.5, abs=0.02)


def test_a_users_match_of_a_real_server_shows_noon() -> None:
    """1/3000 s at f/1.4 and ISO 100 looked right on 0.9.10.1 (carla-simulator/carla#3634)."""
    manual = {"exposure_mode": "manual", "shutter_speed": 3000.0}
    plain, matched, default = shots(
        "sensor.camera.rgb", {}, manual, {"exposure_mode": "manual"}, sun_altitude_deg=45.0
    )
    dark = (plain > 40) & (plain < 150)
    assert 0.4 < np.median(light(matched)[dark] / light(plain)[dark]) < 1.0  # within 1.3 steps
    assert (default == 255).mean() > 0.5  # as there: white (carla-simulator/carla#3127)


def test_the_range_of_the_histogram_limits_adaptation() -> None:
    """Night is dark because the range ends at EV100 10; a wider one adapts, a higher one is darker."""
    night, wide, high = shots(
        "sensor.camera.rgb", {}, {"exposure_min_bright": 0.0},
        {"exposure_min_bright": 11.0}, **NIGHT,
    )  # fmt: skip
    assert wide.mean() > 2.0 * night.mean()
    dim = (night > 20) & (night < 150)
    assert np.median(light(high)[dim] / light(night)[dim]) == pytest.approx(0.5, abs=0.1)
    noon, lower = shots("sensor.camera.rgb", {}, {"exposure_max_bright": 11.0})
    assert lower.mean() > noon.mean()


def test_adaptation_takes_the_time_of_its_speed() -> None:
    """From noon to a dull dawn within the range: 1 stop per s, so 0.05 stops a tick."""
    stage = Stage(sun_altitude_deg=60.0)
    slow = {"exposure_speed_down": 1.01, "exposure_speed_up": 3.0}
    streams = stage.attach_all("sensor.camera.rgb", SIZE, {**SIZE, **slow})
    stage.ticks(1)
    before = brightness(stage.weather)
    stage.call("set_weather_parameters", [*(DULL.get(n, 0.0) for n in PACKED), 0.0])
    stage.ticks(30)
    at_once, slowly = (pictures(stage.told(s))[..., :3] for s in streams)
    assert np.array_equal(at_once[0], slowly[0])
    dark = (at_once[1] > 40) & (at_once[1] < 150)
    ratios = [
        np.median(light(b)[dark] / light(a)[dark]) for a, b in zip(at_once, slowly, strict=True)
    ]
    gap = before - max(brightness(stage.weather), 10.0)
    assert ratios[1] == pytest.approx(2.0 ** -(gap - 0.0505), rel=0.03)
    assert ratios[1] < ratios[10] < ratios[20] < ratios[30]


def test_brightness_of_weathers_is_ordered() -> None:
    noon, dawn, night = (
        brightness(preset(n)) for n in ("clear-noon", "clear-sunrise", "clear-night")
    )
    assert noon == 12.0
    assert night < dawn < noon


# --- film, colour, fringes


@cache
def toned() -> list[np.ndarray]:
    return shots(
        "sensor.camera.rgb", {}, {"gamma": 1.6}, {"gamma": 2.8}, {"temp": 9000.0},
        {"temp": 4000.0}, {"tint": 0.5}, {"slope": 1.0}, {"toe": 0.8},
        {"chromatic_aberration_intensity": 4.0},
    )  # fmt: skip


def test_tone_and_colour_move_the_documented_way() -> None:
    plain, low, high, warm, cold, magenta, steep, dark, _ = toned()
    assert low.mean() < plain.mean() < high.mean()
    middle = (plain > 60) & (plain < 200)
    expected = 255.0 * (plain[middle] / 255.0) ** (2.2 / 1.6)
    assert np.abs(low[middle] - expected).max() <= 0.51
    blue, green, red = (plain.reshape(-1, 3) - 0.0).mean(axis=0)
    assert warm[..., 2].mean() / warm[..., 0].mean() > red / blue
    assert cold[..., 2].mean() / cold[..., 0].mean() < red / blue
    assert magenta[..., 1].mean() < green
    assert steep.std() > plain.std()
    assert dark.mean() < plain.mean()


def test_fringes_leave_blue_where_it_is() -> None:
    plain, *_, fringed = toned()
    assert np.array_equal(fringed[..., 0], plain[..., 0])
    assert not np.array_equal(fringed[..., 2], plain[..., 2])


BLURRED = {"motion_blur_intensity": 1.0, "motion_blur_max_distortion": 5.0}


def test_what_moves_in_the_picture_is_blurred_and_nothing_else() -> None:
    """The camera drives at 20 m/s behind a car as fast: road moves, the car stays in its place."""
    stage = Stage()
    stage.spawn("vehicle.audi.etron", Pose(14.0, 0.0))
    variants = ({}, BLURRED, {**BLURRED, "motion_blur_intensity": 0.0},
                {**BLURRED, "motion_blur_max_distortion": 0.0}, {"motion_blur_intensity": 0.2})  # fmt: skip
    told = stage.run("sensor.camera.rgb", *({**SIZE, **v} for v in variants), ticks=3)
    sharp, blurred, none, limited, short = (pictures(m)[2][..., :3] for m in told)
    assert np.array_equal(none, sharp)
    assert np.array_equal(limited, sharp)
    change = np.abs(blurred - sharp).max(axis=-1)
    assert change[-20:].mean() > 2.0 * np.abs(short - sharp).max(axis=-1)[-20:].mean()
    assert change[-20:].mean() > 4.0 * change[45:75, 65:95].mean()
    first = [pictures(m)[0] for m in told[:2]]
    assert np.array_equal(*first)  # nothing is known of what was before


def test_bloom_adds_light_beside_lamps_at_night() -> None:
    plain, none, more = shots(
        "sensor.camera.rgb", {}, {"bloom_intensity": 0.0}, {"bloom_intensity": 4.0}, **NIGHT
    )
    assert np.array_equal(plain, none)
    assert (more >= plain).all()
    assert more.mean() > plain.mean() + 0.5


def test_without_post_processing_none_of_it_acts_but_the_lens() -> None:
    strange = {
        "gamma": 1.0,
        "exposure_compensation": 2.0,
        "temp": 3000.0,
        "exposure_mode": "manual",
    }
    off = {"enable_postprocess_effects": "False"}
    plain, without, bent = shots(
        "sensor.camera.rgb", {}, {**strange, **off}, {**strange, **off, **LEADERBOARD}
    )
    assert np.array_equal(plain, without)
    assert np.array_equal(bent, plain.reshape(-1, 3)[index()])
