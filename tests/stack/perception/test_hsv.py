"""Lamps in the front image, against OpenCV asked about every pixel."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from skidpad.core.frames import CameraImage, pack
from skidpad.core.vocabulary import LightState
from skidpad.stack.perception.hsv import (
    AREAS,
    ASPECTS,
    MIN_SATURATION,
    MIN_VALUE,
    RED_HUES,
    YELLOW_HUES,
    colourful,
    detect_lamp,
)

RED, YELLOW, GREEN = (230, 30, 30), (235, 190, 20), (30, 220, 60)


def plain_opencv(rgb):
    """The published procedure word for word, without shortcuts."""
    hsv = cv2.cvtColor(np.ascontiguousarray(rgb[: round(len(rgb) * 0.6)]), cv2.COLOR_RGB2HSV)
    for state, hues in ((LightState.RED, RED_HUES), (LightState.YELLOW, YELLOW_HUES)):
        contours, _ = cv2.findContours(in_hues(hsv, hues), cv2.RETR_EXTERNAL,
                                       cv2.CHAIN_APPROX_SIMPLE)  # fmt: skip
        for contour in contours:
            _, _, w, h = cv2.boundingRect(contour)
            inside = AREAS[0] <= cv2.contourArea(contour) <= AREAS[1]
            if inside and ASPECTS[0] <= w / h <= ASPECTS[1]:
                return state
    return None


def in_hues(hsv, hues):
    mask = np.zeros(hsv.shape[:2], np.uint8)
    for low, high in hues:
        mask |= cv2.inRange(hsv, (low, MIN_SATURATION, MIN_VALUE), (high, 255, 255))
    return mask


def picture(colour, size=(6, 6), at=(20, 30)):
    rgb = np.full((100, 100, 3), 90, np.uint8)
    rgb[at[0] : at[0] + size[0], at[1] : at[1] + size[1]] = colour
    return rgb


@pytest.mark.req("A-164", "A-165", "A-166", "A-167")
@pytest.mark.parametrize(
    ("rgb", "state"),
    [
        (picture(RED), LightState.RED),
        (picture(YELLOW), LightState.YELLOW),
        (picture(GREEN), None),
        (picture(RED, at=(60, 30)), None),  # below the upper 60 %
        (picture(RED, size=(2, 3)), None),  # area 2
        (picture(RED, size=(40, 40)), None),  # area above 1000
        (picture(RED, size=(3, 20)), None),  # too wide
        (picture(RED, size=(30, 5)), None),  # too slim
    ],
)
def test_lamp_by_colour_place_and_shape(rgb, state):
    assert detect_lamp(CameraImage(rgb=rgb)) is state
    assert detect_lamp(CameraImage(rgb=rgb, packed=pack(rgb))) is state
    assert plain_opencv(rgb) is state


@pytest.mark.req("A-164")
def test_no_image_is_no_lamp():
    assert detect_lamp(None) is None
    assert detect_lamp(CameraImage(labels=np.zeros((4, 4), np.uint8))) is None


@pytest.mark.req("A-165")
def test_opencv_is_asked_about_every_colour_in_the_hue_ranges():
    red, green = np.meshgrid(np.arange(256), np.arange(256), indexing="ij")
    for blue in range(256):
        rgb = np.stack([red, green, np.full_like(red, blue)], axis=-1).astype(np.uint8)
        wanted = in_hues(cv2.cvtColor(rgb, cv2.COLOR_RGB2HSV), RED_HUES + YELLOW_HUES) != 0
        asked = np.zeros(wanted.size, bool)
        asked[colourful(pack(rgb))[0]] = True
        assert asked[wanted.ravel()].all(), f"blue {blue}"


@pytest.mark.req("A-166")
@pytest.mark.parametrize("seed", range(40))
def test_answers_as_opencv_on_noise_and_patches(seed):
    rng = np.random.default_rng(seed)
    coarse = rng.integers(0, 256, (30 // (seed % 3 + 1), 40, 3), dtype=np.uint8)
    coarse = coarse // 96 * 96 if seed % 2 else coarse
    rgb = np.repeat(np.repeat(coarse, seed % 3 + 1, axis=0), seed % 4 + 1, axis=1)
    grey = rng.random(rgb.shape[:2]) < 0.9  # leaves room between patches
    rgb[grey] = 100
    assert detect_lamp(CameraImage(rgb=rgb)) is plain_opencv(rgb)
