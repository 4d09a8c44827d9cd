"""What a chart shows, read back from its SVG: bars and marks in the units of its axes."""

import re
from itertools import pairwise

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
