"""Hazards that are one: first by an exact key, then by density, then by the course of indicators.

1. The same key: map, kind, a cell of 25 m and the class of weather. A key seen twice is recurring.
2. HDBSCAN over what is left and the keys' middles: place and the series' least, greatest and mean.
3. DTW inside a cluster: whoever is far from its medoid, by its course or by more than `far` metres, is
   let go (density alone has no scale); the medoid represents it.

Source of HDBSCAN: Campello, Moulavi and Sander (2013), as in scikit-learn. Equal hazards give equal
clusters in whatever order they come: everything is sorted by the record's digest first.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from math import floor, hypot

import numpy as np
from dtaidistance import dtw_ndim

from skidpad.core.arrays import Floats
from skidpad.core.errors import ConfigError, MissingExtra, require_range

BLOCK = 2000  # hazards of one map and kind that density is asked of at once


@dataclass(frozen=True, slots=True, kw_only=True)
class ClusterSettings:
    """Holds what counts as the same hazard; ConfigError for a value out of range."""

    cell: float = 25.0  # m, of the exact key
    reach: float = 50.0  # m that weigh as much as the whole range of one signal
    far: float = 150.0  # m from the medoid beyond which a hazard is let go
    least: int = 3  # hazards of a cluster
    warp: float = 1.5  # DTW distance to the medoid beyond which a hazard is let go

    def __post_init__(self) -> None:
        require_range("cluster.cell", self.cell, 0.1, 1000.0)
        require_range("cluster.reach", self.reach, 0.1, 10_000.0)
        require_range("cluster.far", self.far, 0.1, 10_000.0)
        require_range("cluster.warp", self.warp, 0.0, 1000.0)
        if not 2 <= self.least <= 1000:
            raise ConfigError(f"cluster.least must be between 2 and 1000, got {self.least}")


STANDARD = ClusterSettings()


@dataclass(frozen=True, slots=True)
class Case:
    """A hazard as it is compared."""

    id: str
    digest: str  # of its record: the order in which hazards are looked at
    vehicle: str
    type: str
    map: str
    weather: str
    x: float  # m
    y: float
    series: Floats  # (points, signals)


@dataclass(frozen=True, slots=True)
class Cluster:
    """Holds hazards that are taken as one."""

    representative: str  # id: the medoid by DTW
    members: tuple[str, ...]  # ids, nearest to the representative first
    distances: tuple[float, ...]  # DTW of each to the representative
    vehicles: int  # different ones
    type: str
    map: str
    weathers: tuple[str, ...]
    x: float  # m, of the representative
    y: float
    keys: int  # exact keys among them


def key_of(case: Case, settings: ClusterSettings) -> tuple[str, str, int, int, str]:
    """Returns the exact key of a hazard: map, type, cell of the road and weather."""
    cell = floor(case.x / settings.cell), floor(case.y / settings.cell)
    return case.map, case.type, *cell, case.weather


def recurring(
    cases: Sequence[Case], settings: ClusterSettings
) -> dict[tuple[str, str, int, int, str], list[str]]:
    """Returns ids by exact key, of keys that came more than once, the most frequent first."""
    groups: dict[tuple[str, str, int, int, str], list[str]] = defaultdict(list)
    for case in sorted(cases, key=_order):
        groups[key_of(case, settings)].append(case.id)
    often = [(key, ids) for key, ids in groups.items() if len(ids) > 1]
    return dict(sorted(often, key=lambda pair: (-len(pair[1]), pair[0])))


def find_clusters(cases: Sequence[Case], settings: ClusterSettings = STANDARD) -> list[Cluster]:
    """Returns the clusters among `cases`, largest first; hazards that resemble no other are in none."""
    groups: dict[tuple[str, str], list[Case]] = defaultdict(list)
    for case in sorted(cases, key=_order):
        groups[case.map, case.type].append(case)
    found: list[Cluster] = []
    for group in groups.values():
        for label in _dense(group, settings):
            found.extend(_by_course(label, settings))
    return sorted(found, key=lambda c: (-len(c.members), c.type, c.map, c.representative))


def _order(case: Case) -> tuple[str, str]:
    """Returns the key that sorts cases by digest, then id."""
    return case.digest, case.id


def _dense(group: list[Case], settings: ClusterSettings) -> list[list[Case]]:
    """Returns groups of hazards of one map and type that lie densely in place and indicators."""
    if len(group) < settings.least:
        return []
    found: list[list[Case]] = []
    for first in range(0, len(group), BLOCK):
        block = group[first : first + BLOCK]
        labels = _labels(np.array([_features(case, settings) for case in block]), settings)
        found += [
            [c for c, mine in zip(block, labels, strict=True) if mine == label]
            for label in sorted(set(labels) - {-1})
        ]
    return found


def _features(case: Case, settings: ClusterSettings) -> Floats:
    """Returns the features of a case: place over the reach, and min, max and mean of each series."""
    place = np.array([case.x, case.y]) / settings.reach
    s = case.series
    return np.concatenate([place, s.min(axis=0), s.max(axis=0), s.mean(axis=0)])


def _labels(features: Floats, settings: ClusterSettings) -> list[int]:
    """Returns the cluster of each row of features, -1: of none."""
    if len(features) < 2 * settings.least:  # too few to have a density: one group, or none
        return [0 if len(features) >= settings.least else -1] * len(features)
    try:
        from sklearn.cluster import HDBSCAN
    except ImportError as error:
        raise MissingExtra("the fleet's hazard database", "fleet") from error
    found = HDBSCAN(
        min_cluster_size=settings.least, algorithm="brute", allow_single_cluster=True,
        cluster_selection_epsilon=0.1, copy=True,
    ).fit(features)  # fmt: skip
    labels: list[int] = found.labels_.tolist()
    return labels


def _by_course(group: list[Case], settings: ClusterSettings) -> list[Cluster]:
    """Returns one cluster: the group near its medoid by course and place; empty below `least` hazards."""
    distances = warping_table([case.series for case in group])
    medoid = int(np.argmin(distances.sum(axis=1)))
    chosen = group[medoid]
    away = np.array([hypot(case.x - chosen.x, case.y - chosen.y) for case in group])
    near = (distances[medoid] <= settings.warp) & (away <= settings.far)
    if near.sum() < settings.least:
        return []
    kept = [i for i in np.argsort(distances[medoid], kind="stable").tolist() if near[i]]
    members = [group[i] for i in kept]
    return [
        Cluster(
            representative=chosen.id,
            members=tuple(case.id for case in members),
            distances=tuple(round(float(distances[medoid, i]), 4) for i in kept),
            vehicles=len({case.vehicle for case in members}),
            type=chosen.type,
            map=chosen.map,
            weathers=tuple(sorted({case.weather for case in members})),
            x=chosen.x,
            y=chosen.y,
            keys=len({key_of(case, settings) for case in members}),
        )
    ]


def warping_table(series: Sequence[Floats]) -> Floats:
    """Returns the DTW distance of each pair, (n, n), symmetric with zeros on the diagonal."""
    n = len(series)
    out = np.zeros((n, n))
    for i in range(n):
        for j in range(i + 1, n):
            out[i, j] = out[j, i] = dtw_ndim.distance_fast(series[i], series[j], use_pruning=False)
    return out
