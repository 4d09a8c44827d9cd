"""What a crash card says of the speed envelope."""

import pytest

from skidpad.recording.run.readings import RecordedSensor, tabulate_readings, write_readings
from skidpad.report.crashes.envelope import describe_allowed, draw_allowed, read_allowed

DT = 0.05
UNITS = "m/s, m; binding: 0 none, 1 sight, 2 lead"


def recorded(folder, title, rows, kind="envelope"):
    """rows: km/h allowed, km/h driven, number of the lowest limit, one each tick."""
    sensor = RecordedSensor("envelope", kind, title, UNITS)
    table = [
        {
            "tick": k,
            "envelope.speed_mps": limit / 3.6,
            "envelope.ego_mps": v / 3.6,
            "envelope.binding": b,
        }
        for k, (limit, v, b) in enumerate(rows)
    ]
    write_readings(folder, tabulate_readings({"envelope": sensor}, table))
    return read_allowed(folder, DT)


def test_a_card_says_what_the_envelope_would_have_allowed_and_what_was_driven(tmp_path):
    rows = [(80.0, 70.0, 0)] * 160 + [(32.0, 61.0, 2)] * 20 + [(30.0, 40.0, 1)] * 20
    allowed = recorded(tmp_path, "Speed envelope, watching", rows)
    said = describe_allowed(allowed, 200 * DT)
    assert said == (
        "2.0 s before, the speed envelope would have allowed 32 km/h, bound by lead; "
        "the ego drove 61 km/h."
    )


def test_a_governed_ego_inside_its_envelope_is_said_to_be_there(tmp_path):
    allowed = recorded(tmp_path, "Speed envelope", [(50.0, 49.0, 1)] * 200)
    assert describe_allowed(allowed, 10.0) == (
        "In the 5 s before, the ego stayed within what the speed envelope allowed, 50 km/h and more."
    )


def test_the_chart_draws_each_limit_by_its_name(tmp_path):
    allowed = recorded(
        tmp_path, "Speed envelope", [(50.0, 40.0, 1)] * 100 + [(30.0, 35.0, 2)] * 100
    )
    (figure,) = draw_allowed(allowed, 10.0)
    assert "limit: sight" in figure.svg
    assert "limit: lead" in figure.svg
    assert draw_allowed(allowed, 100.0) == []


@pytest.mark.parametrize("kind", ["rain_sensor"])
def test_runs_without_an_envelope_say_nothing(tmp_path, kind):
    assert recorded(tmp_path, "Rain", [(50.0, 40.0, 1)] * 10, kind) is None
    assert read_allowed(tmp_path / "none", DT) is None
