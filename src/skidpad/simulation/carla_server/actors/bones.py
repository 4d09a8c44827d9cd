"""A walker's skeleton: names and tree as CARLA documents them, with proportions that are assumed.

Walkers stand still in their animation; a pose that a client sets is blended in. Bones are told to
clients and drawn nowhere: a walker's picture is its box.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from skidpad.core.geometry import Pose
from skidpad.simulation.carla_server.protocol import wire

ROOT = "crl_root"
FINGERS = ("Thumb", "Index", "Middle", "Ring", "Pinky")
KNUCKLE, PHALANX = 0.05, 0.02  # shares of the height: palm and each of the three phalanges
# Parent and place from there, in shares of the walker's height: forward, left, up. Assumed, in the
# range of common tables of body segments; names and tree as in CARLA's tutorial on walkers' skeletons.
TRUNK = {
    "crl_hips__C": (ROOT, 0.0, 0.0, 0.53),
    "crl_spine__C": ("crl_hips__C", 0.0, 0.0, 0.07),
    "crl_spine01__C": ("crl_spine__C", 0.0, 0.0, 0.10),
    "crl_neck__C": ("crl_spine01__C", 0.0, 0.0, 0.15),
    "crl_Head__C": ("crl_neck__C", 0.0, 0.0, 0.05),
}
SIDE = {  # of the left; the right mirrors it
    "crl_shoulder": ("crl_spine01__C", 0.0, 0.05, 0.11),
    "crl_arm": ("crl_shoulder", 0.0, 0.08, 0.0),
    "crl_foreArm": ("crl_arm", 0.0, 0.0, -0.19),
    "crl_hand": ("crl_foreArm", 0.0, 0.0, -0.145),
    "crl_eye": ("crl_Head__C", 0.05, 0.018, 0.035),
    "crl_thigh": ("crl_hips__C", 0.0, 0.05, -0.02),
    "crl_leg": ("crl_thigh", 0.0, 0.0, -0.225),
    "crl_foot": ("crl_leg", 0.0, 0.0, -0.245),
    "crl_toe": ("crl_foot", 0.08, 0.0, -0.03),
    "crl_toeEnd": ("crl_toe", 0.04, 0.0, 0.0),
}
Place = tuple[float, float, float]


def _skeleton() -> Iterator[tuple[str, str, Place]]:
    """Yields name, parent and place of every bone below the root, parents first.

    Places from the parent, in shares of the walker's height: forward, left, up.
    """
    for name, (parent, *place) in TRUNK.items():
        yield name, parent, (place[0], place[1], place[2])
    for side, sign in (("__L", 1.0), ("__R", -1.0)):
        for name, (parent, x, y, z) in SIDE.items():
            above = parent if parent.endswith("__C") else parent + side
            yield _bone_name(name, side), _bone_name(above, ""), (x, sign * y, z)
        for number, finger in enumerate(FINGERS):
            above = f"crl_hand{side}"
            for part in ("", "01", "02", "End"):
                name = f"crl_hand{finger}{part}{side}"
                if part == "" and finger in ("Middle", "Ring", "Pinky"):
                    name = name.replace("__", "_")  # as CARLA's own skeleton has it
                down = -KNUCKLE if part == "" else -PHALANX
                yield name, above, (0.02 - 0.01 * number if part == "" else 0.0, 0.0, down)
                above = name


def _bone_name(name: str, side: str) -> str:
    """Returns the bone's name on a side; the left shoulder has a name of its own in CARLA."""
    return (name + side).replace("crl_shoulder__L", "ctrl_shoulder__L")


SKELETON = tuple(_skeleton())
NAMES = frozenset((ROOT, *(name for name, _, _ in SKELETON)))


@dataclass(slots=True)
class Skeleton:
    """Holds the bones of one walker that a client has moved."""

    pose: dict[str, Pose] = field(default_factory=dict)  # set by clients, seen from the parents
    blend: float = 0.0  # share of that pose

    def set_bones(self, bones: Mapping[str, Pose]) -> None:
        """Sets the bones named here; names that no walker has change nothing."""
        self.pose |= {name: pose for name, pose in bones.items() if name in NAMES}

    def take(self) -> None:
        """Drops the bones that clients have set, so that all rest at the animation's pose again."""
        self.pose = {}

    def list_transforms(self, actor: Pose, height: float) -> list[list[Any]]:
        """Returns `BoneTransformDataOut` of all bones: name, in the world, in the walker, from the parent.

        actor: the walker's middle. height: m.
        """
        feet = Pose(0.0, 0.0, -height / 2.0)
        inside = {ROOT: self._blend_poses(ROOT, Pose(0.0, 0.0))}
        rows = [_row(ROOT, actor @ feet @ inside[ROOT], inside[ROOT], inside[ROOT])]
        for name, parent, place in SKELETON:
            x, y, z = (height * v for v in place)
            own = self._blend_poses(name, Pose(x, y, z))
            inside[name] = inside[parent] @ own
            rows.append(_row(name, actor @ feet @ inside[name], inside[name], own))
        return rows

    def _blend_poses(self, name: str, rest: Pose) -> Pose:
        """Returns the pose of a bone between rest and the client's pose, by the share `blend` in 0..1."""
        told = self.pose.get(name)
        if told is None or self.blend == 0.0:
            return rest
        share = self.blend
        pairs = zip(_numbers(rest), _numbers(told), strict=True)
        return Pose(*(a + share * (b - a) for a, b in pairs))


def _numbers(pose: Pose) -> tuple[float, ...]:
    """Returns x, y, z in m and roll, pitch, yaw in rad of a pose."""
    return pose.x, pose.y, pose.z, pose.roll, pose.pitch, pose.yaw


def _row(name: str, world: Pose, component: Pose, relative: Pose) -> list[Any]:
    """Returns a bone's row on the wire: name and its poses in world, component and parent frame."""
    return [name, wire.transform(world), wire.transform(component), wire.transform(relative)]


def parse_bones(value: Any) -> dict[str, Pose]:
    """Returns poses by bone name of a call's WalkerBoneControlIn, seen from the parent bones.

    WireError for another shape.
    """
    found = {}
    for bone in wire.items(wire.items(value, "bones", 1)[0], "bone_transforms"):
        name, place = wire.items(bone, "bone", 2)
        found[wire.text(name, "bone name")] = wire.pose(place, "bone")
    return found
