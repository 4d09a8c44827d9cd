"""Training of the learned identifier: boosted trees, held-out routes, calibration inside (C-15)."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from skidpad import __version__
from skidpad.core.arrays import Floats
from skidpad.core.errors import ConfigError, MissingExtra
from skidpad.core.vocabulary import HazardType
from skidpad.evidence.channels.hazards import SCORED_HAZARDS
from skidpad.evidence.channels.identifier.features import FEATURE_NAMES, TRAINED_ON, features_at
from skidpad.evidence.channels.identifier.forest import Forest
from skidpad.evidence.channels.identifier.model import (
    ALL_ROUTES,
    Detector,
    Model,
    events_of,
    place_features,
    probability_of,
)
from skidpad.evidence.channels.matching import Span, tally

THIN = 8  # of the cycles without the hazard each eighth is used, with that weight
EVENTS_MIN = 4  # a hazard with fewer true events is not learned
TREES, LEAVES, RATE, LEAF_SAMPLES, SHRINK = 60, 12, 0.1, 40, 1.0
LIMITS = np.round(np.arange(0.05, 0.96, 0.05), 2)
CONFIRM = (1, 3, 6)  # cycles
FOLDS = 2  # groups of routes inside the training routes
TRUTHS = ("world", "sim")
_PLACES = np.array([FEATURE_NAMES.index(name) for name in TRAINED_ON], dtype=np.int64)
# world-model truth of localisation is the distance of two positions, which is an indicator
HANDED_OVER = {("world", HazardType.INCONSISTENT_LOCALISATION)}


@dataclass(frozen=True, slots=True)
class TrainingDrive:
    """One recording as the identifier sees it, and what was true."""

    route: str
    seed: str
    t: Floats  # (k,)
    rows: Floats  # (k, f)
    truths: Mapping[str, tuple[Span, ...]]
    hours: float


def train_model(
    drives: Sequence[TrainingDrive], say: Callable[[str], None] = lambda _: None
) -> Model:
    """Trains detectors per truth on all routes, and without each route in turn, and returns the model.

    A truth that a drive lacks is left out, as is a hazard with fewer than EVENTS_MIN true events.
    Routes are held out only when there are more than FOLDS. say: is called with a line per training.

    Raises:
        ConfigError: fewer than FOLDS drives.
        MissingExtra: scikit-learn is not installed.
    """
    require_learning()
    routes = sorted({d.route for d in drives})
    if len(drives) < FOLDS:
        raise ConfigError(f"training needs at least {FOLDS} recordings, got {len(drives)}")
    detectors: dict[tuple[str, str], Mapping[HazardType, Detector]] = {}
    held_out = [r for r in routes if len(routes) > FOLDS]
    for truth in (t for t in TRUTHS if all(t in d.truths for d in drives)):
        for without in (*held_out, ALL_ROUTES):
            part = [d for d in drives if d.route != without]
            detectors[truth, without] = {
                hazard: found
                for hazard in SCORED_HAZARDS
                if (truth, hazard) not in HANDED_OVER
                and (found := _detector(part, truth, hazard)) is not None
            }
            said = ", ".join(
                f"{h.value} at {d.limit:.2f} x {d.confirm}"
                for h, d in detectors[truth, without].items()
            )
            say(f"{truth} truth, without {without if without != ALL_ROUTES else 'nothing'}: {said}")
    return Model(detectors, _card(drives, routes))


def _detector(drives: Sequence[TrainingDrive], truth: str, hazard: HazardType) -> Detector | None:
    """Returns a detector with trees of all drives; None with under EVENTS_MIN true events or one class.

    Limit and confirmation come from drives that the trees of a fold did not see.
    """
    true = sum(s.hazard is hazard for d in drives for s in d.truths[truth])
    if true < EVENTS_MIN:
        return None
    groups = _folds(drives)
    judged: list[tuple[TrainingDrive, Floats]] = []
    for number in range(FOLDS):
        inside = [d for d, g in zip(drives, groups, strict=True) if g != number]
        outside = [d for d, g in zip(drives, groups, strict=True) if g == number]
        forest = _fit_trees(inside, truth, hazard)
        if forest is not None:
            judged += [(d, probability_of(forest, d.t, d.rows)) for d in outside]
    forest = _fit_trees(drives, truth, hazard)
    if forest is None or not judged:
        return None
    limit, confirm = _calibrate(judged, truth, hazard)
    return Detector(forest, limit, confirm)


def _folds(drives: Sequence[TrainingDrive]) -> list[int]:
    """Returns the group of each drive, 0 to FOLDS - 1: routes in turn, or drives where routes are too few."""
    routes = sorted({d.route for d in drives})
    if len(routes) < FOLDS:
        return [i % FOLDS for i in range(len(drives))]
    return [routes.index(d.route) % FOLDS for d in drives]


def _calibrate(
    judged: Sequence[tuple[TrainingDrive, Floats]], truth: str, hazard: HazardType
) -> tuple[float, int]:
    """Returns the limit and the confirmation in cycles with the best F1 score of events.

    judged: drives with the probability (k,) that was found for them. The larger limit wins a tie.
    """
    best = (-1.0, 0.5, 1)
    for confirm in CONFIRM:
        for limit in LIMITS.tolist():
            tp = fp = fn = 0
            for d, p in judged:
                spans = [Span(hazard, a, b) for a, b in events_of(d.t, p, limit, confirm)]
                row = tally(spans, d.truths[truth], d.hours)[hazard]
                tp, fp, fn = tp + row.tp, fp + row.fp, fn + row.fn
            score = 2 * tp / max(2 * tp + fp + fn, 1)
            best = max(best, (score, limit, -confirm))
    return best[1], -best[2] if best[2] < 0 else 1


def _fit_trees(drives: Sequence[TrainingDrive], truth: str, hazard: HazardType) -> Forest | None:
    """Returns trees fitted by scikit-learn; None when all cycles are of one class.

    Of the cycles without the hazard each THINth is used.
    """
    from sklearn.ensemble import HistGradientBoostingClassifier
    from threadpoolctl import threadpool_limits

    xs, ys, weights = [], [], []
    for d in drives:
        present = np.zeros(d.t.size, dtype=bool)
        for s in d.truths[truth]:
            if s.hazard is hazard:
                present |= (d.t >= s.t_start) & (d.t <= s.t_end)
        at = np.flatnonzero(present | (np.arange(d.t.size) % THIN == 0))
        xs.append(features_at(d.t, d.rows, at)[:, _PLACES])
        ys.append(present[at])
        weights.append(np.where(present[at], 1.0, float(THIN)))
    y = np.concatenate(ys)
    if y.all() or not y.any():
        return None
    machine = HistGradientBoostingClassifier(
        max_iter=TREES, max_leaf_nodes=LEAVES, learning_rate=RATE, min_samples_leaf=LEAF_SAMPLES,
        l2_regularization=SHRINK, early_stopping=False, random_state=0,
    )  # fmt: skip
    x = np.concatenate(xs)
    x[:, np.isnan(x).all(axis=0)] = 0.0  # never evaluated: nothing to split by
    with threadpool_limits(1):  # the same sums on every machine
        machine.fit(x, y, sample_weight=np.concatenate(weights))
    return place_features(forest_of(machine), _PLACES)


def forest_of(machine: Any) -> Forest:
    """Returns the trees of a fitted HistGradientBoostingClassifier of two classes as tables."""
    tables = [trees[0].nodes for trees in machine._predictors]
    sizes = [len(nodes) for nodes in tables]
    roots = np.concatenate([[0], np.cumsum(sizes)[:-1]]).astype(np.int64)
    shift = np.repeat(roots, sizes)
    nodes = np.concatenate(tables)
    leaf = nodes["is_leaf"].astype(bool)
    return Forest(
        roots=roots,
        feature=np.where(leaf, -1, nodes["feature_idx"]).astype(np.int64),
        threshold=np.where(leaf, 0.0, nodes["num_threshold"]),
        left=np.where(leaf, 0, nodes["left"] + shift).astype(np.int64),
        right=np.where(leaf, 0, nodes["right"] + shift).astype(np.int64),
        missing_left=nodes["missing_go_to_left"].astype(np.int64),
        value=nodes["value"].astype(np.float64),
        baseline=np.asarray(machine._baseline_prediction, dtype=np.float64).reshape(1),
    )


def _card(drives: Sequence[TrainingDrive], routes: Sequence[str]) -> dict[str, Any]:
    """Returns what a model was trained on: versions, features, recordings, true events, settings."""
    import sklearn

    return {
        "skidpad": __version__,
        "features": list(TRAINED_ON),
        "scikit_learn": sklearn.__version__,
        "recordings": [{"route": d.route, "seed": d.seed} for d in drives],
        "routes": list(routes),
        "hours": sum(d.hours for d in drives),
        "true_events": {
            truth: {
                h.value: sum(s.hazard is h for d in drives for s in d.truths[truth])
                for h in SCORED_HAZARDS
            }
            for truth in TRUTHS
            if all(truth in d.truths for d in drives)
        },
        "settings": {
            "trees": TREES, "leaves": LEAVES, "rate": RATE, "leaf_samples": LEAF_SAMPLES,
            "shrink": SHRINK, "thin": THIN, "folds": FOLDS,
        },
    }  # fmt: skip


def card_text(model: Model) -> str:
    """Returns the model card as Markdown."""
    c = model.card
    events = "\n".join(
        f"| {truth} | {', '.join(f'{h} {n}' for h, n in row.items())} |"
        for truth, row in c["true_events"].items()
    )
    return f"""# Model card: learned hazard identifier

- **What it does**: says in each cycle how probable each of three hazards is, from the past 5 s of
  {len(c["features"])} features of indicators. It sees no route, weather, position, time or truth, and no
  time to collision, risk or safety score, which nearly are what it is to learn. Localisation is learnt from
  simulator truth alone, as world-model truth of it is the distance of positions, which is an indicator.
- **What it is**: {c["settings"]["trees"]} boosted trees of {c["settings"]["leaves"]} leaves per hazard, as
  arrays; made with scikit-learn {c["scikit_learn"]}, evaluated by Skidpad {c["skidpad"]}.
- **Trained on**: {len(c["recordings"])} recordings, {c["hours"]:.2f} h, routes {", ".join(c["routes"])}.
- **Limits of probability**: chosen on routes that the fold's trees had not seen, inside the training
  routes. For each route there is a model that never saw it; evaluation uses that one.
- **Not for**: channels, sensors or traffic unlike those of the training drives without an evaluation
  of its own (`skidpad channels evaluate DIR --model MODEL`). It learns what the truth calls a hazard,
  ghosts included where it is trained on world-model truth.

| truth | events in training |
|---|---|
{events}
"""


def require_learning() -> None:
    """Raises MissingExtra when scikit-learn is not installed."""
    try:
        import sklearn  # noqa: F401
    except ImportError as error:
        raise MissingExtra("skidpad channels train", "learn") from error
