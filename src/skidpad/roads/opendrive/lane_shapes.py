"""Lanes of a road as samples: centre line, heading, curvature, width, height, limits, markings."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import pairwise
from math import ceil
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats
from skidpad.core.errors import FileError
from skidpad.roads.lanes import LaneKind, Marking
from skidpad.roads.opendrive.document import Document, LaneRecord, RoadRecord, SectionRecord
from skidpad.roads.opendrive.reference_line import Cubics

STEP = 0.98  # m, longest distance of samples along any lane of a section
JOINT = 1e-6  # m inside a section: where records are chosen at its ends
STRETCH_MAX = 3.0  # more is a jump in the file, which no sampling makes smooth
JOINT_GAP = 0.02  # m, closer joints get no sample of their own
SHORTEST = 1e-4  # m, shorter sections are joints written twice
FARTHEST = 1e7  # m from the origin; northings of map projections reach 1e7
SAMPLES_MAX = 20_000_000

KINDS = {
    "driving": LaneKind.DRIVING,
    "bidirectional": LaneKind.DRIVING,
    "shoulder": LaneKind.SHOULDER,
    "stop": LaneKind.SHOULDER,
    "sidewalk": LaneKind.SIDEWALK,
    "walking": LaneKind.SIDEWALK,
    "biking": LaneKind.BIKING,
    "parking": LaneKind.PARKING,
    "border": LaneKind.BORDER,
    "curb": LaneKind.BORDER,
    "median": LaneKind.MEDIAN,
    "entry": LaneKind.RAMP,
    "exit": LaneKind.RAMP,
    "onRamp": LaneKind.RAMP,
    "offRamp": LaneKind.RAMP,
    "connectingRamp": LaneKind.RAMP,
    "slipLane": LaneKind.RAMP,
    "mwyEntry": LaneKind.RAMP,
    "mwyExit": LaneKind.RAMP,
}

MARKINGS = {
    "none": Marking.NONE,
    "broken": Marking.BROKEN,
    "solid": Marking.SOLID,
    "solid solid": Marking.SOLID_SOLID,
    "solid broken": Marking.SOLID_BROKEN,
    "broken solid": Marking.BROKEN_SOLID,
    "curb": Marking.CURB,
}


class LaneKey(NamedTuple):
    """A lane in OpenDRIVE terms."""

    road: int
    section: int
    lane: int


class LaneShape(NamedTuple):
    """One lane's samples in driving direction, arrays (n,)."""

    key: LaneKey
    kind: LaneKind
    along: bool  # traffic runs with increasing road s
    x: Floats
    y: Floats
    z: Floats
    heading: Floats  # rad, continuous
    s: Floats
    s_road: Floats
    curvature: Floats
    grade: Floats
    bank: Floats
    width: Floats
    limit: Floats
    marking_left: NDArray[np.uint8]
    marking_right: NDArray[np.uint8]


class _Band(NamedTuple):
    """Centre and width of one lane across the road, arrays (n,), with derivatives by road s."""

    lane: LaneRecord
    inner_mark: LaneRecord
    t: Floats
    dt: Floats
    ddt: Floats
    width: Floats


def lane_shapes(document: Document) -> Iterator[LaneShape]:
    """Yields all lanes but the centre ones, roads in file order, each section from left to right.

    Sections shorter than SHORTEST and lanes without width are left out. FileError for more than SAMPLES_MAX
    samples or values beyond FARTHEST.
    """
    samples = 0
    for road in document.roads.values():
        for index, section in enumerate(road.sections):
            extent = section.s_end - section.s_start
            if extent < SHORTEST:
                continue
            besides_centre = len(section.lanes) - 1
            # before they are made, as a section may claim any extent
            _require_sample_limit(document, samples + besides_centre * extent / STEP)
            for shape in _section_shapes(road, index, section):
                _require_sane(document, shape)
                samples += len(shape.s)
                _require_sample_limit(document, samples)
                yield shape


def _require_sample_limit(document: Document, samples: float) -> None:
    """Raises FileError where a map would have more than SAMPLES_MAX lane samples."""
    if samples > SAMPLES_MAX:
        raise FileError(f"{document.file}: more than {SAMPLES_MAX} lane samples")


def _require_sane(document: Document, shape: LaneShape) -> None:
    """Raises FileError where a value of a lane's shape is NaN or beyond FARTHEST."""
    for name in ("x", "y", "z", "s", "width", "curvature", "grade", "bank"):
        values = getattr(shape, name)
        if not np.all(np.abs(values) <= FARTHEST):  # also catches NaN
            raise FileError(
                f"{document.file}: road {shape.key.road} lane {shape.key.lane}: {name} must be "
                f"within {FARTHEST:g}, got {values[np.argmax(np.abs(values))]:g}"
            )


def _section_shapes(road: RoadRecord, index: int, section: SectionRecord) -> list[LaneShape]:
    """Returns the shapes of a section's lanes, sampled finely enough for the outer lane of a bend."""
    shapes = _sample_lanes(road, index, section, _grid(road, section, STEP))
    stretch = max(
        (float(np.max(np.diff(shape.s) / abs(np.diff(shape.s_road)))) for shape in shapes),
        default=1.0,
    )
    if stretch > 1.0:  # outer lanes of a bend are longer than the reference line
        step = STEP / min(stretch, STRETCH_MAX)
        shapes = _sample_lanes(road, index, section, _grid(road, section, step))
    return shapes


def _grid(road: RoadRecord, section: SectionRecord, step: float) -> Floats:
    """Returns road s in m of the samples, `step` m apart at most, one at each joint (curvature may jump)."""
    widths = [
        section.s_start + cubic.start
        for lane in section.lanes
        for cubic in (lane.width, lane.border)
        if cubic is not None
    ]
    starts = np.unique(np.concatenate([road.line.starts, road.lane_offset.start, *widths]))
    joints = [section.s_start]
    for s in starts.tolist():
        if joints[-1] + JOINT_GAP < s < section.s_end - JOINT_GAP:
            joints.append(s)
    joints.append(section.s_end)
    pieces = [
        np.linspace(s0, s1, max(ceil((s1 - s0) / step), 1), endpoint=False)
        for s0, s1 in pairwise(joints)
    ]
    return np.concatenate([*pieces, [section.s_end]])


def _sample_lanes(
    road: RoadRecord, index: int, section: SectionRecord, s: Floats
) -> list[LaneShape]:
    """Returns the shapes of a section's lanes, sampled at the road coordinates s in m."""
    select = np.clip(s, section.s_start + JOINT, section.s_end - JOINT)
    line = road.line.at(s)
    z_line, grade_line, _ = road.elevation.at(s, select)
    roll, d_roll, dd_roll = road.superelevation.at(s, select)
    shapes = []
    for band in _bands(road, section, s, select):
        along = (band.lane.id < 0) != road.left_hand
        t, dt, ddt = _from_above(band, roll, d_roll, dd_roll)
        stretch = 1.0 - line.curvature * t  # length of a parallel line per length of the line
        turn = np.arctan2(dt, stretch)
        d_stretch = -line.d_curvature * t - line.curvature * dt
        speed = np.maximum(np.hypot(stretch, dt), 1e-6)
        d_turn = (ddt * stretch - dt * d_stretch) / speed**2
        heading = np.unwrap(line.heading + turn)
        x = line.x - t * np.sin(line.heading)
        y = line.y + t * np.cos(line.heading)
        d_z = grade_line + band.dt * np.sin(roll) + band.t * np.cos(roll) * d_roll
        sign = 1.0 if along else -1.0
        order = slice(None) if along else slice(None, None, -1)
        left, right = _markings(band, section, select)
        if not along:
            left, right = right, left
        shapes.append(
            LaneShape(
                key=LaneKey(road.id, index, band.lane.id),
                kind=KINDS.get(band.lane.type, LaneKind.OTHER),
                along=along,
                x=x[order],
                y=y[order],
                z=(z_line + band.t * np.sin(roll))[order],
                heading=(heading + (0.0 if along else np.pi))[order],
                s=_lengths(x[order], y[order], heading[order]),
                s_road=s[order],
                curvature=(sign * (line.curvature + d_turn) / speed)[order],
                grade=(sign * d_z / speed)[order],
                bank=(sign * roll)[order],
                width=band.width[order],
                limit=_limits(road, section, band.lane, select)[order],
                marking_left=left[order],
                marking_right=right[order],
            )
        )
    return shapes


def _from_above(
    band: _Band, roll: Floats, d_roll: Floats, dd_roll: Floats
) -> tuple[Floats, Floats, Floats]:
    """Returns how far a place of a banked road lies beside its line seen from above, t cos(roll).

    With its first two derivatives by s; roll and its derivatives (n,).
    """
    c, s = np.cos(roll), np.sin(roll)
    return (
        band.t * c,
        band.dt * c - band.t * s * d_roll,
        band.ddt * c - 2.0 * band.dt * s * d_roll - band.t * (c * d_roll**2 + s * dd_roll),
    )


def _lengths(x: Floats, y: Floats, heading: Floats) -> Floats:
    """Returns the arc length from the first sample: each chord is that of an arc through its headings."""
    chord = np.hypot(np.diff(x), np.diff(y))
    half = 0.5 * np.diff(heading)
    return np.concatenate(([0.0], np.cumsum(chord / np.sinc(half / np.pi))))


def _bands(road: RoadRecord, section: SectionRecord, s: Floats, select: Floats) -> Iterator[_Band]:
    """Yields the lanes of each side from the centre outwards; lanes without any width are left out.

    s (n,): m along the road; select (n,): places that choose the records.
    """
    offset = np.array(road.lane_offset.at(s, select))  # value and derivatives: (3, n)
    centre = next((lane for lane in section.lanes if lane.id == 0), None)

    def cubic(record: Cubics) -> Floats:
        return np.array(record.at(s - section.s_start, select - section.s_start))

    for side in (1.0, -1.0):
        lanes = sorted((r for r in section.lanes if r.id * side > 0), key=lambda r: abs(r.id))
        inner, inner_mark = offset, centre
        for lane in lanes:
            outer = _outer_border(lane, side, inner, offset, cubic)
            middle, width = 0.5 * (inner + outer), side * (outer - inner)[0]
            if np.any(width > 0.0):
                t, dt, ddt = middle
                yield _Band(lane, inner_mark or lane, t, dt, ddt, np.maximum(width, 0.0))
            inner, inner_mark = outer, lane


def _outer_border(
    lane: LaneRecord,
    side: float,
    inner: Floats,
    offset: Floats,
    cubic: Callable[[Cubics], Floats],
) -> Floats:
    """Returns a lane's outer border in m left of the road's line with derivatives, (3, n).

    The inner border where the lane has neither width nor border. side: 1 left, -1 right.
    """
    if lane.width is not None:
        return inner + side * cubic(lane.width)
    if lane.border is not None:
        return offset + cubic(lane.border)
    return inner


def _markings(
    band: _Band, section: SectionRecord, select: Floats
) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """Returns the markings left and right of a lane as seen along increasing s, (n,) each."""
    inner, outer = (
        _steps(
            [(s, float(MARKINGS.get(kind, Marking.OTHER))) for s, kind in lane.marks],
            select - section.s_start,
            float(Marking.NONE),
        ).astype(np.uint8)
        for lane in (band.inner_mark, band.lane)
    )
    return (outer, inner) if band.lane.id > 0 else (inner, outer)


def _limits(road: RoadRecord, section: SectionRecord, lane: LaneRecord, select: Floats) -> Floats:
    """Returns the speed limit (n,) in m/s: the lane's own record, else the road type's; NaN without any."""
    by_lane = _steps(list(lane.speeds), select - section.s_start, np.nan)
    return np.where(np.isnan(by_lane), _steps(list(road.speeds), select, np.nan), by_lane)


def _steps(records: list[tuple[float, float]], s: Floats, before: float) -> Floats:
    """Returns the value of the last record at or before each `s`; `before` where there is none yet."""
    values = np.array([before, *(value for _, value in records)])
    return values[np.searchsorted([start for start, _ in records], s, side="right")]
