import sys

import numpy as np
import pytest
from shapely import Polygon, affinity
from typer.testing import CliRunner

from skidpad.cli.main import app
from skidpad.core.errors import MissingExtra
from skidpad.recording.channels.mcap_files import ChannelWriter
from skidpad.report.channels.viewer import outline, require_rerun
from support.channel_worlds import CAR, Eyes, World, drive, traffic


@pytest.fixture
def recording(tmp_path):
    source = drive(World(objects=traffic(4)), (Eyes("a"), Eyes("b", blind=(1,))), 1.0, False)
    with ChannelWriter(tmp_path / "d.mcap", source.channels) as writer:
        for channel, item in source.rows:
            writer.add(item, channel)
    return tmp_path / "d.mcap"


def test_an_outline_is_the_shape_at_its_place():
    state = np.array([3.0, -2.0, 0.7, 0.0, 0.0])
    there = affinity.rotate(Polygon(CAR), 0.7, origin=(0, 0), use_radians=True)
    there = affinity.translate(there, 3.0, -2.0)
    assert Polygon(outline(state, CAR)).symmetric_difference(there).area < 1e-9


def test_without_rerun_the_install_line_is_given(recording, monkeypatch):
    monkeypatch.setitem(sys.modules, "rerun", None)
    with pytest.raises(MissingExtra, match=r"\[view\]"):
        require_rerun()


def test_a_recording_is_written_for_the_viewer(recording, tmp_path):
    pytest.importorskip("rerun", reason="needs the extra view")
    done = CliRunner().invoke(app, ["view", str(recording), "--save", str(tmp_path / "d.rrd")])
    assert done.exit_code == 0, done.output
    assert "11 cycles of a, b" in done.output
    content = (tmp_path / "d.rrd").read_bytes()
    for path in (b"worlds/a/objects", b"worlds/b/plan", b"indicators/object_count_similarity/a-b"):
        assert path in content
