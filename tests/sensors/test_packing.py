"""Pixels in words of 32 bits, blocks of them, and the calm camera effect, each by a second route."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from skidpad.core.geometry import Pose
from skidpad.core.specs import CameraSpec, Modality
from skidpad.sensors.pictures.blocks import BLOCK, COLUMNS, LANES, gather
from skidpad.sensors.pictures.degradation import CameraNoise, Degradation
from skidpad.sensors.pictures.headlamps import behind_lamps
from skidpad.sensors.pictures.packing import pack, rounded, unpack
from skidpad.sensors.raster.view import camera_view
from skidpad.sensors.scene.materials import MATERIALS

BYTES = st.tuples(*[st.integers(0, 255)] * 3)


@given(BYTES)
def test_a_pixel_is_what_it_was_packed_from(colour):
    packed = pack(*(np.float32(c) for c in colour))
    assert list(np.array([packed], dtype="<u4").view(np.uint8)) == [*colour, 255]
    assert unpack(packed) == colour


@given(st.floats(-1000.0, 1000.0, width=32))
def test_a_value_is_rounded_into_a_byte(value):
    assert int(rounded(np.float32(value))) == min(max(np.floor(np.float32(value + 0.5)), 0), 255)


@given(st.lists(st.tuples(st.integers(0, 3), st.integers(1, 90)), min_size=1, max_size=40))
def test_a_block_has_the_table_row_of_every_key(runs):
    keys = np.concatenate([np.full(n, (who << 16) | (who + 7), np.int32) for who, n in runs])[
        :BLOCK
    ]
    table = np.arange(4 * MATERIALS * COLUMNS, dtype=np.float32).reshape(-1, COLUMNS)
    work = np.zeros(LANES * BLOCK, dtype=np.float32)
    gather(keys[None], 0, 0, keys.size, table, work)
    lanes = work.reshape(LANES, BLOCK)[:COLUMNS, : keys.size]
    assert np.array_equal(lanes, table[(keys >> 16) * MATERIALS + (keys & 255)].T)


@given(st.floats(-np.pi, np.pi), st.floats(-4.0, 4.0), st.integers(0, 299), st.integers(0, 7))
def test_what_is_said_to_lie_behind_the_lamps_does(yaw, x, row, block):
    spec = CameraSpec("c", Modality.RGB, 400, 300, 75.0, Pose(x, 0.0, 1.0, yaw=yaw), True)
    view = camera_view(spec, Pose(0.0, 0.0))
    to_body = np.ascontiguousarray(view.rotation.T, dtype=np.float32)
    v = np.float32((row + 0.5 - view.cy) / view.focal)
    said = behind_lamps(view, v, 50 * block, 50, to_body, np.float32(x - 1.75))
    u = (50 * block + np.arange(50) + 0.5 - view.cx) / view.focal
    ahead = to_body[0, 0] * u + to_body[0, 1] * v + to_body[0, 2]
    if said:
        assert (ahead < 0.0).all()
        assert x < 1.75
    elif x < 1.7:
        assert ahead.max() > -0.05


def test_a_calm_effect_is_a_share_of_the_published_one():
    flat = np.full((200, 300), 0xFF000000 | 90 << 16 | 140 << 8 | 60, dtype=np.uint32)
    found = []
    for share in (1.0, 0.999):
        strength = Degradation(15.0, 0.5, night=True, streaks=0.0, share=share, glass=False)
        image = flat.copy()
        CameraNoise("front", 1, strength).apply(5, image)
        found.append(image.view(np.uint8).reshape(200, 300, 4)[..., :3].astype(float))
    loud, calm = found
    assert np.abs(loud.mean(axis=(0, 1)) - calm.mean(axis=(0, 1))).max() < 0.5
    # rain's noise is mixed over the colours before it is damped, so that one colour has less of it
    spread = loud.std(axis=(0, 1)) / calm.std(axis=(0, 1))
    assert (spread > 0.8).all()
    assert (spread < 1.1).all()
