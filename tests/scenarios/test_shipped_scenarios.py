"""The shipped scenarios: they are what their source says, and the ASAM checkers accept them."""

from __future__ import annotations

import subprocess
from pathlib import Path

import numpy as np
import pytest
from lxml import etree

from scenario_catalogue import SCENARIOS, file_name, write
from skidpad.roads.bundled import FOLDER as MAPS
from skidpad.scenarios.export.version import OscVersion
from skidpad.scenarios.reading.findings import Kind
from skidpad.scenarios.scenario import check
from skidpad.scenarios.shipped import FOLDER, NAMES
from skidpad.scenarios.variation import (
    CUT_IN,
    CutIn,
    drawn_parameters,
    drawn_skill,
    variant_parameters,
    variations,
)
from support.asam import asam_verdicts, require_asam_python

FILES = [FOLDER / file_name(s.name, v) for s in SCENARIOS for v in OscVersion]


@pytest.mark.req("B-090", "B-091", "B-092")
def test_the_files_are_what_their_source_writes(tmp_path):
    for path in write(tmp_path):
        assert path.read_bytes() == (FOLDER / path.name).read_bytes(), path.name


@pytest.mark.req("B-090", "B-091", "B-092")
def test_the_asam_checkers_accept_every_file():
    verdicts = asam_verdicts(*FILES)
    for path in FILES:
        verdict = verdicts[str(path)]
        assert verdict["issues"] == [], path.name
        assert any("valid_schema" in c for c in verdict["completed"]), path.name
        if "_1.0" not in path.name:
            assert verdict["skipped"] == [], path.name


@pytest.mark.req("B-090", "M-15")
def test_the_asam_checkers_accept_every_map():
    maps = sorted([*MAPS.glob("*.xodr"), *FOLDER.glob("*.xodr")])
    verdicts = asam_verdicts(*maps)
    for path in maps:
        verdict = verdicts[str(path)]
        assert verdict["issues"] == [], path.name
        assert "check_asam_xodr_xml_valid_schema" in verdict["completed"], path.name
        # made for OpenDRIVE 1.8 and later
        later = ["check_asam_xodr_junctions_connection_one_link_to_incoming"]
        assert verdict["skipped"] == later, path.name


def test_the_1_0_files_are_valid_by_the_schema_of_1_0():
    ask = "import qc_openscenario, pathlib; print(pathlib.Path(qc_openscenario.__file__).parent)"
    done = subprocess.run(
        [require_asam_python(), "-c", ask], capture_output=True, text=True, check=True
    )
    folder = Path(done.stdout.strip()) / "schema" / "1.0.0"
    schema = etree.XMLSchema(etree.parse(str(next(folder.glob("*.xsd")))))
    for path in FILES:
        assert schema.validate(etree.parse(str(path))) == ("_1.0" in path.name), path.name


@pytest.mark.parametrize("scenario", SCENARIOS, ids=lambda s: s.name)
def test_the_1_0_files_hold_what_scenario_runner_can_play(scenario):
    root = etree.parse(str(FOLDER / file_name(scenario.name, OscVersion.V1_0)))
    values = {p.get("name"): float(p.get("value")) for p in root.iter("ParameterDeclaration")}
    for dynamics in root.iter("LaneChangeActionDynamics"):
        assert dynamics.get("dynamicsDimension") == "distance"
        length = dynamics.get("value")[1:]
        v = values["GhostSpeed" if scenario.name == "ghost_cut_in" else "SecondSpeed"]
        time = scenario.parameters[length.replace("Length", "Time")]
        assert values[length] == pytest.approx(v * time)
    last = next(e for e in root.iter("Event") if e.get("name") == "rest")
    assert [c.get("delay") for c in last.iter("Condition")] == ["0.0"]
    judged = [c for c in root.iter("Condition") if c.get("name").startswith("criteria_")]
    assert [c.get("name") for c in judged] == ["criteria_CollisionTest"]
    for asked in judged[0].iter("ParameterCondition"):  # by the standard it never holds
        assert asked.get("rule") == "lessThan"
        assert values[asked.get("parameterRef")] >= float(asked.get("value"))


@pytest.mark.parametrize("path", FILES, ids=lambda p: p.name)
def test_the_player_supports_everything_in_them(path):
    found = check(path)
    assert {f.kind for f in found.findings} <= {Kind.NOTE}  # ScenarioRunner's criterion
    assert found.scenario is not None
    assert found.scenario.ego == "ego"


@pytest.mark.req("B-092", "B-093")
def test_one_other_vehicle_in_two_scenarios_and_two_in_the_third():
    others = {s.name: len(s.actors) - 1 for s in SCENARIOS}
    assert others == {"ghost_cut_in": 1, "lead_slowdown": 1, "front_accident": 2}


@pytest.mark.req("X-8")
@pytest.mark.parametrize("name", NAMES)
def test_a_seed_draws_every_varied_parameter_from_its_own_stream(name):
    nominal = dict(next(s for s in SCENARIOS if s.name == name).parameters)
    if name == CUT_IN:
        nominal |= variant_parameters(CutIn.FIXED)
    draws = [drawn_parameters(name, seed) for seed in range(40)]
    assert draws[3] == drawn_parameters(name, 3)
    for parameter, spread in variations()[name].items():
        values = np.array([d[parameter] for d in draws])
        reach = spread.gap + 2.5 * spread.spread * nominal[parameter]
        assert values.std() > 0.0
        assert np.abs(values - nominal[parameter]).max() <= reach + 1e-9
    rolls = name != CUT_IN
    assert all((d["CruiseSpeed"] == d["EgoSpeed"]) is rolls for d in draws)
    skills = [drawn_skill(name, seed)["ego"] for seed in range(40)]
    assert 0.5 < min(skills) < 1.0 < max(skills) < 1.5


@pytest.mark.req("B-074", "B-075")
def test_variants_differ_in_delay_and_distance_only():
    original, unfixed, fixed = map(variant_parameters, (CutIn.ORIGINAL, CutIn.UNFIXED, CutIn.FIXED))
    assert {k for k in original if original[k] != unfixed[k]} == {"GhostS"}
    assert {k for k in fixed if fixed[k] != unfixed[k]} == {"MergeDistance"}
    assert fixed["MergeDistance"] < unfixed["MergeDistance"]
    assert unfixed["GhostS"] == pytest.approx(original["GhostS"] - 40 * 0.05 * 24.0)
    assert original["EgoSpeed"] == 0.0


@pytest.mark.req("B-074", "B-078")
def test_the_file_of_the_cut_in_is_the_repaired_variant():
    shipped = next(s for s in SCENARIOS if s.name == CUT_IN).parameters
    repaired = variant_parameters(CutIn.FIXED)
    assert {k: shipped[k] for k in repaired} == pytest.approx(repaired)
