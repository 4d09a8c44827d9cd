"""Which blueprint attributes act; all others are accepted without effect (decision X-15)."""

from __future__ import annotations

import logging

from skidpad.simulation.carla_server.catalogue import Blueprint, Family
from skidpad.simulation.carla_server.sensing.sensors import PRODUCERS

log = logging.getLogger("skidpad.carla_server")

ALWAYS = {"role_name", "sensor_tick"}
CAMERA = {"fov", "image_size_x", "image_size_y"}
LIDAR = {
    "channels",
    "range",
    "points_per_second",
    "rotation_frequency",
    "upper_fov",
    "lower_fov",
    "horizontal_fov",
}
BY_SENSOR: dict[str, set[str]] = {
    "sensor.camera.rgb": CAMERA,
    "sensor.camera.depth": CAMERA,
    "sensor.camera.semantic_segmentation": CAMERA,
    "sensor.camera.instance_segmentation": CAMERA,
    "sensor.lidar.ray_cast": LIDAR
    | {
        "atmosphere_attenuation_rate",
        "noise_seed",
        "dropoff_general_rate",
        "dropoff_intensity_limit",
        "dropoff_zero_intensity",
        "noise_stddev",
    },
    "sensor.lidar.ray_cast_semantic": LIDAR,
    "sensor.other.radar": {
        "horizontal_fov",
        "vertical_fov",
        "range",
        "points_per_second",
        "noise_seed",
    },
    "sensor.other.obstacle": {"distance", "hit_radius", "only_dynamics"},
}
NOISY = ("sensor.other.imu", "sensor.other.gnss")  # every attribute named noise_* acts
BY_FAMILY: dict[Family, set[str]] = {
    Family.VEHICLE: {"color"},
    Family.TRIGGER: {"friction", "extent_x", "extent_y", "extent_z"},
    Family.GRIP: {"ice_thickness"},
}
IN_THE_CLIENT = "sensor.other.lane_invasion"  # computed there from map and snapshots


def acting(blueprint: Blueprint) -> set[str]:
    """Ids of the attributes that change something."""
    names = {a.id for a in blueprint.attributes.values() if a.id.startswith("noise_")}
    own = names if blueprint.id in NOISY else BY_SENSOR.get(blueprint.id, set())
    if blueprint.family is Family.SENSOR and not produced(blueprint.id):
        return {"role_name"}
    return {
        a.id
        for a in blueprint.attributes.values()
        if a.id in ALWAYS | own | BY_FAMILY.get(blueprint.family, set()) or not a.modifiable
    }


def produced(sensor: str) -> bool:
    """Whether a sensor of this kind sends anything."""
    return sensor in PRODUCERS or sensor == IN_THE_CLIENT


class Remarks:
    """Says once for each attribute that a client sets in vain."""

    def __init__(self) -> None:
        self.made: set[tuple[str, str]] = set()

    def remark(self, blueprint: Blueprint, given: dict[str, str]) -> None:
        """given: what a client sent; defaults say nothing."""
        known = acting(blueprint)
        for name, value in given.items():
            attribute = blueprint.attributes.get(name)
            if attribute is None or name in known or value == attribute.recommended[0]:
                continue
            self._once(blueprint.id, f"attribute {name}")
        if blueprint.family is Family.SENSOR and not produced(blueprint.id):
            self._once(blueprint.id, "the sensor, which sends nothing,")

    def _once(self, id: str, what: str) -> None:
        if (id, what) not in self.made:
            self.made.add((id, what))
            log.info("%s: %s is accepted without effect", id, what)
