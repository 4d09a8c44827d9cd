"""Playing files: outcomes, what is written, drops on the lens without a touch of friction."""

from __future__ import annotations

import numpy as np
import pytest

from skidpad.campaign.runs.play import run_to
from skidpad.campaign.runs.run import run
from skidpad.core.courses import ActorMode, Scenario
from skidpad.core.errors import OutputError
from skidpad.core.run import AgentDriver
from skidpad.core.vocabulary import GripModel, Outcome, SensorLevel
from skidpad.core.weather import Weather
from skidpad.recording.run.log_files import log_hash, read_log
from skidpad.scenarios.shipped import FOLDER
from support.runs import scenario_run

FILE = FOLDER / "lead_slowdown.xosc"
SHORT = scenario_run(FILE, duration=1.0)
WATCHER = """
import numpy as np
from types import SimpleNamespace
SEEN = []
class Watcher:
    def setup(self, path): SEEN.clear()
    def sensors(self):
        return [{'type': 'sensor.camera.rgb', 'id': 'eye', 'x': 1.2, 'z': 1.3, 'width': 160,
                 'height': 120, 'fov': 90}]
    def run_step(self, data, timestamp):
        SEEN.append(data['eye'][1].copy())
        return SimpleNamespace(throttle=0.2, brake=0.0, steer=0.0)
"""


@pytest.mark.req("L-6", "X-1")
def test_a_run_is_written_and_repeats_to_the_byte(tmp_path):
    first = run_to(SHORT, tmp_path / "one")
    assert first.outcome is Outcome.NOT_TRIGGERED  # too short for the lead to slow
    assert log_hash(read_log(tmp_path / "one")) == log_hash(run(SHORT).log)
    assert "lead_slowdown" in (tmp_path / "one" / "config.yaml").read_text(encoding="utf-8")
    with pytest.raises(OutputError, match="not empty"):
        run_to(SHORT, tmp_path / "one")


@pytest.mark.req("B-160", "B-161")
def test_drops_on_the_lens_change_images_and_nothing_else(tmp_path):
    (tmp_path / "watcher.py").write_text(WATCHER, encoding="utf-8")
    seen, logs = {}, {}
    for overlay in (False, True):
        for grip in (GripModel.NONE, GripModel.STATISTICAL):
            spec = scenario_run(
                FILE, grip.value, weather=Weather(precipitation=80.0, wetness=80.0),
                duration=0.2, driver=AgentDriver(f"{tmp_path / 'watcher.py'}:Watcher"),
                sensors=SensorLevel.PIXELS, overlay=overlay,
            )  # fmt: skip
            logs[overlay, grip] = run(spec).log
            import sys

            module = sys.modules["skidpad_user_agent_watcher"]
            seen[overlay, grip] = np.array(module.SEEN)
    none, reduced = GripModel.NONE, GripModel.STATISTICAL
    assert (seen[False, none][0] != seen[True, none][0]).any()
    assert (seen[True, none][0] == seen[True, reduced][0]).all()
    for grip in (none, reduced):
        assert log_hash(logs[False, grip]) == log_hash(logs[True, grip])
    assert logs[True, reduced].mu[-1, 0, 0] < logs[True, none].mu[-1, 0, 0]


@pytest.mark.req("B-062")
def test_an_ideal_lead_stops_on_ice_as_if_it_were_dry():
    far = {}
    for mode in ActorMode:
        spec = scenario_run(
            FILE, "statistical", weather=Weather(ice_thickness=100.0),
            course=Scenario(actors=mode), duration=12.0,
        )  # fmt: skip
        far[mode] = float(run(spec).log.actors.x[-1, 1])
    assert far[ActorMode.PHYSICAL] > far[ActorMode.IDEAL] + 20.0
