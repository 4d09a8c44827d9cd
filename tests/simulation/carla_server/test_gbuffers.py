"""G-buffers: what each texture says of a scene that is known, and that the real client gets them."""

from __future__ import annotations

import numpy as np
import pytest

from skidpad.core.geometry import Pose
from skidpad.sensors.raster.view import View
from skidpad.simulation.carla_server.actors.registry import Attachment
from skidpad.simulation.carla_server.episode import Wanted
from skidpad.simulation.carla_server.methods import episode as methods
from skidpad.simulation.carla_server.options import ServerOptions
from skidpad.simulation.carla_server.protocol.rpc import CallError
from skidpad.simulation.carla_server.sensing.gbuffers import FARTHEST, Texture
from skidpad.simulation.carla_server.sensing.normals import camera_normals
from skidpad.simulation.carla_server.sensing.occlusion import RADIUS, ambient_occlusion
from skidpad.simulation.carla_server.served import Served
from skidpad.simulation.carla_server.snapshot import SensorType
from skidpad.simulation.carla_server.weather import PACKED
from support.carla_streams import Kept

WIDTH, HEIGHT, EYE = 64, 48, 1.6
ROAD = 1  # tag
BLANK = (
    Texture.SCENE_STENCIL,
    Texture.SHADING_DATA,
    Texture.SHADOW_FACTORS,
    Texture.TANGENT,
)


@pytest.fixture
def scene():
    """A camera on the straight road behind a red car; the world, and what it is told."""
    hub = Kept()
    served = Served(ServerOptions(map="straight"), hub)
    world = served.episode
    start = world.map.spawn_points[0]
    carrier = world.spawn(Wanted("vehicle.tesla.model3", {}), start)
    ahead = start @ Pose(12.0, 0.0)
    lead = world.spawn(Wanted("vehicle.audi.tt", {"color": "200,20,20"}), ahead)
    size = {"image_size_x": str(WIDTH), "image_size_y": str(HEIGHT)}
    camera = world.attach(
        Wanted("sensor.camera.rgb", size), Pose(2.4, 0.0, EYE), carrier.id, Attachment.RIGID
    )
    return served, hub, camera, lead


def pictures(scene, ticks=1):
    served, hub, camera, _ = scene
    methods.enable_gbuffers(served, camera.id, True)
    for texture in Texture:
        methods.get_gbuffer_token(served, camera.id, texture)
    for _ in range(ticks):
        served.tick()
    streams = served.episode.sensors.of(camera.id).textures
    return {t: newest(hub.told[streams[t]]) for t in Texture}


def newest(told):
    message = told[-1]
    assert int.from_bytes(message[:8], "little") == SensorType.GBUFFER
    assert np.frombuffer(message[48:56], "<u4").tolist() == [WIDTH, HEIGHT]
    return np.frombuffer(message[60:], np.uint8).reshape(HEIGHT, WIDTH, 4)


def test_each_texture_shows_what_its_documentation_says(scene):
    shown = pictures(scene)
    labels = shown[Texture.CUSTOM_STENCIL][..., 2]
    road = (HEIGHT - 2, WIDTH // 2)
    car = (HEIGHT // 2 + 2, WIDTH // 2)
    assert labels[road] == ROAD
    assert labels[car] not in (ROAD, 0)
    for blank in BLANK:
        assert not shown[blank][..., :3].any()
    up = shown[Texture.NORMAL][road][2::-1].astype(int)
    assert np.abs(up - (128, 128, 255)).max() <= 2
    painted = (shown[Texture.BASE_COLOUR][..., 2::-1] == (200, 20, 20)).all(axis=-1)
    assert painted.sum() > 20  # without any light
    assert set(labels[painted]) == {labels[car]}
    assert shown[Texture.MATERIAL][road].tolist()[3] == 1  # lit
    assert shown[Texture.MATERIAL][0, 0].tolist() == [0, 0, 0, 0]  # the sky is not
    assert (
        shown[Texture.MATERIAL][road][0] > shown[Texture.MATERIAL][painted][:, 0].max()
    )  # rougher
    assert np.array_equal(shown[Texture.SCENE_DEPTH], shown[Texture.CUSTOM_DEPTH])
    assert shown[Texture.SCENE_DEPTH][0, 0].tolist() == [255, 255, 255, 255]


def test_depth_is_linear_after_srgb(scene):
    """The road's planar depth from its row of the picture: eye height times focal length, by rows."""
    grey = pictures(scene)[Texture.SCENE_DEPTH][..., 0]
    focal = WIDTH / 2.0  # 90 deg
    for row in (HEIGHT - 2, HEIGHT - 8):
        depth = EYE * focal / (row + 0.5 - HEIGHT / 2.0)
        encoded = grey[row, 3] / 255.0
        linear = ((encoded + 0.055) / 1.055) ** 2.4
        assert linear * FARTHEST == pytest.approx(depth, rel=0.1)


def test_velocity_is_of_actors_that_move(scene):
    served, _, _, lead = scene
    yaw = served.episode.map.spawn_points[0].yaw
    left = (-6.0 * np.sin(yaw), 6.0 * np.cos(yaw), 0.0)
    served.episode.vehicles.set_velocity(lead.id, left)
    shown = pictures(scene, ticks=3)
    moving = shown[Texture.VELOCITY]
    others = shown[Texture.CUSTOM_STENCIL][..., 2] == ROAD
    assert not moving[others][:, :3].any()
    car = moving[HEIGHT // 2 + 2][:, 2]
    assert 0 < car[car > 0].max() < 127  # to the left: below the middle of the scale


def test_a_corner_is_darker_than_the_open_floor():
    """A floor that ends at a wall: the light falls off towards the corner, within the radius."""
    focal, wall = 120.0, 5.0
    rows = (np.arange(160) + 0.5 - 80.0) / focal
    inverse = np.maximum(rows / EYE, 1.0 / wall)[:, None].repeat(160, axis=1).astype(np.float32)
    view = View(160, 160, focal, 80.0, 80.0, np.eye(3), np.zeros(3))
    shade = np.empty(inverse.shape, dtype=np.uint8)
    ambient_occlusion(view, inverse, camera_normals(view, inverse), shade)
    column = shade[:, 80].astype(int)
    corner = int(80 + focal * EYE / wall)
    assert column[20] == 255  # high up the wall
    far = int(80 + focal * EYE / (wall - RADIUS)) + 2
    assert column[far:].tolist() == [255] * len(column[far:])
    assert column[corner - 1 : corner + 2].min() == pytest.approx(0.75 * 255.0, abs=25)
    assert (np.diff(column[corner + 1 : far]) >= -2).all()


def test_wet_roads_are_smoother(scene):
    served = scene[0]
    dry = pictures(scene)[Texture.MATERIAL][HEIGHT - 2, WIDTH // 2][0]
    sky = served.episode.sky
    weather = sky.pack()
    weather[PACKED.index("wetness")] = 100.0
    sky.apply(weather)
    assert pictures(scene)[Texture.MATERIAL][HEIGHT - 2, WIDTH // 2][0] < dry / 2


def test_nothing_is_sent_before_they_are_enabled_nor_after_the_camera_is_gone(scene):
    served, hub, camera, lead = scene
    methods.get_gbuffer_token(served, camera.id, Texture.NORMAL)
    stream = served.episode.sensors.of(camera.id).textures[Texture.NORMAL]
    served.tick()
    assert not hub.told.get(stream)
    assert not methods.are_gbuffers_enabled(served, camera.id)
    methods.enable_gbuffers(served, camera.id, True)
    served.tick()
    assert len(hub.told[stream]) == 1
    assert methods.get_gbuffer_token(served, camera.id, Texture.NORMAL) == hub.token(stream)
    served.episode.destroy(camera.id)
    assert not hub.exists(stream)
    with pytest.raises(CallError, match=f"actor {lead.id}"):
        methods.get_gbuffer_token(served, lead.id, Texture.NORMAL)


def test_other_cameras_have_none(scene):
    served, _, _, lead = scene
    depth = served.episode.attach(
        Wanted("sensor.camera.depth", {}), Pose(0.0, 0.0), lead.id, Attachment.RIGID
    )
    with pytest.raises(CallError, match=r"no sensor\.camera\.rgb"):
        methods.enable_gbuffers(served, depth.id, True)


def test_the_real_client_gets_all_of_them_in_each_tick(serve):
    """As CARLA's tutorial_gbuffer.py and CARLA2Real ask for them: all at once, in each tick."""
    said = serve("--map", "straight").client(
        """
        import numpy as np
        synchronous()
        library = world.get_blueprint_library()
        ego = world.spawn_actor(library.find("vehicle.tesla.model3"), world.get_map().get_spawn_points()[0])
        blueprint = library.find("sensor.camera.rgb")
        blueprint.set_attribute("image_size_x", "160")
        blueprint.set_attribute("image_size_y", "90")
        camera = world.spawn_actor(blueprint, carla.Transform(carla.Location(x=1.5, z=2.4)), attach_to=ego)
        camera.enable_gbuffers(True)
        names = carla.GBufferTextureID.names
        queues = {name: queue.Queue() for name in names}
        for name, texture in names.items():
            camera.listen_to_gbuffer(texture, queues[name].put)
            assert camera.is_listening_gbuffer(texture)
        for k in range(5):
            frame = world.tick()
            for name in names:
                image = queues[name].get(timeout=20.0)
                assert (image.width, image.height, round(image.fov)) == (160, 90, 90), name
                assert k == 0 or image.frame == frame, name
        camera.stop_gbuffer(carla.GBufferTextureID.SSAO)
        for _ in range(3):
            began = time.monotonic()
            world.tick()
        assert time.monotonic() - began < 3.0  # no tick waits for a stream that has ended
        print("ALL", len(names))
        """
    )
    assert "ALL 13" in said
