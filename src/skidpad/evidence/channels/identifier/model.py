"""A learned identifier of hazards beside the rules: its model as data, and its use (decision C-15)."""

from __future__ import annotations

import io
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats
from skidpad.core.errors import ConfigError, FileError
from skidpad.core.files.reading import UNUSABLE, read_arrays, read_bytes, unusable
from skidpad.core.vocabulary import HazardType
from skidpad.evidence.channels.identifier.features import (
    FEATURE_NAMES,
    TRAINED_ON,
    FeatureHistory,
    features_at,
)
from skidpad.evidence.channels.identifier.forest import Forest, check_forest, probabilities
from skidpad.evidence.channels.timefilter import PAUSE, SAME_TIME

VERSION = 2  # of a file; the forests' features are rows of the card's own list
KNOWN_VERSIONS = (1, 2)  # in the first the list was always the whole one
ALL_ROUTES = "all"
BLOCK = 4096  # cycles judged at once
MODEL = "a model of the identifier"
SIZE_LIMIT = 64 * 1024 * 1024  # bytes of a model file
BUNDLED = "bundled"  # the model that comes with Skidpad; its card lies beside it


@dataclass(frozen=True, slots=True)
class Detector:
    """Finds one hazard: present when its probability stays at the limit or above."""

    forest: Forest
    limit: float  # chosen inside the training routes
    confirm: int  # cycles in a row that it takes


@dataclass(frozen=True, slots=True)
class Model:
    """Detectors by truth they were trained on and route that they never saw."""

    detectors: Mapping[tuple[str, str], Mapping[HazardType, Detector]]
    card: dict[str, Any]  # what it was trained on and how

    def identifier(
        self, truth: str = "world", route: str = ALL_ROUTES
    ) -> Mapping[HazardType, Detector]:
        """Returns the detectors that never saw `route`; those of all routes when it was not trained on.

        Raises ConfigError for a truth that the model was not trained on.
        """
        known = {t for t, _ in self.detectors}
        if truth not in known:
            raise ConfigError(
                f"the model was trained on {', '.join(sorted(known))} truth, not {truth}"
            )
        return self.detectors.get((truth, route), self.detectors[truth, ALL_ROUTES])

    @property
    def features(self) -> tuple[str, ...]:
        """Returns the names of the features that it was given to learn from."""
        return tuple(self.card.get("features", FEATURE_NAMES))

    @property
    def sees_labels(self) -> bool:
        """Tells whether its features include any outside TRAINED_ON, which are near its labels."""
        return not set(self.features) <= set(TRAINED_ON)

    def trained_on(self) -> set[tuple[str, str]]:
        """Returns route and seed of each recording that it was trained on."""
        return {(str(r["route"]), str(r["seed"])) for r in self.card["recordings"]}


@dataclass(slots=True)
class LearnedIdentifier:
    """Judges a running drive cycle by cycle."""

    detectors: Mapping[HazardType, Detector]
    history: FeatureHistory = field(default_factory=FeatureHistory)
    in_a_row: dict[HazardType, int] = field(default_factory=dict)
    probability: dict[HazardType, float] = field(default_factory=dict)

    def update(self, t: float, row: Floats) -> list[HazardType]:
        """Takes in the features `row` of the cycle at `t` s and returns the hazards that are present at it.

        A hazard is present after `confirm` cycles in a row at its limit or above.
        """
        x = self.history.update(t, row)[None]
        out = np.empty(1)
        found = []
        for hazard, detector in self.detectors.items():
            probabilities(detector.forest, x, out)
            self.probability[hazard] = float(out[0])
            n = self.in_a_row.get(hazard, 0) + 1 if out[0] >= detector.limit else 0
            self.in_a_row[hazard] = n
            if n >= detector.confirm:
                found.append(hazard)
        return found


def probability_of(forest: Forest, t: Floats, rows: Floats) -> Floats:
    """Returns the probability (k,) at every cycle of a drive, as `LearnedIdentifier` finds it on the way.

    t: (k,) s; rows: (k, len(ROW_NAMES)).
    """
    out = np.empty(t.size)
    for first in range(0, t.size, BLOCK):
        at = np.arange(first, min(first + BLOCK, t.size))
        probabilities(forest, features_at(t, rows, at), out[first : first + at.size])
    return out


def events_of(t: Floats, p: Floats, limit: float, confirm: int) -> list[tuple[float, float]]:
    """Returns (start, end) in s of each event in probabilities p (k,) over t (k,), pauses under PAUSE merged.

    An event begins in the cycle in which p has been `limit` or more `confirm` times in a row.
    """
    so_far = np.concatenate([np.zeros(confirm, dtype=np.int64), np.cumsum(p >= limit)])
    present = t[so_far[confirm:] - so_far[:-confirm] == confirm]
    if not present.size:
        return []
    breaks = np.flatnonzero(np.diff(present) >= PAUSE - SAME_TIME)
    first, last = np.append(0, breaks + 1), np.append(breaks, present.size - 1)
    return list(zip(present[first].tolist(), present[last].tolist(), strict=True))


def model_bytes(model: Model) -> bytes:
    """Returns the model as bytes of an .npz file: arrays and a JSON card, nothing that runs."""
    arrays: dict[str, Any] = {}
    index: list[dict[str, Any]] = []
    for (truth, route), detectors in model.detectors.items():
        for hazard, detector in detectors.items():
            number = len(index)
            index.append(
                {
                    "truth": truth,
                    "without_route": route,
                    "hazard": hazard.value,
                    "limit": detector.limit,
                    "confirm": detector.confirm,
                }
            )
            own = place_features(detector.forest, _places_in(model.features))
            for name, array in own._asdict().items():
                arrays[f"{number}_{name}"] = array
    routes = sorted({f"{t}/{r}" for t, r in model.detectors})
    card = model.card | {
        "version": VERSION,
        "features": list(model.features),
        "detectors": index,
        "models": routes,
    }
    arrays["card"] = np.frombuffer(json.dumps(card, allow_nan=False).encode(), dtype=np.uint8)
    buffer = io.BytesIO()
    np.savez_compressed(buffer, **arrays)
    return buffer.getvalue()


def place_features(forest: Forest, places: NDArray[np.int64]) -> Forest:
    """Returns the forest with feature i counted as places[i]; leaves stay leaves."""
    inner = forest.feature >= 0
    feature = np.where(inner, places[np.maximum(forest.feature, 0)], forest.feature)
    return forest._replace(feature=feature.astype(np.int64))


def _places_in(features: Sequence[str]) -> NDArray[np.int64]:
    """Returns the index in `features` of each of FEATURE_NAMES; 0 for those that it lacks."""
    own = {name: i for i, name in enumerate(features)}
    return np.array([own.get(name, 0) for name in FEATURE_NAMES], dtype=np.int64)


def load_model(path: Path | None) -> Model:
    """Returns the model in the file at `path`; None or the word `bundled`: the one that comes with Skidpad.

    Raises FileError for a file that is no usable model.
    """
    name = BUNDLED if path is None else str(path)
    file = Path(__file__).parent / "models" / "hazards.npz" if name == BUNDLED else Path(name)
    data = read_bytes(file, "model", SIZE_LIMIT)
    try:
        return _model(read_arrays(data, name, MODEL))
    except FileError as error:
        raise FileError(f"{name}: {error}") from error
    except UNUSABLE as error:
        raise unusable(name, MODEL, error) from None


def _model(arrays: dict[str, Any]) -> Model:
    """Returns the model in a file's arrays; raises FileError where its version or parts do not fit."""
    card = json.loads(arrays["card"].tobytes())
    known = {name: i for i, name in enumerate(FEATURE_NAMES)}
    if card["version"] not in KNOWN_VERSIONS or not set(card["features"]) <= set(known):
        raise FileError("the model was made by another version; train it again")
    places = np.array([known[name] for name in card["features"]], dtype=np.int64)
    detectors: dict[tuple[str, str], dict[HazardType, Detector]] = {}
    for entry in card["models"]:
        truth, route = str(entry).split("/", 1)
        detectors[truth, route] = {}
    for number, entry in enumerate(card["detectors"]):
        forest = Forest(
            **{
                name: arrays[f"{number}_{name}"].astype(np.float64 if kind is Floats else np.int64)
                for name, kind in zip(Forest._fields, _KINDS, strict=True)
            }
        )
        key = str(entry["truth"]), str(entry["without_route"])
        detectors[key][HazardType(entry["hazard"])] = Detector(
            place_features(check_forest(forest, len(places)), places),
            float(entry["limit"]),
            int(entry["confirm"]),
        )
    if any((truth, ALL_ROUTES) not in detectors for truth, _ in detectors) or not detectors:
        raise FileError("the model lacks the detectors of all routes")
    return Model(detectors, card)


_KINDS = (int, int, Floats, int, int, int, Floats, Floats)
