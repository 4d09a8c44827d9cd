"""One drive in several weathers: what the weather cannot move is one drive (decision T-3)."""

from __future__ import annotations

from skidpad.campaign.runs.run import run
from skidpad.recording.run.motion import motion_hash
from support.runs import adas_run


def test_times_of_day_are_one_drive_and_rain_is_another() -> None:
    logs = {
        weather: run(adas_run(3, weather, duration=4.0, vehicles=4)).log
        for weather in ("clear-noon", "clear-night", "rain-night")
    }
    hashes = {weather: motion_hash(log) for weather, log in logs.items()}
    assert hashes["clear-noon"] == hashes["clear-night"] != hashes["rain-night"]
