"""Reference lines by a second route: numerical integration, and the same curve written otherwise."""

from __future__ import annotations

from math import cos, pi, sin, tan

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from lxml.etree import fromstring
from scipy.integrate import solve_ivp

from skidpad.core.geometry import wrap_angle
from skidpad.roads.opendrive.bake import bake
from skidpad.roads.opendrive.document import _element
from skidpad.roads.opendrive.reader import Reader
from skidpad.roads.opendrive.reference_line import Clothoid, Element, Parametric, ReferenceLine
from skidpad.roads.queries import RoadMap
from support.examples import examples

curvatures = st.floats(-0.1, 0.1)


@given(curvatures, curvatures, st.floats(1.0, 120.0), st.floats(-pi, pi))
@settings(max_examples=examples(60))
def test_spirals_are_what_integration_of_their_curvature_gives(
    k0: float, k1: float, length: float, heading: float
) -> None:
    line = ReferenceLine([Element(0.0, 3.0, -2.0, heading, length, Clothoid(k0, k1))])
    s = np.linspace(0.0, length, 7)
    ours = line.at(s)

    def slope(at: float, state: np.ndarray) -> list[float]:
        return [cos(state[2]), sin(state[2]), k0 + (k1 - k0) * at / length]

    theirs = solve_ivp(slope, (0.0, length), [3.0, -2.0, heading], t_eval=s, rtol=1e-9, atol=1e-9)
    assert np.allclose(ours.x, theirs.y[0], atol=1e-5)
    assert np.allclose(ours.y, theirs.y[1], atol=1e-5)
    assert np.allclose(ours.heading, theirs.y[2], atol=1e-6)
    assert np.allclose(ours.curvature, k0 + (k1 - k0) * s / length)


def test_a_long_cubic_is_where_its_length_says() -> None:
    a, end = 5e-5, 6000.0  # v = a u^2, whose length is known in closed form
    length = end / 2.0 * np.hypot(1.0, 2 * a * end) + np.arcsinh(2 * a * end) / (4 * a)
    shape = Parametric((0.0, 1.0, 0.0, 0.0), (0.0, 0.0, a, 0.0), end)
    line = ReferenceLine([Element(0.0, 0.0, 0.0, 0.0, length, shape)])
    u = np.linspace(0.0, end, 977)
    s = u / 2.0 * np.hypot(1.0, 2 * a * u) + np.arcsinh(2 * a * u) / (4 * a)
    assert np.allclose(line.at(s).x, u, atol=1e-6)


@pytest.mark.parametrize("p_end", [1.0, 30.0])
def test_parametric_cubics_keep_their_derivatives_consistent(p_end: float) -> None:
    scale = 30.0 / p_end
    shape = Parametric((0.0, scale, 0.0, 0.0), (0.0, 0.0, 0.004 * scale**2, 1e-4 * scale**3), p_end)
    p = np.linspace(0.0, p_end, 20001)
    u, v = shape.u[1] * p, shape.v[2] * p**2 + shape.v[3] * p**3
    length = float(np.hypot(np.diff(u), np.diff(v)).sum())
    line = ReferenceLine([Element(0.0, 1.0, 2.0, 0.7, length, shape)])
    s = np.linspace(0.0, length, 400)
    at = line.at(s)
    step = s[1] - s[0]
    assert np.allclose(np.hypot(np.diff(at.x), np.diff(at.y)), step, rtol=2e-4)
    assert np.allclose(np.gradient(at.heading, step)[1:-1], at.curvature[1:-1], atol=2e-5)
    assert np.allclose(np.gradient(at.curvature, step)[1:-1], at.d_curvature[1:-1], atol=2e-5)


def road(body: str, lanes: str, lateral: str = "", rule: str = "") -> RoadMap:
    return RoadMap(
        bake(
            f"""<OpenDRIVE><header><geoReference>x</geoReference></header>
            <road id="7" junction="-1" length="100" {rule}><link/>
            <planView>{body}</planView>
            <elevationProfile><elevation s="0" a="1" b="0.03" c="0" d="0"/></elevationProfile>
            <lateralProfile>{lateral}</lateralProfile>
            <lanes>{lanes}</lanes></road></OpenDRIVE>""".encode(),
            "test",
        )
    )


ARC = '<geometry s="0" x="0" y="0" hdg="0" length="100"><arc curvature="0.02"/></geometry>'
LINE = '<geometry s="0" x="0" y="0" hdg="0" length="100"><line/></geometry>'
POLY = (
    '<geometry s="0" x="0" y="0" hdg="0" length="100"><poly3 a="0" b="0" c="0" d="0"/></geometry>'
)
LANES = """<laneOffset s="0" a="0.5" b="0" c="0" d="0"/>
<laneSection s="0"><left><lane id="1" type="driving"><width sOffset="0" a="3" b="0" c="0" d="0"/>
</lane></left><center><lane id="0" type="none"/></center><right><lane id="-1" type="driving">
<width sOffset="0" a="3" b="0.01" c="0" d="0"/></lane></right></laneSection>"""


def test_lanes_of_an_arc_are_arcs_of_their_own_radius() -> None:
    map = road(ARC, LANES.replace('b="0.01"', 'b="0"'))
    for lane_id, radius, sign in ((1, 50.0 - 2.0, -1.0), (-1, 50.0 + 1.0, 1.0)):
        place = map.on_lane(7, lane_id, 50.0)
        assert sign * place.curvature == pytest.approx(1.0 / radius, rel=1e-5)
        assert float(map.lanes.length[place.lane]) == pytest.approx(radius * 2.0, abs=1e-4)
        assert np.hypot(place.x, place.y - 50.0) == pytest.approx(radius, abs=1e-5)


def test_a_widening_lane_turns_by_half_of_its_slope() -> None:
    place = road(LINE, LANES).on_lane(7, -1, 40.0)
    assert place.width == pytest.approx(3.4)
    assert place.heading == pytest.approx(-np.arctan(0.005), abs=1e-6)
    assert place.y == pytest.approx(0.5 - 1.7, abs=1e-5)
    assert place.z == pytest.approx(1.0 + 0.03 * 40.0, abs=1e-5)


def test_poly3_of_zeros_is_a_line() -> None:
    a, b = road(LINE, LANES), road(POLY, LANES)
    assert np.allclose(a.samples.x, b.samples.x, atol=1e-5)
    assert np.allclose(a.samples.heading, b.samples.heading, atol=1e-6)


@pytest.mark.parametrize(("c", "d"), [(0.01, 0.0), (-0.004, 1e-4), (5.0, 0.0)])
def test_a_curved_poly3_ends_where_its_arc_is_as_long_as_its_length(c: float, d: float) -> None:
    text = POLY.replace('c="0" d="0"', f'c="{c}" d="{d}"')
    line = ReferenceLine([_element(Reader("test"), fromstring(text))])
    end = solve_ivp(
        lambda s, u: 1.0 / np.hypot(1.0, 2.0 * c * u + 3.0 * d * u * u),
        (0.0, 100.0), [0.0], t_eval=[50.0, 100.0], rtol=1e-10, atol=1e-10,
    ).y[0]  # fmt: skip
    at = line.at(np.array([50.0, 100.0]))
    assert np.allclose(at.x, end, atol=1e-4)
    assert np.allclose(at.y, end * end * (c + d * end), atol=1e-3)


def test_left_hand_traffic_drives_on_the_left() -> None:
    right, left = road(LINE, LANES), road(LINE, LANES, rule='rule="LHT"')
    for lane_id in (-1, 1):
        there, here = right.on_lane(7, lane_id, 50.0), left.on_lane(7, lane_id, 50.0)
        assert abs(wrap_angle(there.heading - here.heading)) == pytest.approx(pi, abs=1e-6)
        assert int(left.lanes.opposite[here.lane]) >= 0


def test_superelevation_lifts_the_left_side() -> None:
    tilted = '<superelevation s="0" a="0.05" b="0" c="0" d="0"/>'
    map = road(LINE, LANES, tilted)
    left, right = map.on_lane(7, 1, 50.0), map.on_lane(7, -1, 50.0)
    assert left.z - right.z == pytest.approx((left.y - right.y) * tan(0.05), abs=1e-5)
    bank = map.samples.bank[[map.lanes.first[left.lane], map.lanes.first[right.lane]]]
    assert bank.tolist() == pytest.approx([-0.05, 0.05])


def test_borders_say_the_same_as_widths() -> None:
    borders = LANES.replace('<width sOffset="0" a="3" b="0"', '<border sOffset="0" a="3" b="0"')
    borders = borders.replace(
        '<width sOffset="0" a="3" b="0.01"', '<border sOffset="0" a="-3" b="-0.01"'
    )
    a, b = road(LINE, LANES), road(LINE, borders)
    assert np.allclose(a.samples.width, b.samples.width)
    assert np.allclose(a.samples.y, b.samples.y)
