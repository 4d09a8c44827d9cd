"""No driver's signature has ground truth: by type, and for every driver of the package."""

from __future__ import annotations

import inspect
from pathlib import Path

import pytest

from skidpad.campaign import stepping
from skidpad.campaign.channels import drive as channel_drive
from skidpad.campaign.driving import loop as drive
from skidpad.campaign.driving import stack_at_wheel
from skidpad.campaign.takeover import desk
from skidpad.cockpit import source

DRIVERS = [
    drive.Driver, stack_at_wheel.StackAtWheel, channel_drive.Crew, desk.DeskDriver, source.Said,
    *(
        kind
        for _, kind in inspect.getmembers(stepping, inspect.isclass)
        if kind.__module__ == stepping.__name__ and hasattr(kind, "act") and hasattr(kind, "begin")
    ),
]  # fmt: skip
SAMPLE = '''
from skidpad.campaign.driving.loop import Driver

class Asking:
    """A driver that asks for {what}."""

    report: object = None
    mode: str = ""

    def begin(self, table: object) -> None: ...
    def act(self, frame: object{more}) -> object: ...

driver: Driver = Asking()
'''


@pytest.mark.parametrize("kind", DRIVERS, ids=lambda kind: kind.__name__)
def test_a_driver_acts_on_the_frame_alone(kind):
    assert list(inspect.signature(kind.act).parameters) == ["self", "frame"]
    assert not hasattr(kind, "drive")


def test_a_driver_that_asks_for_truth_fails_the_type_check(tmp_path):
    api = pytest.importorskip("mypy.api")
    for name, what, more in (("good", "the frame", ""), ("bad", "truth", ", truth: object")):
        path = tmp_path / f"{name}.py"
        path.write_text(SAMPLE.format(what=what, more=more))
        said, wrong, status = api.run(
            [
                "--config-file=", "--follow-imports=skip", "--no-error-summary",
                f"--cache-dir={tmp_path / 'cache'}", "--disable-error-code=import-untyped",
                str(path), str(Path(drive.__file__)),
            ]
        )  # fmt: skip
        found = [line for line in said.splitlines() if path.name in line]
        assert not wrong
        if name == "good":
            assert not found, said
        else:
            assert status == 1
            assert any('expression has type "Asking"' in line for line in found), said
