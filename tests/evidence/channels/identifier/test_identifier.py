from pathlib import Path

import numpy as np
import pytest

from skidpad.core.errors import FileError
from skidpad.core.vocabulary import HazardType
from skidpad.evidence.channels import identifier
from skidpad.evidence.channels.choices import Identify
from skidpad.evidence.channels.hazards import SCORED_HAZARDS
from skidpad.evidence.channels.identifier.features import (
    FEATURE_NAMES,
    ROW_NAMES,
    FeatureHistory,
    features_at,
)
from skidpad.evidence.channels.identifier.forest import Forest, check_forest, probabilities
from skidpad.evidence.channels.identifier.model import (
    ALL_ROUTES,
    Detector,
    LearnedIdentifier,
    events_of,
    load_model,
    model_bytes,
    probability_of,
)
from skidpad.evidence.channels.judging.learned import with_model
from skidpad.evidence.channels.judging.segments import judge
from skidpad.evidence.channels.matching import Span
from skidpad.evidence.channels.monitor import Monitor, MonitorSettings
from skidpad.recording.channels.cycles import cycles
from support.channel_worlds import Eyes, World, drive

TAILGATED = HazardType.EGO_TAILGATED


def random_rows(k, seed=0):
    rng = np.random.default_rng(seed)
    rows = rng.normal(size=(k, len(ROW_NAMES)))
    rows[rng.random(rows.shape) < 0.2] = np.nan
    return np.arange(k) * 0.1, rows


@pytest.mark.req("C-15")
def test_windows_agree_with_slices_of_the_past_five_seconds():
    t, rows = random_rows(120)
    at = np.array([0, 3, 49, 50, 51, 119])
    features = features_at(t, rows, at).reshape(at.size, 4, -1)
    for i, k in enumerate(at):
        past, short = rows[max(0, k - 50) : k + 1], rows[max(0, k - 9) : k + 1]
        np.testing.assert_array_equal(features[i, 0], rows[k])
        with np.errstate(all="ignore"):
            mean = np.ma.masked_invalid(short).mean(axis=0).filled(np.nan)
        np.testing.assert_allclose(features[i, 1], mean, atol=1e-12)
        np.testing.assert_array_equal(features[i, 2], np.fmin.reduce(past, axis=0))
        np.testing.assert_array_equal(features[i, 3], np.fmax.reduce(past, axis=0))


@pytest.mark.req("C-15")
def test_a_running_drive_sees_the_same_windows_as_a_recorded_one():
    t, rows = random_rows(130)
    history = FeatureHistory()
    running = np.array([history.update(a, b).copy() for a, b in zip(t, rows, strict=True)])
    np.testing.assert_array_equal(running, features_at(t, rows, np.arange(t.size)))


@pytest.mark.req("C-15")
def test_what_comes_later_or_is_older_than_the_window_changes_nothing():
    t, rows = random_rows(200)
    other = rows.copy()
    other[:40], other[101:] = 7.0, -7.0
    np.testing.assert_array_equal(
        features_at(t, rows, np.array([100])), features_at(t, other, np.array([100]))
    )


@pytest.mark.req("C-15")
def test_no_feature_is_about_route_weather_place_time_or_truth():
    words = {w for name in FEATURE_NAMES for w in name.split("_")}
    assert not words & {"route", "weather", "x", "y", "position", "time", "t", "truth", "seed"}


@pytest.mark.req("C-15", "R-9")
def test_nothing_is_trained_on_what_nearly_is_the_label(trained):
    model, _ = trained
    words = {w for name in model.features for w in name.split("_")}
    assert not words & {"ttc", "pet", "risk", "safety", "score"}
    assert not model.sees_labels
    asked = {
        FEATURE_NAMES[i]
        for detectors in model.detectors.values()
        for d in detectors.values()
        for i in d.forest.feature[d.forest.feature >= 0].tolist()
    }
    assert asked
    assert asked <= set(model.features)
    learned = {(truth, h) for (truth, _), ds in model.detectors.items() for h in ds}
    assert ("world", HazardType.INCONSISTENT_LOCALISATION) not in learned


@pytest.mark.req("C-15")
def test_a_model_file_names_its_own_features_and_means_the_same_when_read(trained, tmp_path):
    model, drives = trained
    (tmp_path / "m.npz").write_bytes(model_bytes(model))
    again = load_model(tmp_path / "m.npz")
    assert again.features == model.features
    for key, detectors in model.detectors.items():
        for hazard, d in detectors.items():
            np.testing.assert_array_equal(
                probability_of(d.forest, drives[0].t, drives[0].rows),
                probability_of(again.detectors[key][hazard].forest, drives[0].t, drives[0].rows),
            )


@pytest.mark.req("C-15")
def test_what_was_not_learned_stays_with_its_rule():
    """A model of tailgating alone leaves positions that jump to the rule."""
    apart = Eyes("b", ego_offset={2.0: (6.0, 0.0)})
    source = drive(World(), (Eyes("a"), apart), 6.0)
    never = {TAILGATED: Detector(stump(), 2.0, 1)}
    settings = MonitorSettings(identify=Identify.LEARNED, detectors=never, keep_worlds=False)
    monitor = Monitor(source.channels, settings)
    for cycle in cycles(source):
        monitor.update(cycle)
    assert {e.key for e in monitor.hazards.finish()} == {HazardType.INCONSISTENT_LOCALISATION}


def stump(feature=0, threshold=0.0, missing_left=1):
    return Forest(
        roots=np.array([0]),
        feature=np.array([feature, -1, -1]),
        threshold=np.array([threshold, 0.0, 0.0]),
        left=np.array([1, 0, 0]),
        right=np.array([2, 0, 0]),
        missing_left=np.array([missing_left, 0, 0]),
        value=np.array([0.0, -2.0, 3.0]),
        baseline=np.array([0.5]),
    )


def test_a_tree_is_walked_by_threshold_and_by_absence():
    out = np.empty(4)
    probabilities(stump(), np.array([[-1.0], [0.0], [1.0], [np.nan]]), out)
    np.testing.assert_allclose(out, 1.0 / (1.0 + np.exp([1.5, 1.5, -3.5, 1.5])))
    probabilities(stump(missing_left=0), np.array([[np.nan]]), out[:1])
    assert out[0] == pytest.approx(1.0 / (1.0 + np.exp(-3.5)))


@pytest.mark.parametrize(
    "change",
    [
        {"left": np.array([0, 0, 0])},  # would walk for ever
        {"right": np.array([9, 0, 0])},
        {"roots": np.array([5])},
        {"feature": np.array([10_000, -1, -1])},
        {"value": np.array([0.0, np.nan, 1.0])},
        {"value": np.array([0.0])},
    ],
)
def test_a_damaged_forest_is_refused(change):
    with pytest.raises(FileError):
        check_forest(stump()._replace(**change), 10)


def test_events_need_confirmation_and_merge_within_two_seconds():
    t = np.arange(100) * 0.1
    p = np.zeros(100)
    p[10:14] = p[25:29] = 0.9  # a pause of 1.2 s
    p[60] = 0.9
    assert events_of(t, p, 0.5, 1) == [(1.0, pytest.approx(2.8)), (6.0, 6.0)]
    assert events_of(t, p, 0.5, 3) == [(pytest.approx(1.2), pytest.approx(2.8))]
    assert events_of(t, p, 0.95, 1) == []


def tailgated_drive(seed, gap):
    """A follower who closes in from `gap` m; from near, one channel does not see him.

    Nothing tells a learned identifier how far he is, only that the channels disagree.
    """
    world = World(
        (0, 0, 0, 15.0, 0), np.array([(-gap - 4.5, 0, 0, 17.0, 0), (60.0, 3.5, 0, 15, 0)])
    )
    eyes = (Eyes("a", 0.02 + 0.001 * seed), Eyes("b", 0.02, blind=(0,) if gap < 40.0 else ()))
    return drive(world, eyes, 12.0)


@pytest.fixture(scope="module")
def trained():
    pytest.importorskip("sklearn", reason="needs the extra learn")
    from skidpad.evidence.channels.identifier.training import TrainingDrive, train_model

    drives = []
    for i in range(12):
        source = tailgated_drive(i, 20.0 if i % 2 else 60.0)
        s = judge(
            f"d{i}", f"route-{i % 3}", source.channels, list(cycles(source)), truths=("world",)
        )
        drives.append(TrainingDrive(s.route, str(i), s.t, s.rows, s.truths, s.hours))
    return train_model(drives), drives


@pytest.mark.req("C-15")
def test_a_trained_model_finds_tailgating_on_a_route_it_never_saw(trained):
    model, _ = trained
    detectors = model.identifier("world", "route-1")
    assert detectors is not model.identifier("world", ALL_ROUTES)
    for gap, expected in ((20.0, 1), (60.0, 0)):
        source = tailgated_drive(99, gap)
        s = with_model(judge("new", "route-1", source.channels, list(cycles(source))), model)
        found = [x for x in s.detected["learned on world truth"] if x.hazard is TAILGATED]
        assert len(found) == expected


@pytest.mark.req("C-15")
def test_own_evaluation_of_the_trees_is_that_of_the_library(trained):
    from sklearn.ensemble import HistGradientBoostingClassifier

    from skidpad.evidence.channels.identifier.training import forest_of

    rng = np.random.default_rng(1)
    x = rng.normal(size=(800, 6))
    x[rng.random(x.shape) < 0.1] = np.nan
    y = np.nan_to_num(x[:, 0]) * np.nan_to_num(x[:, 1], nan=1.0) > 0.1
    machine = HistGradientBoostingClassifier(max_iter=20, early_stopping=False, random_state=0)
    machine.fit(x, y)
    out = np.empty(800)
    probabilities(check_forest(forest_of(machine), 6), x, out)
    np.testing.assert_allclose(out, machine.predict_proba(x)[:, 1], rtol=1e-12)


@pytest.mark.req("C-15")
def test_a_stored_model_says_the_same_and_holds_no_code(trained, tmp_path):
    model, drives = trained
    (tmp_path / "m.npz").write_bytes(model_bytes(model))
    again = load_model(tmp_path / "m.npz")
    d = drives[1]
    for key, detectors in model.detectors.items():
        assert set(detectors) == set(again.detectors[key])
        for hazard, detector in detectors.items():
            np.testing.assert_array_equal(
                probability_of(detector.forest, d.t, d.rows),
                probability_of(again.detectors[key][hazard].forest, d.t, d.rows),
            )
    assert again.trained_on() == {(d.route, d.seed) for d in drives}
    with np.load(tmp_path / "m.npz", allow_pickle=False) as arrays:
        assert all(arrays[name].dtype != object for name in arrays.files)


@pytest.mark.req("C-15")
def test_training_twice_gives_the_same_bytes(trained, tmp_path):
    from skidpad.evidence.channels.identifier.training import card_text, train_model

    model, drives = trained
    assert model_bytes(model) == model_bytes(train_model(drives))
    assert "Trained on" in card_text(model)


@pytest.mark.req("C-15")
def test_the_monitor_uses_rules_the_model_or_both(trained):
    model, _ = trained
    source = tailgated_drive(7, 20.0)
    rows = list(cycles(source))
    fired = {}
    for identify in Identify:
        monitor = Monitor(
            source.channels,
            MonitorSettings(identify=identify, detectors=model.identifier(), keep_worlds=False),
        )
        fired[identify] = [set(monitor.update(c).fired) & set(SCORED_HAZARDS) for c in rows]
    for r, l, b in zip(*fired.values(), strict=True):
        assert b == r | l
    assert any(fired[Identify.LEARNED])
    learned = LearnedIdentifier(model.identifier())
    d = judge("d", "r", source.channels, rows)
    found = [learned.update(t, row) for t, row in zip(d.t, d.rows, strict=True)]
    assert [set(f) for f in found] == fired[Identify.LEARNED]


@pytest.mark.req("C-15")
def test_the_bundled_model_names_its_training_and_never_saw_the_routes_it_leaves_out():
    model = load_model(None)
    routes = {f"route-{k}" for k in range(1, 7)}
    assert {route for route, _ in model.trained_on()} == routes
    assert set(model.detectors) == {(t, r) for t in ("world", "sim") for r in routes | {"all"}}
    assert all(int(seed) // 1000 == 3 for _, seed in model.trained_on())
    card = (Path(identifier.__file__).parent / "models" / "hazards.md").read_text()
    assert f"{model.card['hours']:.2f} h" in card


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04 not a zip", b"\x93NUMPY\x01\x00v\x00{"])
def test_what_is_not_a_model_is_refused_in_one_sentence(tmp_path, content):
    path = tmp_path / "m.npz"
    path.write_bytes(content)
    with pytest.raises(FileError, match=r"m\.npz"):
        load_model(path)


def test_spans_without_events_train_nothing():
    pytest.importorskip("sklearn", reason="needs the extra learn")
    from skidpad.evidence.channels.identifier.training import TrainingDrive, train_model

    t, rows = random_rows(100)
    drives = [
        TrainingDrive(f"r{i}", "1", t, rows, {"world": (Span(TAILGATED, 1, 2),)}, 0.1)
        for i in range(3)
    ]
    model = train_model(drives)
    assert model.identifier() == {}
