"""Lamps that a file switches: in pictures, in sight by night, in the run's folder and as OSI."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from skidpad.campaign.driving.outdoors import FileChanges
from skidpad.campaign.driving.run_setup import stage_of
from skidpad.cli.main import app
from skidpad.core.errors import FileError
from skidpad.core.inputs import Beam
from skidpad.core.run import Passenger
from skidpad.core.states import VehicleCommand
from skidpad.core.vocabulary import SensorLevel
from skidpad.recording.run.lamps import FILE, Lamp, LampChange, LampMode, read_lamps, write_lamps
from skidpad.scenarios.actions.lights import beam_of_ego
from skidpad.scenarios.reading.findings import ScenarioError
from skidpad.simulation.embedded.engine import EmbeddedBackend
from support.runs import scenario_run
from support.scenarios.files import (
    compiled,
    event,
    init,
    on_lane,
    private,
    speed,
    story,
    teleport,
    time,
    to,
    told,
    write,
)


def lamp(name: str, mode: str = "on", **more: object) -> str:
    flashing = "".join(f' {k}="{v}"' for k, v in more.items())
    return private(f"""<AppearanceAction><LightStateAction><LightType>
<VehicleLight vehicleLightType="{name}"/></LightType><LightState mode="{mode}"{flashing}/>
</LightStateAction></AppearanceAction>""")


def seen_by_ego(file: Path, ticks: int) -> list[np.ndarray]:
    """Front pictures of the ego by tick, everything as the file says."""
    spec = scenario_run(str(file), driver=Passenger(), sensors=SensorLevel.PIXELS)
    stage = stage_of(spec)
    assert stage.player is not None
    backend, changes = EmbeddedBackend(), FileChanges(stage.player, spec)
    frame = backend.reset(stage.setup, 1)
    pictures = []
    for _ in range(ticks):
        camera = next(id for id in frame.images if frame.images[id].rgb is not None)
        pictures.append(frame.images[camera].rgb.copy())
        words = stage.player.step(backend.truth())
        news = changes.news()
        if news is not None:
            backend.change(news)
        frame = backend.step(VehicleCommand(brake=1.0), words)
    return pictures


@pytest.mark.osc("LightStateAction", "AppearanceAction")
def test_brake_lamps_are_drawn_as_the_file_switches_them(tmp_path):
    """The car ahead stands; its lamps go on at 0.1 s and off at 0.2 s."""
    begins = init("ego", teleport(on_lane(-1, 100)), speed(to(0)))
    begins += init("other", teleport(on_lane(-1, 110)), speed(to(0)))
    events = (
        event("on", lamp("brakeLights"), time(0.075)),
        event("off", lamp("brakeLights", "off"), time(0.175)),
    )
    file = write(tmp_path, init=begins, stories=story(*events), minor=3)
    shown = seen_by_ego(file, 6)

    def red(picture):
        r, g, b = (picture[..., k].astype(int) for k in range(3))
        return int(((r > 150) & (g < 90) & (b < 90)).sum())

    on = [red(picture) for picture in shown]
    assert on[3] > on[5] + 20
    assert on[3] > 20


def test_flashing_begins_lit_and_keeps_its_times():
    change = LampChange(1.0, "a", Lamp.LEFT, LampMode.FLASHING, 0.4, 0.2)
    lit = [change.is_lit(1.0 + 0.05 * k) for k in range(24)]
    assert lit[:12] == [True] * 8 + [False] * 4
    assert lit[12:] == lit[:12]


def test_the_headlights_of_the_ego_follow_the_file(tmp_path):
    events = (
        event("high", lamp("highBeam"), time(0.975)),
        event("off", lamp("highBeam", "off"), time(1.975)),
        event("dark", lamp("lowBeam", "off"), time(2.975)),
    )
    scenario = compiled(tmp_path, stories=story(*events, actor="ego"), minor=3)
    assert scenario.findings == ()
    beams = {}
    for t in (0.5, 1.5, 2.5, 3.5):
        file_end = {"stories": story(*events, actor="ego"), "minor": 3, "end": t}
        beams[t] = beam_of_ego(told(tmp_path, **file_end).player.scene)
    assert beams == {0.5: None, 1.5: Beam.HIGH, 2.5: None, 3.5: Beam.OFF}


def test_the_folder_and_osi_have_the_lamps(tmp_path):
    osi3 = pytest.importorskip("osi3", reason="needs the extra osi")
    del osi3
    from osi3trace.osi_trace import OSITrace

    events = (
        event("left", lamp("indicatorLeft", "flashing"), time(0.475)),
        event("stop", lamp("brakeLights"), time(0.475)),
        event("low", lamp("lowBeam"), time(0.475)),
    )
    file = write(tmp_path, stories=story(*events), minor=3, end=1.5)
    run = tmp_path / "run"
    done = CliRunner().invoke(app, ["play", str(file), "--out", str(run), "--stack", "ideal"])
    assert done.exit_code == 0, done.output
    lines = (run / FILE).read_text().splitlines()
    assert lines[0] == "time,entity,lamp,mode,on,off"
    assert lines[1] == "0.500,other,indicatorLeft,flashing,0.5,0.5"
    assert len(read_lamps(run)) == 3
    trace = tmp_path / "run.osi"
    done = CliRunner().invoke(app, ["export", str(run), "--osi", str(trace)])
    assert done.exit_code == 0, done.output
    states = [
        m.moving_object[1].vehicle_classification.light_state
        for m in OSITrace(str(trace), "GroundTruth")
    ]
    kind = type(states[0])
    assert states[5].indicator_state == kind.INDICATOR_STATE_UNKNOWN
    assert states[12].indicator_state == kind.INDICATOR_STATE_LEFT
    assert states[22].indicator_state == kind.INDICATOR_STATE_OFF
    assert states[12].brake_light_state == kind.BRAKE_LIGHT_STATE_NORMAL
    assert states[12].head_light == kind.GENERIC_LIGHT_STATE_ON


def test_a_run_that_switches_no_lamp_has_no_file_of_them(tmp_path):
    write_lamps(tmp_path, ())
    assert not (tmp_path / FILE).exists()
    assert read_lamps(tmp_path) == ()
    (tmp_path / FILE).write_text("time,entity,lamp,mode,on,off\n1,a,sun,on,0.5,0.5\n")
    with pytest.raises(FileError, match=r"lamps\.csv.*sun"):
        read_lamps(tmp_path)
    (tmp_path / FILE).write_text(f"time,entity,lamp,mode,on,off\n{'1' * 200_000}\n")
    with pytest.raises(FileError, match=r"lamps\.csv.*field larger"):
        read_lamps(tmp_path)


@pytest.mark.parametrize(
    ("action", "told_so"),
    [
        (lamp("brakeLights", "dim"), "mode"),
        (lamp("headlamp"), "vehicleLightType"),
        (
            lamp("brakeLights", "flashing", flashingOnDuration=0),
            "flashingOnDuration must be above 0 and at most 3600 s, got 0",
        ),
    ],
)
def test_a_lamp_that_means_nothing_is_one_sentence(tmp_path, action, told_so):
    with pytest.raises(ScenarioError, match=told_so):
        compiled(tmp_path, stories=story(event("e", action, time(1))), minor=3)
