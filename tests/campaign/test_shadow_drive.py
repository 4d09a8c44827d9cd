"""A driver that does not drive: the same world, every frame, no influence; on exported hazards, too."""

from __future__ import annotations

import numpy as np
import pytest
from typer.testing import CliRunner

from skidpad.campaign.runs.play import run_to
from skidpad.campaign.runs.shadow import Shadowed, ride_along
from skidpad.cli.main import app
from skidpad.cli.runs.shadow import lines
from skidpad.core.errors import ConfigError
from skidpad.core.run import AdasDriver, Passenger, ReferenceDriver
from skidpad.core.vocabulary import HazardType
from skidpad.evidence.shadow import Foresight
from skidpad.recording.channels.cycles import cycles
from skidpad.recording.hazards.records import HazardRecord
from skidpad.recording.run.log_files import read_log
from skidpad.scenarios.export.hazard_export import export_hazard
from skidpad.scenarios.export.version import OscVersion
from skidpad.stack.configurations import functions_of
from support.channel_worlds import Eyes, World
from support.channel_worlds import drive as drive_channels
from support.runs import adas_run, scenario_run

REFERENCE = ReferenceDriver()
NO_ADAS = AdasDriver(label="0", functions=functions_of(0))


@pytest.mark.req("C-010")
def test_a_shadow_sees_the_same_drive_and_changes_nothing(tmp_path):
    run_to(adas_run(4, duration=12.0, seed=3), tmp_path / "run")
    found = ride_along(tmp_path / "run", REFERENCE)
    assert found.same
    assert 0.0 < found.share_apart < 1.0
    told = lines(found, "4", "reference")
    assert told[0].startswith("reference in the shadow of 4: one braked")
    again = ride_along(tmp_path / "run", AdasDriver(label="4", functions=functions_of(4)))
    assert again.same
    assert (again.share_apart, again.partings) == (0.0, ()), "its own shadow does what it does"


@pytest.mark.req("C-010")
def test_a_shadow_brakes_before_the_contact_that_the_driver_did_not_see(tmp_path):
    run_to(adas_run(0, duration=40.0, seed=1), tmp_path / "run")
    found = ride_along(tmp_path / "run", REFERENCE)
    assert found.contacts, "configuration 0 runs into the traffic ahead"
    first = found.contacts[0]
    assert first.driver is None
    assert first.shadow is not None
    assert first.shadow > 0.5
    assert any("did not brake, reference braked" in line for line in lines(found, "0", "reference"))


@pytest.mark.req("C-010")
def test_what_drives_no_stack_has_no_shadow(tmp_path):
    run_to(adas_run(1, duration=1.0), tmp_path / "run")
    with pytest.raises(ConfigError, match="shadow"):
        ride_along(tmp_path / "run", Passenger())


def exported(tmp_path, seconds: float = 8.0):
    """The file of a scene in which the ego closes in on a slow car, as one channel saw it."""
    world = World(ego=(0.0, 0.0, 0.0, 16.0, 0.0), objects=np.array([[70.0, 0.0, 0.0, 5.0, 0.0]]))
    seen = cycles(drive_channels(world, (Eyes("lav", 0.02),), seconds))
    record = HazardRecord(
        id="h0001", type=HazardType.EGO_TAILGATING, profile="tracked", forms="corrected",
        t_start=3.0, t_end=5.0, t_worst=4.5, count=11, extremes={}, channels=("lav",),
        driving="lav", involved=("lav",), context={},
        worlds=tuple(c._replace(truth=None) for c in seen),
    )  # fmt: skip
    scenario, _ = export_hazard(record, tmp_path / "hazard", OscVersion.V1_0)
    return scenario


def least_gap(folder) -> float:
    """m between the centres of the ego and the nearest other actor, at the worst."""
    a = read_log(folder).actors
    return float(np.hypot(a.x[:, 1:] - a.x[:, :1], a.y[:, 1:] - a.y[:, :1]).min())


@pytest.mark.req("C-010", "C-197")
def test_an_exported_hazard_is_driven_by_another_driver_and_watched_by_a_shadow(tmp_path):
    """The mitigation is tried on the scene that was found: who minds the slow car does not reach it."""
    file = exported(tmp_path)
    for name, driver in (("as_found", Passenger()), ("reference", REFERENCE), ("0", NO_ADAS)):
        run_to(scenario_run(file, driver=driver, duration=8.0), tmp_path / name)
    assert least_gap(tmp_path / "as_found") < 4.5, "the recorded ego drives into it"
    assert least_gap(tmp_path / "reference") > 6.0
    found = ride_along(tmp_path / "0", REFERENCE)
    assert found.same
    assert any(one.shadow_brakes for one in found.partings)


def test_the_command_says_it_in_sentences(tmp_path):
    run_to(adas_run(4, duration=2.0), tmp_path / "run")
    told = CliRunner().invoke(app, ["shadow", str(tmp_path / "run")])
    assert told.exit_code == 0, told.output
    assert "reference in the shadow of 4" in told.output
    assert lines(Shadowed(True, 0.5, (), (Foresight(9.0, None, 6.0),)), "a", "b")[1] == (
        "contact at 9.00 s: a did not brake, b braked at least 6.00 s before"
    )
