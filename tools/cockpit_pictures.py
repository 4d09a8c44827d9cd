"""The pictures of README and docs/rendering.md.

    python tools/cockpit_pictures.py docs/img

`pictures-for-people.webp` is one moment in the six weathers and snow: the plain picture beside the
one for people. `cockpit.webp` is the film of docs/cockpit.md: a drive whose weather changes. No test compares
them: they are for looking at.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import cv2
import numpy as np
from PIL import Image

from skidpad.campaign.runs.desk_run import drive_at_desk
from skidpad.campaign.takeover.desk import Desk, Recorded
from skidpad.cockpit.film import stretch_of, write_film
from skidpad.cockpit.pictures import Picture, colours
from skidpad.cockpit.replay import RecordedRun
from skidpad.cockpit.studio import Studio, View, plane
from skidpad.core.courses import Roads
from skidpad.core.inputs import Sky, Timed
from skidpad.core.run import AdasDriver, RunSpec
from skidpad.core.vocabulary import GripModel, RangeModel, SensorLevel
from skidpad.physics.presets import preset
from skidpad.sensors.finish.extras import ALL_EXTRAS, NO_EXTRAS, Extra
from skidpad.stack.configurations import functions_of

WEATHERS = (
    "clear-sunrise", "clear-noon", "clear-night", "rain-sunrise", "rain-noon", "rain-night", "snow"
)  # fmt: skip
CHANGES = {190: "clear-noon", 240: "rain-noon", 290: "rain-night", 340: "clear-night", 390: "snow"}
TICK = 300  # in which there are vehicles before and behind
VIEWS = (View.DRIVER, View.FOLLOW)
SIZE = (320, 240)  # px of one picture in the sheet


def picture(recording: RecordedRun, weather: str, view: View, extras: frozenset[Extra]) -> Picture:
    """The moment in a weather."""
    outside = replace(recording.seat(TICK).outside, weather=preset(weather))
    studio = Studio(recording.map, recording.table, outside, recording.spec.seed, extras)
    truth = recording.moment(TICK).truth
    images = studio.look(truth)
    shown = colours(plane(images[view.value]))
    return np.asarray(cv2.resize(shown, SIZE, interpolation=cv2.INTER_AREA), dtype=np.uint8)


def driven(folder: Path, first: str, seconds: float, changes: dict[int, str]) -> RecordedRun:
    """A drive that begins in one weather; changes: others by tick."""
    driver = AdasDriver(label="3", functions=functions_of(3))
    run = RunSpec(driver=driver, course=Roads(), weather=preset(first), duration=seconds,
                  sensors=SensorLevel.OBJECTS)  # fmt: skip
    inputs = [
        Timed(tick, Sky(preset(name), GripModel.PHYSICAL, RangeModel.PHYSICAL))
        for tick, name in changes.items()
    ]
    drive_at_desk(run, Desk(Recorded(inputs), run), folder)
    return RecordedRun(folder)


def main() -> None:
    """Drive and draw."""
    out = Path(sys.argv[1])
    with TemporaryDirectory() as name:
        recording = driven(Path(name) / "sheet", "clear-noon", 16.0, {})
        film = driven(Path(name) / "film", "clear-sunrise", 22.5, CHANGES)
        write_film(film, stretch_of(film, 7.0, 22.0), View.FOLLOW, out / "cockpit.webp")
    rows = [
        np.hstack([picture(recording, w, v, e) for v in VIEWS for e in (NO_EXTRAS, ALL_EXTRAS)])
        for w in WEATHERS
    ]
    sheet = Image.fromarray(np.ascontiguousarray(np.vstack(rows)[..., ::-1]))
    sheet.save(out / "pictures-for-people.webp", quality=78, method=6)


if __name__ == "__main__":
    main()
