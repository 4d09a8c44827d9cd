"""Attributes of sensor blueprints that are additions of ours: set by calls, seen in the data."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from skidpad.core.geometry import Pose
from skidpad.physics.optics import depth_range, extinction, radar_range
from skidpad.sensors.pictures.exposure import expose
from skidpad.sensors.pictures.lighting import lighting
from skidpad.simulation.carla_server.actors.catalogue import AttributeType, load_catalogue
from skidpad.simulation.carla_server.actors.effects import load_acting
from skidpad.simulation.carla_server.protocol import wire
from support.carla_preface import STAGE
from support.carla_stage import HEAD, IMAGE_HEAD, SIZE, Stage, pictures

CHANNELS = 16
RADAR = {"points_per_second": 8000, "horizontal_fov": 20, "vertical_fov": 10}
LIDAR = {
    "channels": CHANNELS, "range": 80, "points_per_second": 64000, "rotation_frequency": 20,
    "upper_fov": 2, "lower_fov": -14,
}  # fmt: skip
RAIN = {"precipitation": 100, "wetness": 100, "precipitation_deposits": 60, "cloudiness": 80}
FOG, DENSE_FOG = {"fog_density": 75}, {"fog_density": 95}


def rows(messages: list[bytes]) -> list[np.ndarray]:
    """Velocity, azimuth, altitude and depth of a radar's messages."""
    return [np.frombuffer(m, "<f4").reshape(-1, 4) for m in messages]


def points(messages: list[bytes]) -> np.ndarray:
    """x, y, z, intensity of all points of a lidar's messages, whose channels' counts are checked."""
    clouds = []
    for m in messages:
        cloud = np.frombuffer(m[8 + 4 * CHANNELS :], "<f4").reshape(-1, 4)
        assert np.frombuffer(m[8 : 8 + 4 * CHANNELS], "<u4").sum() == len(cloud)
        clouds.append(cloud)
    return np.concatenate(clouds)


# --- defaults and wrong values


def all_additions() -> list[tuple[str, str]]:
    return sorted(
        (sensor, name) for sensor, names in load_acting().additions.items() for name in names
    )


def test_all_have_a_type_and_recommended_values_that_act() -> None:
    """Each recommended value is taken, and the first one is the default."""
    stage = Stage()
    for sensor, name in all_additions():
        attribute = load_catalogue()[sensor].attributes[name]
        assert attribute.modifiable
        assert attribute.type is not AttributeType.COLOUR
        for value in attribute.recommended:
            before = len(stage.served.episode.actors)
            stage.attach(sensor, **{name: value})
            assert len(stage.served.episode.actors) == before + 1, (sensor, name, value)
    assert ("sensor.other.radar", "radar_model") in all_additions()


@pytest.mark.parametrize(
    ("sensor", "name", "value", "sentence"),
    [
        ("other.radar", "radar_output", "objects", "one of points, detections, tracks, got 'objects'"),
        ("other.radar", "radar_interference", "1.5", "a number between 0 and 1, got '1.5'"),
        ("other.radar", "radar_multipath", "maybe", "true or false, got 'maybe'"),
        ("lidar.ray_cast", "lidar_dirt", "-0.1", "a number between 0 and 0.95, got '-0.1'"),
        ("lidar.ray_cast", "lidar_drops_s", "a", "a float, got 'a'"),
        ("camera.rgb", "camera_drops", "2", "true or false, got '2'"),
        ("camera.rgb", "night_rain", "none", "one of both, rain_only, got 'none'"),
    ],
)  # fmt: skip
def test_a_wrong_value_is_one_sentence(sensor: str, name: str, value: str, sentence: str) -> None:
    stage = Stage()
    before = len(stage.served.episode.actors)
    told = str(stage.attach(f"sensor.{sensor}", **{name: value}))
    assert f"sensor.{sensor}: {name} must be {sentence}" in told
    assert len(stage.served.episode.actors) == before


@pytest.mark.parametrize(
    ("sensor", "model"), [("other.radar", "radar"), ("lidar.ray_cast", "lidar")]
)
def test_a_range_without_cells_or_drops_is_refused(sensor: str, model: str) -> None:
    told = str(Stage().attach(f"sensor.{sensor}", range=0.5, **{f"{model}_model": "physical"}))
    assert "range must be" in told
    assert "got 0.5" in told


@pytest.mark.parametrize(
    ("sensor", "given"),
    [
        ("sensor.other.radar", RADAR), ("sensor.lidar.ray_cast", LIDAR),
        ("sensor.camera.depth", SIZE), ("sensor.camera.semantic_segmentation", SIZE),
        ("sensor.camera.instance_segmentation", SIZE), ("sensor.camera.rgb", SIZE),
        ("sensor.camera.dvs", SIZE),
    ],
)  # fmt: skip
def test_by_default_weather_changes_no_byte(sensor: str, given: dict[str, Any]) -> None:
    """Ours set to their defaults are no attribute at all; weather is in colours alone, as light."""
    told = {}
    defaults = {
        name: load_catalogue()[sensor].attributes[name].recommended[0]
        for name in load_acting().additions[sensor]
    }
    for name, weather in (("clear", {}), ("storm", {**RAIN, **FOG})):
        stage = Stage(**weather)
        stage.spawn("vehicle.audi.etron", Pose(25.0, 0.0))
        plain, same = stage.run(sensor, given, {**given, **defaults}, ticks=3)
        assert len(plain) >= 2
        assert plain == same
        told[name] = plain
    coloured = sensor.endswith(("rgb", "dvs"))
    assert (told["clear"] == told["storm"]) is not coloured


# --- radar


def test_rain_shortens_the_range_of_a_radar() -> None:
    stage = Stage(**RAIN)
    physical = {"range_model": "physical"}
    free, short = stage.run("sensor.other.radar", RADAR, {**RADAR, **physical}, ticks=3)
    limit = radar_range(stage.weather, 100.0)
    far, near = (max(r[:, 3].max() for r in rows(m)) for m in (free, short))
    assert near <= limit < far <= 100.0


@cache
def radar_scene() -> SimpleNamespace:
    """A lorry ahead, a car in the left lane, and rails; radars of many kinds, in rain."""
    stage = Stage(**RAIN)
    stage.spawn("vehicle.carlamotors.carlacola", Pose(30.0, 0.0), 24.0)
    stage.spawn("vehicle.audi.etron", Pose(50.0, -3.5, yaw=np.pi), -20.0)  # it comes
    echoes = {**RADAR, "horizontal_fov": 40, "radar_model": "physical"}
    kinds: dict[str, dict[str, Any]] = {
        "geometric": {"radar_model": "geometric"}, "points": {},
        "again": {}, "other_seed": {"noise_seed": 5}, "in_rain": {"range_model": "physical"},
        "detections": {"radar_output": "detections"}, "tracks": {"radar_output": "tracks"},
        "multipath": {"radar_multipath": "true"}, "interference": {"radar_interference": 1.0},
    }  # fmt: skip
    told = stage.run("sensor.other.radar", *({**echoes, **k} for k in kinds.values()), ticks=12)
    return SimpleNamespace(**{k: rows(m) for k, m in zip(kinds, told, strict=True)})


def count(readings: list[np.ndarray]) -> int:
    return sum(map(len, readings))


def test_a_physical_radar_finds_what_drives_ahead_and_not_its_carrier() -> None:
    seen = radar_scene()
    assert count(seen.points) < 0.2 * count(seen.geometric)
    hits = 0
    for k, reading in enumerate(seen.points):
        assert len(reading) == 0 or reading[:, 3].min() > 5.0
        gap = 30.0 - 2.4 - 2.6 + 0.2 * (k + 1)  # about: to the lorry's rear
        near = (np.abs(reading[:, 3] - gap) < 1.5) & (np.abs(reading[:, 1]) < 0.08)
        hits += bool((near & (np.abs(reading[:, 0] - 4.0) < 1.0)).any())
    assert hits >= 9
    assert all(np.array_equal(a, b) for a, b in zip(seen.points, seen.again, strict=True))
    assert not all(np.array_equal(a, b) for a, b in zip(seen.points, seen.other_seed, strict=True))


def test_azimuths_of_a_physical_radar_are_positive_to_the_right_as_carlas() -> None:
    """The car that comes closes at 40 m/s, in the lane to the right of ours."""
    closing = np.concatenate([r[r[:, 0] < -30.0] for r in radar_scene().points])
    assert len(closing) >= 5
    assert np.median(closing[:, 1]) > 0.03


def test_outputs_of_a_physical_radar() -> None:
    seen = radar_scene()
    assert 0 < count(seen.detections) < count(seen.points)
    assert len(seen.tracks[0]) == len(seen.tracks[1]) == 0  # none is confirmed yet
    last = seen.tracks[-1]
    assert (np.abs(last[:, 0] - 4.0) < 1.0).any()
    assert count(seen.tracks) < count(seen.detections)


def test_rain_multipath_and_interference_on_a_physical_radar() -> None:
    seen = radar_scene()
    assert count(seen.in_rain) < count(seen.points)
    assert count(seen.interference) < count(seen.points)
    assert count(seen.multipath) > count(seen.points)


def test_tracks_outlive_an_actor_that_comes() -> None:
    stage = Stage()
    stage.spawn("vehicle.audi.etron", Pose(30.0, 0.0))
    tracking = {"radar_model": "physical", "radar_output": "tracks"}
    (stream,) = stage.attach_all("sensor.other.radar", {**RADAR, **tracking})
    stage.ticks(7)
    stage.spawn("vehicle.audi.etron", Pose(-40.0, 0.0))
    stage.ticks(1)
    assert len(rows(stage.told(stream))[-1])


def test_a_physical_radar_on_a_post_sees_traffic() -> None:
    stage = Stage()
    stage.spawn("vehicle.audi.etron", Pose(30.0, 0.0))
    post = stage.served.episode.actors
    before = set(post.alive)
    given = [[n, 3, str(v)] for n, v in {**RADAR, "radar_model": "physical"}.items()]
    place = stage.start @ Pose(-20.0, 0.0, 2.0)
    stage.call("spawn_actor", [0, "sensor.other.radar", given], wire.transform(place))
    (new,) = set(post.alive) - before
    for _ in range(4):
        stage.served.tick()
    seen = np.concatenate(rows([m[HEAD:] for m in stage.hub.told[post.alive[new].stream]]))
    assert (np.abs(seen[:, 0] - 20.0) < 1.0).any()


# --- lidar


def lidars(weather: dict[str, float], *variants: dict[str, Any]) -> list[np.ndarray]:
    """Points of lidars on the ego, behind a car that sprays."""
    stage = Stage(**weather)
    stage.spawn("vehicle.audi.etron", Pose(16.0, 0.0))
    told = stage.run("sensor.lidar.ray_cast", *({**LIDAR, **v} for v in variants), ticks=4)
    return [points(m) for m in told]


PHYSICAL = {"lidar_model": "physical"}
IN_AIR = {**PHYSICAL, "range_model": "physical"}


def far(cloud: np.ndarray) -> int:
    """How many points are beyond 20 m."""
    return int((np.linalg.norm(cloud[:, :3], axis=1) > 20.0).sum())


def test_fog_weakens_and_hides_what_a_lidar_sees() -> None:
    exact, weak, clear, foggy, advection = lidars(
        FOG, {}, {"range_model": "physical"}, PHYSICAL, IN_AIR, {**IN_AIR, "lidar_fog": "advection"}
    )
    stage = Stage(**FOG)
    distance = np.linalg.norm(weak[:, :3], axis=1)
    law = np.exp(-extinction(stage.weather) * distance)
    assert weak[:, 3] == pytest.approx(law, abs=1e-4)
    assert far(weak) < far(exact)
    assert far(foggy) < 0.7 * far(clear)
    assert clear[:, 3].max() <= 1.0
    assert far(advection) <= far(foggy)
    assert not np.array_equal(advection, foggy)


def test_rain_returns_false_points_and_drops_and_dirt_lose_true_ones() -> None:
    clear, rainy, wet, dirty, drops, spray = lidars(
        RAIN, PHYSICAL, IN_AIR, {**PHYSICAL, "lidar_wet_ground": "true"},
        {**PHYSICAL, "lidar_dirt": 0.5}, {**PHYSICAL, "lidar_drops_s": 10.0},
        {**PHYSICAL, "spray": "true"},
    )  # fmt: skip

    def in_the_air(cloud: np.ndarray) -> int:
        """How many points are over the road and nearer than the car ahead."""
        x, y, z = cloud[:, :3].T
        return int(((x > 2.5) & (x < 12.5) & (np.abs(y) < 1.0) & (z > -1.5)).sum())

    assert in_the_air(clear) == 0 < in_the_air(rainy)
    assert in_the_air(spray) > 0
    ground = [int((np.abs(c[:, 2] + 1.9) < 0.3).sum()) for c in (clear, wet)]
    assert ground[1] < 0.8 * ground[0]
    assert len(dirty) < len(clear)
    assert len(drops) < len(clear)
    assert dirty[:, 3].max() < 0.5 * clear[:, 3].max()


# --- cameras


@pytest.mark.parametrize("kind", ["depth", "semantic_segmentation", "instance_segmentation"])
def test_fog_hides_what_is_far_from_depth_and_labels(kind: str) -> None:
    stage = Stage(**DENSE_FOG)
    stage.spawn("vehicle.audi.etron", Pose(70.0, 0.0))
    sight = {"range_model": "physical"}
    told = stage.run(f"sensor.camera.{kind}", SIZE, {**SIZE, **sight}, ticks=2)
    free, limited = (pictures(m)[-1] for m in told)
    assert depth_range(stage.weather) < 60.0
    if kind == "depth":
        depth = [(p[..., 2] + 256 * p[..., 1] + 65536 * p[..., 0]) / (256**3 - 1) * 1000.0
                 for p in (free, limited)]  # fmt: skip
        seen = depth[1] < 999.0
        assert depth[1][seen].max() <= depth_range(stage.weather)
        assert seen.sum() < 0.9 * (depth[0] < 999.0).sum()
        assert np.array_equal(depth[0][seen], depth[1][seen])
    else:
        assert (free[..., 2] == 14).sum() > 10
        assert (limited[..., 2] == 14).sum() == 0


def cameras(
    weather: dict[str, float], *variants: dict[str, Any], kind: str = "rgb", ticks: int = 6
) -> list[list[bytes]]:
    stage = Stage(**weather)
    stage.spawn("vehicle.audi.etron", Pose(14.0, 0.0))
    sensor = f"sensor.camera.{kind}"
    return stage.run(sensor, *({**SIZE, **v} for v in variants), ticks=ticks)


def test_noise_of_the_published_camera_effect() -> None:
    """In rain at night the night's stage is left out when told so; the seed decides the noise."""
    night = {**RAIN, "sun_altitude_deg": -30.0}
    on = {"camera_effect": "true"}
    plain, both, alone, other = (
        pictures(m)[-1, :30, :, :3]
        for m in cameras(night, {}, on, {**on, "night_rain": "rain_only"}, {**on, "noise_seed": 4})
    )
    noise = [np.abs(np.diff(p, axis=1)).mean() for p in (plain, alone, both)]
    assert noise[0] < noise[1] < noise[2]
    assert both.mean() > alone.mean() + 5.0  # the lift of the night's stage
    assert not np.array_equal(both, other)


def test_haze_takes_contrast_from_the_lens_on() -> None:
    """Published pictures let rain begin where fog does."""
    weather = {**RAIN, "fog_density": 1.0, "fog_distance": 60.0}
    plain, hazy = (pictures(m)[-1] for m in cameras(weather, {}, {"camera_haze": "true"}))
    lead = np.s_[60:75, 72:88, :3]
    assert plain[lead].std() > hazy[lead].std()


def test_exposure_is_that_of_a_camera_with_limits() -> None:
    dusk = {"sun_altitude_deg": -6.0}
    told = cameras(dusk, {}, {"camera_exposure": "true"}, ticks=2)
    sky = [pictures(m)[-1, :20, :, :3].mean() for m in told]
    weather = Stage(**dusk).weather
    light = lighting(weather)
    darker = expose(light, weather).horizon.sum() < light.horizon.sum()
    assert (sky[1] < sky[0] - 1.0) if darker else (sky[1] > sky[0] + 1.0)


@pytest.mark.parametrize("name", ["camera_drops", "camera_spray"])
def test_drops_and_spray_come_with_water(name: str) -> None:
    for weather, changed in ((RAIN, True), ({}, False)):
        told = cameras(weather, {}, {name: "true"})
        plain, ours = (pictures(m)[-1] for m in told)
        differs = (plain != ours).any(axis=-1)
        assert differs.mean() > 0.01 if changed else not differs.any()
        if changed and name == "camera_spray":  # a veil of one colour
            assert ours[differs].std() < plain[differs].std()


def test_drops_wait_for_speed_and_follow_their_seed() -> None:
    wet = {"camera_drops": "true"}
    told = cameras(RAIN, {}, wet, wet, {**wet, "noise_seed": 3})
    first = [pictures(m)[0] for m in told]
    assert np.array_equal(first[0], first[1])  # the wiper has just passed
    _, ours, same, other = (pictures(m)[-1] for m in told)
    assert np.array_equal(ours, same)
    assert not np.array_equal(ours, other)


@pytest.mark.parametrize(
    ("name", "fewer"), [("camera_haze", True), ("camera_drops", False), ("camera_spray", None)]
)
def test_effects_on_events(name: str, fewer: bool | None) -> None:
    """Haze hides edges that move, drops that fall are edges; by the clouds' place spray does either."""
    weather = {**RAIN, "fog_density": 1.0, "fog_distance": 60.0}
    low = {"positive_threshold": 0.05, "negative_threshold": 0.05}
    on = {**low, name: "true"}
    plain, ours, other = cameras(weather, low, on, {**on, "noise_seed": 3}, kind="dvs")
    assert (ours != other) is (name == "camera_drops")
    events = [sum(len(m) - IMAGE_HEAD for m in told) // 13 for told in (plain, ours)]
    if fewer is None:
        assert plain != ours
    else:
        assert (events[1] < events[0]) is fewer
        assert events[0] != events[1]


def test_effects_of_one_sensor_leave_others_alone() -> None:
    """A camera beside one with every effect sends what it sends alone."""
    every = {
        n: "true" for n in load_acting().additions["sensor.camera.rgb"] if n.startswith("camera_")
    }
    (alone,) = cameras(RAIN, {}, ticks=3)
    beside, _ = cameras(RAIN, {}, every, ticks=3)
    assert alone == beside


def test_the_unmodified_client_sets_them(serve: Callable[..., Any]) -> None:
    serve().client(
        STAGE
        + """
told = library.find("sensor.other.radar")
output = told.get_attribute("radar_output")
assert output.type == carla.ActorAttributeType.String and output.is_modifiable
assert list(output.recommended_values) == ["points", "detections", "tracks"]
assert output.as_str() == "points"
assert told.get_attribute("radar_interference").type == carla.ActorAttributeType.Float
assert told.get_attribute("radar_multipath").type == carla.ActorAttributeType.Bool
assert not told.get_attribute("radar_multipath").as_bool()
for name, value in (("radar_interference", 2), ("lidar_dirt", 1)):
    try:
        listen("sensor.other.radar" if "radar" in name else "sensor.lidar.ray_cast", **{name: value})
        raise SystemExit("a wrong value was accepted")
    except RuntimeError as error:
        assert name + " must be a number between 0 and" in str(error), error
front = carla.Transform(carla.Location(x=2.6, z=0.6))
radar = listen("sensor.other.radar", front, radar_model="physical", radar_output="detections")
above = carla.Transform(carla.Location(z=2.2))
size = dict(range=60, points_per_second=100000, rotation_frequency=20)
lidar = listen("sensor.lidar.ray_cast", above, lidar_model="physical", range_model="physical", **size)
small = dict(image_size_x=160, image_size_y=120)
plain = listen("sensor.camera.rgb", above, **small)
noisy = listen("sensor.camera.rgb", above, camera_effect=True, **small)
client.set_timeout(600.0)  # kernels may have to be compiled
frame = tick(2)
assert bytes(at(plain, frame).raw_data) == bytes(at(noisy, frame).raw_data)
clear = len(at(lidar, frame))
found = at(radar, frame)
near = seen_from(found.transform, lead)[0] - lead.bounding_box.extent.x
assert any(abs(d.depth - near) < 1.5 for d in found), ([d.depth for d in found], near)
world.set_weather(carla.WeatherParameters(
    sun_altitude_angle=60, precipitation=100, fog_density=80, wetness=100))
frame = tick(2)
assert bytes(at(plain, frame).raw_data) != bytes(at(noisy, frame).raw_data)
assert len(at(lidar, frame)) < clear
"""
    )
