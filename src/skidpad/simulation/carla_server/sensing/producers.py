"""The kinds of sensors that send something, by blueprint."""

from __future__ import annotations

from skidpad.simulation.carla_server.sensing import (
    events,
    events_camera,
    flow,
    gbuffers,
    images,
    inertial,
    normals,
    points,
    v2x,
)
from skidpad.simulation.carla_server.sensing.sensor import Producer
from skidpad.simulation.carla_server.snapshot import SensorType

PRODUCERS = {
    "sensor.camera.rgb": Producer(
        SensorType.RGB,
        gbuffers.colour_image,
        gbuffers.make_colour_camera,
        textures=gbuffers.textures,
        shares=images.view_of,
    ),
    "sensor.camera.depth": Producer(
        SensorType.DEPTH, images.image, images.make_camera, shares=images.view_of
    ),
    "sensor.camera.semantic_segmentation": Producer(
        SensorType.SEMANTIC, images.image, images.make_camera, shares=images.view_of
    ),
    "sensor.camera.instance_segmentation": Producer(
        SensorType.INSTANCE, images.image, images.make_camera, shares=images.view_of
    ),
    "sensor.camera.optical_flow": Producer(
        SensorType.OPTICAL_FLOW, flow.optical_flow, flow.make_flow_camera, shares=images.view_of
    ),
    "sensor.camera.normals": Producer(
        SensorType.NORMALS, normals.normals, images.make_camera, shares=images.view_of
    ),
    "sensor.camera.dvs": Producer(
        SensorType.DVS,
        events_camera.dynamic_vision,
        events_camera.make_retina,
        shares=images.view_of,
    ),
    "sensor.other.radar": Producer(
        SensorType.RADAR, points.radar, points.make_radar, shares=points.alone
    ),
    "sensor.lidar.ray_cast": Producer(
        SensorType.LIDAR, points.plain_lidar, points.make_lidar, shares=points.alone
    ),
    "sensor.lidar.ray_cast_semantic": Producer(
        SensorType.SEMANTIC_LIDAR, points.semantic_lidar, points.make_lidar, shares=points.alone
    ),
    "sensor.other.imu": Producer(SensorType.IMU, inertial.imu),
    "sensor.other.gnss": Producer(SensorType.GNSS, inertial.gnss),
    "sensor.other.collision": Producer(SensorType.COLLISION, events.collision),
    "sensor.other.obstacle": Producer(SensorType.OBSTACLE, events.obstacle),
    "sensor.other.v2x": Producer(SensorType.AWARENESS, v2x.receive, v2x.make_station, v2x.announce),
    "sensor.other.v2x_custom": Producer(
        SensorType.CUSTOM_V2X, v2x.receive, v2x.make_messenger, v2x.pass_on
    ),
}
