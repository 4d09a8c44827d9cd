"""Reference recordings: short drives whose motion may change only in a commit that says why.

`make refs` writes them anew and prints what moved, from when on, and by how much.
"""

import json
from pathlib import Path

import numpy as np
import pytest

from skidpad import drive
from skidpad.recording.fingerprint import fingerprint

FILE = Path(__file__).with_name("references.json")
MANOEUVRES = {  # name: configuration, weather, profile, seed
    "no assistance, dry": (0, "clear-noon", "recommended", 1),
    "following, dry": (1, "clear-noon", "recommended", 2),
    "lane centring, rain at night": (2, "rain-night", "recommended", 3),
    "light ahead, wet": (3, "rain-noon", "recommended", 4),
    "full package, ice": (4, "icy_30", "recommended", 5),
    "full package, as the thesis says": (4, "clear-night", "thesis_text", 6),
    "lane centring, as the thesis lists": (2, "clear-noon", "thesis_listing", 7),
}
CHANNELS = ("x", "y", "v", "steer", "throttle", "brake", "tier")
DURATION, EVERY = 25.0, 10  # s, ticks between samples


def record(name):
    configuration, weather, profile, seed = MANOEUVRES[name]
    log = drive(
        configuration,
        weather=weather,
        profile=profile,
        seed=seed,
        duration=DURATION,
        sensors="objects",
    ).log
    series = (
        log.actors.x[:, 0],
        log.actors.y[:, 0],
        log.v_ego,
        log.requested.steer,
        log.requested.throttle,
        log.requested.brake,
        log.report.tier,
    )
    return {
        channel: [round(float(v), 5) for v in values[::EVERY]]
        for channel, values in zip(CHANNELS, series, strict=True)
    }


def moved(before, after):
    """Per channel: first sample that differs, and the largest change."""
    changes = []
    for channel in CHANNELS:
        a, b = np.array(before[channel]), np.array(after[channel])
        if a.shape != b.shape:
            changes.append((channel, 0.0, float("inf")))
            continue
        change = np.abs(a - b)
        if change.max() > 0.0:
            first = int(np.argmax(change > 0.0)) * EVERY * 0.05
            changes.append((channel, first, float(change.max())))
    return changes


@pytest.mark.parametrize("name", MANOEUVRES)
def test_the_drive_is_the_recorded_one(name, request):
    stored = json.loads(FILE.read_text()) if FILE.exists() else {"drives": {}}
    now = record(name)
    before = stored["drives"].get(name)
    changes = moved(before, now) if before else [("all", 0.0, float("inf"))]
    told = "; ".join(f"{c} from {t:.1f} s by {most:.3g}" for c, t, most in changes)
    if request.config.getoption("--rewrite-references"):
        print(f"\n{name}: {told or 'nothing moved'}")
        stored["drives"][name] = now
        stored["fingerprint"] = fingerprint().short
        FILE.write_text(json.dumps(stored, indent=1))
        return
    if stored.get("fingerprint") != fingerprint().short:
        pytest.skip("recorded with another fingerprint, for which equal bytes are not promised")
    assert not changes, f"{name} moved: {told}"
