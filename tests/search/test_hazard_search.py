"""`skidpad search --from`: a recorded near miss of two ways that cross, and what makes it a crash."""

import numpy as np
import pytest
from typer.testing import CliRunner

from skidpad.cli.main import app
from skidpad.core.errors import InputError
from skidpad.core.vocabulary import HazardType
from skidpad.recording.campaign.searches import read_hazard, read_search, read_trials
from skidpad.recording.channels.cycles import cycles
from skidpad.recording.hazards.records import HazardRecord, HazardWriter, encode_record
from skidpad.recording.hazards.searched import read_searches
from skidpad.scenarios.export.hazard_export import export_hazard
from skidpad.search.hazard import prepare_scene
from support.channel_worlds import Eyes, World, drive

# The ego is at x = 49 after 4.9 s. The other comes from the right at 12 m/s and is there after 4 s.
CROSSING = World(
    ego=(0.0, 0.0, 0.0, 10.0, 0.0), objects=np.array([[49.0, -48.0, np.pi / 2, 0.0, 12.0]])
)
CALL = ("--stack", "4", "--budget", "16", "--method", "halton", "--workers", "1", "--duration", "7")


def record(world=CROSSING, id="h0001", seconds=9.0, **context):
    seen = cycles(drive(world, (Eyes("lav"),), seconds))
    return HazardRecord(
        id=id, type=HazardType.CROSSING_OBJECT, profile="practical", forms="corrected",
        t_start=4.0, t_end=5.0, t_worst=4.5, count=11, extremes={}, channels=("lav",),
        driving="lav", involved=("lav",), context=context,
        worlds=tuple(c._replace(truth=None) for c in seen),
    )  # fmt: skip


def write(folder, *records):
    with HazardWriter(folder) as writer:
        for one in records:
            writer.write(one)
    return folder


def search(*call):
    return CliRunner().invoke(app, ["search", *map(str, call)], catch_exceptions=False)


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    folder = tmp_path_factory.mktemp("hazard")
    source = write(folder / "monitor", record())
    exposure = folder / "exposure.yaml"
    exposure.write_text("variables: {OthersPace: {law: 'normal(1,0.1,0.8:1.2)'}}\n")
    call = ("--from", source, *CALL, "--exposure", exposure, "--out", folder / "out")
    found = search(*call)
    assert found.exit_code == 0, found.output
    return folder / "out", found.stdout, call


def test_the_scene_is_as_recorded_and_a_change_of_half_a_second_makes_it_a_crash(done):
    out, text, _ = done
    hazard = read_hazard(out)
    assert hazard.title == "h0001 (crossing_object)"
    assert not hazard.recorded.fault
    assert hazard.recorded.contact_kmh is None
    # when the other's tail leaves the ego's lane (y = 0.9 + 2.25, 4.26 s), the ego's front is at 44.9
    # and the other's side at 48.1
    assert 2.5 < hazard.recorded.min_gap_m < 3.5
    assert hazard.driven.is_harmless
    assert hazard.failing.is_failure
    assert hazard.failing.other == "lav_1"
    assert hazard.changes
    assert {c.name for c in hazard.changes} <= {"EgoSpeed", "EgoAhead", "OthersPace"}
    earlier = {c.name: float(c.failing) - float(c.harmless) for c in hazard.changes}
    assert (
        earlier.get("EgoSpeed", 0) > 0
        or earlier.get("EgoAhead", 0) > 0
        or earlier["OthersPace"] < 0
    )
    assert 0.0 < hazard.likelihood <= 1.0
    assert "h0001 (crossing_object): as recorded the least gap was" in text
    assert "It would have been a crash with" in text
    assert "times as likely as the likeliest ones" in text
    (sentence, crash, likely) = read_searches(out.parent / "monitor")["h0001"]
    assert all(told in text for told in (sentence, crash, likely))
    assert "The hazard" in (out / "report.html").read_text(encoding="utf-8")


def test_what_varies_lies_around_what_was_recorded(done):
    out, _, _ = done
    laws = {v.name: v.law for v in read_search(out).space.variables}
    assert laws["EgoSpeed"].range == pytest.approx((8.0, 12.0))
    assert laws["EgoAhead"].range == pytest.approx((-10.0, 10.0))
    assert laws["OthersPace"].mean == 1.0
    assert len(read_trials(out)) == 16


def test_it_resumes_to_the_same(done):
    _, text, call = done
    assert search(*call, "--resume").stdout == text


def test_an_exported_file_is_the_same_scene(tmp_path):
    exported, _ = export_hazard(record(), tmp_path / "given")
    one = prepare_scene(exported, None, tmp_path / "a")
    other = prepare_scene(write(tmp_path / "monitor", record()), None, tmp_path / "b")
    text = tmp_path / "record.txt"
    text.write_text(encode_record(record()))
    assert prepare_scene(text, None, tmp_path / "c").values == one.values == other.values
    assert one.variables == other.variables
    assert one.values["EgoSpeed"] == pytest.approx(10.0)


def test_bad_input_is_one_sentence_and_leaves_nothing(tmp_path):
    two = write(tmp_path / "two", record(), record(id="h0002"))
    none, alone = write(tmp_path / "none"), write(tmp_path / "alone", record(World()))
    bend = World(ego=(0.0, 0.0, 0.0, 10.0, 0.0), objects=CROSSING.objects)
    bent = record(bend)
    for k, cycle in enumerate(bent.worlds):
        cycle.frames[0].ego[1] = 0.001 * k**2
    bent = write(tmp_path / "bent", bent)
    plain = tmp_path / "plain.xosc"
    plain.write_text("<OpenSCENARIO><Entities/></OpenSCENARIO>")
    damaged = tmp_path / "damaged.txt"
    damaged.write_text(encode_record(record())[:-40])
    for call, complaint in (
        (["--from", damaged], "is no record of a hazard"),
        (["--from", damaged, "--hazard", "h1"], "is one record"),
        (["--from", two], "has 2 hazards: give --hazard h0001|h0002"),
        (["--from", two, "--hazard", "h9"], "--hazard h9:"),
        (["--from", none], "no hazard was found in this drive"),
        (["--from", alone], "has no other road user that could be met"),
        (["--from", bent], "leaves a straight line by"),
        (["--from", tmp_path / "nothing"], "is no hazard; give a folder of `skidpad monitor`"),
        (["--from", plain], "has no ego"),
        (["ghost_cut_in", "--from", two], "give FILE or --from"),
        ([], "give FILE or --from"),
        (["ghost_cut_in", "--hazard", "h1"], "--hazard chooses one of --from"),
    ):
        with pytest.raises(InputError) as caught:
            search(*call, "--out", tmp_path / "out")
        assert complaint in str(caught.value)
        assert "\n" not in str(caught.value)
        assert not (tmp_path / "out" / "search.json").exists()
