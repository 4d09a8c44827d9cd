"""The colour of a light from the front image, on drawn lamps."""

from __future__ import annotations

import colorsys

import cv2
import numpy as np
import pytest

from skidpad.core.frames import CameraImage
from skidpad.stack.adas import AdasStack
from skidpad.stack.perception.hsv import detect_lamp
from support.stackfakes import GREEN, RED, SPECS, YELLOW, ArcMap, ego_at, frame

SKY = (96, 110, 120)


def lamp_seen(rgb):
    """The colour seen in an (H, W, 3) image."""
    return detect_lamp(None if rgb is None else CameraImage(rgb=rgb))


def rgb_of(hue, saturation=255, value=255):
    """Red, green, blue of OpenCV's hue (half degrees), saturation and value, by the standard library."""
    colour = colorsys.hsv_to_rgb(hue / 180.0, saturation / 255.0, value / 255.0)
    return tuple(round(255 * c) for c in colour)


def picture(*boxes, height=600, width=800, background=SKY):
    """Boxes (column, row, width, height, colour) before a dull sky."""
    image = np.full((height, width, 3), background, np.uint8)
    for u, row, w, h, colour in boxes:
        image[row : row + h, u : u + w] = colour
    return image


def lamp(colour, w=10, h=12, row=100):
    return picture((300, row, w, h, colour))


@pytest.mark.req("A-167")
def test_red_is_asked_before_yellow_and_nothing_is_none():
    red, yellow, green = rgb_of(0), rgb_of(28), rgb_of(60)
    assert lamp_seen(lamp(red)) is RED
    assert lamp_seen(lamp(yellow)) is YELLOW
    both = picture((100, 50, 10, 12, yellow), (400, 200, 10, 12, red))
    assert lamp_seen(both) is RED
    assert lamp_seen(lamp(green)) is None
    assert lamp_seen(picture()) is None
    assert lamp_seen(None) is None
    assert detect_lamp(CameraImage()) is None


@pytest.mark.req("A-165")
@pytest.mark.parametrize(
    ("hue", "found"),
    [
        (0, RED), (9, RED), (12, None), (18, None), (21, YELLOW), (34, YELLOW), (37, None),
        (60, None), (120, None), (168, None), (171, RED), (179, RED),
    ],
)  # fmt: skip
def test_hues(hue, found):
    assert lamp_seen(lamp(rgb_of(hue))) is found


@pytest.mark.req("A-165")
@pytest.mark.parametrize("hue", [0, 28])
def test_pale_and_dark_spots_are_no_lamps(hue):
    found = {0: RED, 28: YELLOW}[hue]
    assert lamp_seen(lamp(rgb_of(hue, saturation=84))) is found
    assert lamp_seen(lamp(rgb_of(hue, saturation=76))) is None
    assert lamp_seen(lamp(rgb_of(hue, value=84))) is found
    assert lamp_seen(lamp(rgb_of(hue, value=76))) is None


@pytest.mark.req("A-164")
def test_only_the_upper_60_percent_count():
    red = rgb_of(0)
    assert lamp_seen(lamp(red, row=345)) is RED
    assert lamp_seen(lamp(red, row=360)) is None


@pytest.mark.req("A-166")
@pytest.mark.parametrize(
    ("w", "h", "counts"),
    [
        (3, 3, True),  # a contour runs through pixel centres: 2 x 2 = 4 px
        (2, 3, False),  # 1 x 2 = 2 px
        (2, 4, True),  # 1 x 3 = 3 px
        (32, 33, True),  # 31 x 32 = 992 px
        (33, 33, False),  # 32 x 32 = 1024 px
        (20, 10, True), (21, 10, False), (6, 20, True), (5, 20, False), (7, 25, False),
    ],
)  # fmt: skip
def test_area_and_aspect(w, h, counts):
    assert (lamp_seen(lamp(rgb_of(0), w, h)) is RED) is counts


def sun(radius):
    """A low red sun in the upper image."""
    image = picture(background=(90, 95, 120))
    cv2.circle(image, (500, 150), radius, rgb_of(6, 220, 255), -1)
    return image


@pytest.mark.req("A-171")
def test_a_large_sun_does_not_trigger_and_only_its_size_tells():
    assert lamp_seen(sun(40)) is None
    assert lamp_seen(sun(19)) is None  # pi 19^2 = 1134 px
    assert lamp_seen(sun(17)) is RED  # 908 px: a small sun would (D-068)


@pytest.mark.req("A-168")
def test_agreement_is_recorded_while_the_map_reports_a_light():
    map = ArcMap(lights=((7, 0, 300.0),))
    red, yellow = lamp(rgb_of(0)), lamp(rgb_of(28))

    def report(x, rgb, settings=None, state=RED):
        stack = AdasStack(SPECS, map, {"configuration": 4, "set": settings or {}})
        stack.tick(frame(0, (), ego_at(x, v=10.0), rgb=rgb, lights={7: state}))
        return stack.report

    assert report(260.0, red).hsv is RED
    assert report(260.0, yellow).hsv is YELLOW
    assert report(260.0, yellow).light_stop, "the map alone decides (D-071)"
    assert report(260.0, None).hsv is None
    assert report(100.0, red).hsv is None, "no light in range, no evaluation"
    assert not report(100.0, red).light_stop
    required = {"hsv_required": True}
    assert report(260.0, red, required).light_stop
    assert not report(260.0, yellow, required).light_stop
    assert not report(260.0, red, required, state=GREEN).light_stop
