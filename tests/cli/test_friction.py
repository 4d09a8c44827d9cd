from itertools import pairwise
from unittest.mock import Mock

import matplotlib as mpl
import pytest
from PIL import Image
from typer.testing import CliRunner

from skidpad.cli.lookup.friction_figure import draw_figure, draw_surface
from skidpad.cli.main import app, main
from skidpad.core.vocabulary import GripModel
from skidpad.physics.presets import find_weather
from skidpad.physics.stopping import grip_rows

runner = CliRunner(env={"COLUMNS": "100"})


def row(output, name):
    """Cells of the printed row of one weather."""
    line = next(line for line in output.splitlines() if line.startswith(f"{name} "))
    return line.split()[-10:]


@pytest.mark.parametrize("words", [["--table"], ["--preset", "icy_30"], ["--preset", "rain-noon"]])
def test_nothing_is_wider_than_a_terminal(words):
    output = CliRunner().invoke(app, ["friction", *words]).output
    assert [line for line in output.splitlines() if len(line) > 80] == []
    assert "Next: skidpad" in output.splitlines()[-1]


def test_the_answer_comes_first():
    lines = runner.invoke(app, ["friction", "--preset", "rain_60"]).output.splitlines()
    assert lines[0] == "80 km/h: stop in 46 m, 28 m dry. The published model says 76 m."
    assert lines[1] == "On the road: 0.9 mm of water."
    cells = row("\n".join(lines), "rain_60")
    assert lines[0].startswith(f"80 km/h: stop in {float(cells[8]):.0f} m")
    flooded = runner.invoke(app, ["friction", "--preset", "rain-noon"]).output.splitlines()
    assert flooded[1].startswith("On the road: 1.6 mm of water: flooded")
    ice = runner.invoke(app, ["friction", "--preset", "icy_70"]).output
    assert "Ice of 2 mm is a sheet already" in ice


def test_a_summer_tyre_stops_as_measured():
    summer = runner.invoke(app, ["friction", "--mu-ref", "summer"]).output
    winter = runner.invoke(app, ["friction", "--mu-ref", "winter"]).output
    assert row(summer, "as given")[9] == "38.5"
    assert row(winter, "as given")[9] == "44.4"
    assert runner.invoke(app, ["friction", "--mu-ref", "1.05"]).output == summer
    wrong = runner.invoke(app, ["friction", "--mu-ref", "bald"])
    assert "mu_ref must be a number between 0.05 and 3, winter or summer" in str(wrong.exception)


def test_worn_and_winter_tyres_are_asked_for_by_name():
    at = {name: float(row(runner.invoke(app, ["friction", "--preset", "rain_60", "--tyres", name]).output,
                          "rain_60")[8]) for name in ("winter", "winter_4mm", "summer_1.6mm")}  # fmt: skip
    assert at["winter"] < at["winter_4mm"] < at["summer_1.6mm"]
    plain = runner.invoke(app, ["friction", "--wetness", "100"]).output
    assert runner.invoke(app, ["friction", "--wetness", "100", "--tyres", "winter"]).output == plain
    wrong = runner.invoke(app, ["friction", "--tyres", "slick"])
    assert "unknown tyres 'slick'; choose one of: all_season" in str(wrong.exception)


@pytest.mark.parametrize("tyres", ["summer", "summer_1.6mm"])
def test_the_ratio_is_a_share_of_the_same_tyres_dry_grip(tyres):
    """Also of a tyre that grips more than the winter tyre when dry: no rain leaves more than all."""
    weathers = [find_weather("clear-noon"), find_weather("rain_60")]
    dry, wet = grip_rows(weathers, [GripModel.PHYSICAL], tyres=tyres)
    assert wet.ratio < dry.ratio
    assert dry.ratio == pytest.approx(1.0, abs=0.1)
    assert wet.ratio / dry.ratio == pytest.approx(wet.mu / dry.mu)


def test_both_models_stand_beside_each_other():
    result = runner.invoke(app, ["friction", "--wetness", "40", "--deposits", "40"])
    assert result.exit_code == 0
    cells = row(result.output, "as given")
    assert cells[0] == "0.450"
    assert float(cells[5]) > 0.7
    assert "0.34 on packed snow" in result.output


@pytest.mark.req("B-031")
def test_ice_and_presets():
    by_hand = runner.invoke(app, ["friction", "--ice", "30"]).output
    by_name = runner.invoke(app, ["friction", "--preset", "icy-30"]).output
    assert row(by_hand, "as given") == row(by_name, "icy_30")
    assert row(by_name, "icy_30")[0] == "0.315"


def test_table_has_every_preset():
    output = runner.invoke(app, ["friction", "--table"]).output
    assert row(output, "rain_100")[0] == "0.300"
    assert row(output, "snow")[:5] == ["-"] * 5
    assert "snow: the statistical model is not defined" in output


@pytest.fixture(scope="module")
def panels():
    mpl.use("Agg")
    from matplotlib import pyplot as plt

    figure = plt.figure()
    draw_figure(figure, 0.9)
    yield figure.axes
    plt.close(figure)


@pytest.mark.req("B-041")
def test_the_curves_are_the_ratio_over_wetness_and_over_rain_at_three_levels_of_the_other(panels):
    """By hand: puddles cost a tenth in all, full wetness leaves 0.4 and full ice 0.15 of 1."""
    over_wetness, over_rain, *_ = panels
    for axes, label, slope in (
        (over_wetness, "rain, deposits {} %", None), (over_rain, "wetness {} %", -0.001)
    ):  # fmt: skip
        lines = {line.get_label(): line for line in axes.lines}
        for level in (0, 50, 100):
            x, y = lines[label.format(level)].get_data()
            assert (x[0], x[-1], len(x)) == (0.0, 100.0, 51)
            if slope is None:
                assert (y[0], y[-1]) == pytest.approx((1.0 - level / 1000, 0.4 - level / 1000))
                assert all(a > b for a, b in pairwise(y))
            else:
                assert [b - a for a, b in pairwise(y)] == pytest.approx([2 * slope] * 50)
        assert axes.get_ylabel() == "ratio of dry grip"
    assert over_rain.lines[0].get_ydata()[0] == pytest.approx(1.0)
    assert over_rain.lines[2].get_ydata()[-1] == pytest.approx(0.3)
    ice = over_wetness.lines[3].get_ydata()
    assert (ice[0], ice[-1]) == pytest.approx((1.0, 0.15), abs=1e-3)


@pytest.mark.req("B-041")
def test_the_surface_stands_over_wetness_and_deposits_with_its_height_named(panels):
    surface = panels[2]
    assert (surface.get_xlabel(), surface.get_ylabel(), surface.get_zlabel()) == (
        "wetness, %", "deposits, %", "ratio of dry grip"
    )  # fmt: skip
    axes = Mock()
    draw_surface(axes)
    w, p, ratio = axes.plot_surface.call_args.args
    drawn = dict(zip(zip(w.ravel(), p.ravel(), strict=True), ratio.ravel(), strict=True))
    corners = {(0, 0): 1.0, (0, 100): 0.9, (100, 0): 0.4, (100, 100): 0.3}
    assert {corner: drawn[corner] for corner in corners} == pytest.approx(corners)
    assert len(drawn) == 121


@pytest.mark.req("B-041")
def test_the_speed_panel_has_a_curve_per_weather_and_the_measured_levels(panels):
    speeds = panels[3]
    named = {line.get_label() for line in speeds.lines}
    assert {"rain_20", "rain_40", "rain_100", "snow", "icy_30"} <= named
    assert {t.get_text() for t in speeds.texts} == {
        "wet braking test", "packed snow test", "ice test"
    }  # fmt: skip


@pytest.mark.req("B-041")
def test_figure(tmp_path):
    path = tmp_path / "grip.png"
    assert runner.invoke(app, ["friction", "--plot", str(path)]).exit_code == 0
    assert Image.open(path).size[0] > 800


@pytest.mark.req("B-002", "B-010")
@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["--ice", "30", "--deposits", "10"], "ice_thickness 30"),
        (["--preset", "hail"], "unknown weather 'hail'"),
        (["--plot", "/nowhere/at/all.png"], "cannot write"),
    ],
)
def test_bad_input_is_one_sentence_and_exit_two(arguments, text, monkeypatch, capsys):
    monkeypatch.setattr("sys.argv", ["skidpad", "friction", *arguments])
    with pytest.raises(SystemExit) as stop:
        main()
    assert stop.value.code == 2
    message = capsys.readouterr().err.strip()
    assert text in message
    assert "\n" not in message


@pytest.mark.req("B-010")
@pytest.mark.parametrize("value", ["-1", "101", "nan"])
def test_percent_outside_its_range(value):
    assert runner.invoke(app, ["friction", "--wetness", value]).exit_code != 0
