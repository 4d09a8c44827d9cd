"""What a chart shows, read back from its SVG: bars and marks in the units of its axes."""

import re
from collections.abc import Callable
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from lxml import etree

NS = {"s": "http://www.w3.org/2000/svg"}
NUMBER = r"-?\d+(?:\.\d+)?(?:e-?\d+)?"


def texts(svg):
    """(text, x, y, anchor) of all words."""
    found = []
    for node in etree.fromstring(svg).iterfind(".//s:text", NS):
        style = node.get("style", "")
        anchor = (re.findall(r"text-anchor: (\w+)", style) or ["start"])[0]
        place = re.findall(NUMBER, node.get("transform", ""))
        x, y = (node.get("x"), node.get("y")) if node.get("x") else place[:2]
        found.append(("".join(node.itertext()).strip(), float(x), float(y), anchor))
    return found


def shapes(svg, colour, what="fill"):
    """Corners (n, 2) of every path of this colour."""
    wanted = re.compile(rf"(?:^|; ){what}: {colour}\b")
    nodes = etree.fromstring(svg).iterfind(".//s:path", NS)
    return [
        np.array(re.findall(NUMBER, node.get("d")), float).reshape(-1, 2)
        for node in nodes
        if wanted.search(node.get("style", "")) and "z" in node.get("d")
    ]


def scales(svg):
    """(x of its tick labels, units per pixel) of every y axis, from left to right."""
    ticks = {}
    for text, x, y, anchor in texts(svg):
        number = text.replace("\N{MINUS SIGN}", "-")
        if anchor == "end" and re.fullmatch(NUMBER, number):
            ticks.setdefault(round(x), []).append((float(number), y))
    found = []
    for x, marks in sorted(ticks.items()):
        steps = [(b[0] - a[0]) / (b[1] - a[1]) for a, b in pairwise(marks)]
        assert max(steps) - min(steps) < 1e-3 * abs(steps[0]), "a linear axis"
        found.append((x, abs(steps[0])))
    return found


def bars(svg, colour):
    """Heights of the bars of a colour, from left to right, in units of their y axis."""
    found = [s for s in shapes(svg, colour) if len(s) == 4]
    ground = max(s[:, 1].max() for s in found)
    found = [s for s in found if s[:, 1].max() > ground - 0.01]  # the others are of the legend
    found.sort(key=lambda s: s[:, 0].min())
    return [
        float(np.ptp(s[:, 1])) * [k for x, k in scales(svg) if x < s[:, 0].min()][-1] for s in found
    ]


class Frame(NamedTuple):
    """One pair of axes: its box on the picture, and from pixels to its units."""

    left: float
    top: float
    width: float
    height: float
    x: Callable[[np.ndarray], np.ndarray]
    y: Callable[[np.ndarray], np.ndarray]

    def holds(self, points):
        """Whether pixels (n, 2) lie within it, edges included."""
        inside = np.abs(points - [self.left + self.width / 2, self.top + self.height / 2])
        return bool((inside <= [self.width / 2 + 0.5, self.height / 2 + 0.5]).all())

    def units(self, points):
        """Pixels (n, 2) in units of the axes."""
        return np.column_stack([self.x(points[:, 0]), self.y(points[:, 1])])


def frames(svg):
    """All linear axes of a chart, from left to right and from above down."""
    root, found = etree.fromstring(svg), []
    words = [(t.replace("\N{MINUS SIGN}", "-"), x, y, a) for t, x, y, a in texts(svg)]
    numbers = [(float(t), x, y, a) for t, x, y, a in words if re.fullmatch(NUMBER, t)]
    for rect in root.iterfind(".//s:clipPath/s:rect", NS):
        left, top, width, height = (float(rect.get(n)) for n in ("x", "y", "width", "height"))
        bottom = top + height
        under = [
            (x, v) for v, x, y, a in numbers
            if a == "middle" and bottom < y < bottom + 25 and left - 2 < x < left + width + 2
        ]  # fmt: skip
        beside = [
            (y, v) for v, x, y, a in numbers
            if a == "end" and left - 45 < x < left and top - 2 < y - 4 < bottom + 4
        ]  # fmt: skip
        found.append(Frame(left, top, width, height, _scale(under), _scale(beside, shift=-3.6)))
    return sorted(dict.fromkeys(found), key=lambda f: (round(f.top), f.left))


def _scale(ticks, shift=0.0):
    """From pixels to units, through the ticks; shift: from a label's foot to its tick."""
    if len(ticks) < 2:
        return lambda pixels: np.full(len(pixels), np.nan)
    at, values = np.array(ticks).T
    slope, start = np.polyfit(at + shift, values, 1)
    return lambda pixels: slope * pixels + start


def curves_of(svg, colour):
    """(frame, points in units) of every line of a colour that lies in an axes."""
    found = []
    for node in etree.fromstring(svg).iterfind(".//s:path", NS):
        style = node.get("style", "")
        if f"stroke: {colour}" not in style or "fill: none" not in style:
            continue
        pixels = np.array(re.findall(NUMBER, node.get("d")), float).reshape(-1, 2)
        found += [
            (k, f.units(pixels))
            for k, f in enumerate(frames(svg))
            if f.holds(pixels) and len(pixels)
        ]
    return found


def marks_of(svg, colour, what="fill"):
    """(frame, points in units) of the marks of a colour in each axes."""
    uses = [
        (float(node.get("x")), float(node.get("y")))
        for node in etree.fromstring(svg).iterfind(".//s:use", NS)
        if f"{what}: {colour}" in node.get("style", "")
    ]
    found = []
    for k, frame in enumerate(frames(svg)):
        inside = [p for p in uses if frame.holds(np.array([p]))]
        if inside:
            found.append((k, frame.units(np.array(inside))))
    return found
