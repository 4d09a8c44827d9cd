"""`skidpad profiles sensors`: the published places, fields and ranges, printed and drawn."""

from math import radians, tan

import matplotlib as mpl
import numpy as np
import pytest
from PIL import Image
from typer.testing import CliRunner

from skidpad.cli.lookup.sensors import CAMERA_REACH, draw_layout, sensor_rows
from skidpad.cli.main import app

runner = CliRunner(env={"COLUMNS": "80"})


@pytest.mark.req("A-018", "A-028")
def test_every_sensor_is_printed_with_its_place_and_what_it_covers():
    """The radar of the source: 2 m ahead, 1 m up, 30 degrees, 150 m; its mirrors look back outwards."""
    lines = runner.invoke(app, ["profiles", "sensors"]).output.splitlines()
    assert max(map(len, lines)) <= 80
    cells = {line.split()[0]: line.split()[1:] for line in lines}
    assert cells["radar_front"] == ["2.00", "0.00", "1.00", "0", "0", "30", "150", "m"]
    left, right = cells["rgb_mirror_left"], cells["rgb_mirror_right"]
    assert left[1:5] == ["0.80", "1.30", "140", "0"]
    assert (right[1], right[3]) == ("-0.80", "-140")
    assert cells["rgb_top"][4] == "90", "looks down"
    assert len(lines) == 1 + len(sensor_rows())


@pytest.mark.req("A-018", "A-028")
def test_the_layout_has_each_sensor_at_its_place_with_its_field_of_view():
    mpl.use("Agg")
    from matplotlib import pyplot as plt

    figure = plt.figure()
    axes = figure.add_subplot()
    draw_layout(axes)
    rows = {r.name: r for r in sensor_rows()}
    assert {name for t in axes.texts for name in t.get_text().split("\n")} == set(rows)
    assert {t.xy for t in axes.texts} == {(r.x, r.y) for r in rows.values()}
    level = [r for r in rows.values() if abs(r.pitch_deg) < 80.0]
    assert len(axes.patches) == len(level)
    field = axes.patches[level.index(rows["radar_front"])].get_xy()
    edge = CAMERA_REACH * tan(radians(15.0))
    corners = np.array([[2.0, 0.0], [2.0 + CAMERA_REACH, edge], [2.0 + CAMERA_REACH, -edge]])
    assert field[:3] == pytest.approx(corners)
    plt.close(figure)


@pytest.mark.req("A-018")
def test_the_layout_is_written_as_a_picture(tmp_path):
    path = tmp_path / "layout.png"
    done = runner.invoke(app, ["profiles", "sensors", "--plot", str(path)])
    assert done.exit_code == 0
    assert Image.open(path).size == (800, 600)
