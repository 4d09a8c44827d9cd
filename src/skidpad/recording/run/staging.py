"""What a scenario file stages, as a run of it saw it, and how the runs of a folder are judged."""

from __future__ import annotations

from pathlib import Path

from msgspec import Struct

from skidpad.recording.files import read_json, write_json

STAGING, JUDGING = "staging.json", "judging.json"
SIZE_MAX = 1024**3  # bytes of a file


class StagedEvent(Struct, frozen=True, kw_only=True):
    """Holds one event of the storyboard that acts on others than the ego."""

    name: str  # path in the storyboard, parted by "::"
    actors: tuple[str, ...]
    began: float | None  # s, the first time; None: never
    on_contact: bool = False  # waits for a collision: no part of the interaction


class FileCriterion(Struct, frozen=True, kw_only=True):
    """Holds one criterion that the file states, by the name that ScenarioRunner gives it."""

    name: str  # such as CollisionTest
    limit: float | None = None  # such as the m of DrivenDistanceTest


class Staging(Struct, frozen=True, kw_only=True):
    """Holds what the file stages."""

    scenario: str  # name of the file, without its ending
    ego: str  # name of the ego
    driven_by_file: bool  # the file drives the ego, or there is none: nothing is under test
    partners: tuple[str, ...] = ()  # those that its events move, in the order of entities
    events: tuple[StagedEvent, ...] = ()  # those that act on others than the ego
    criteria: tuple[FileCriterion, ...] = ()  # that the file states
    unreversed: bool = False  # the file lets the ego go backwards, and it never did
    unturned: bool = False  # the file leads the ego round a corner, and it went another way

    @property
    def missing(self) -> list[StagedEvent]:
        """Returns the events of the interaction that never began."""
        return [e for e in self.events if e.began is None and not e.on_contact]


def write_staging(folder: Path, staging: Staging) -> None:
    """Write staging.json into a run's folder."""
    write_json(folder / STAGING, staging)


def read_staging(folder: Path) -> Staging | None:
    """Return the staging of a run; None where it has none, FileError where it cannot be read."""
    return read_json(folder / STAGING, Staging, SIZE_MAX)


class LeftOut(Struct, frozen=True):
    """Holds a file of a folder that could not be played, and why."""

    file: str
    why: str


class Judging(Struct, frozen=True, kw_only=True):
    """Holds how the runs of a folder are judged, so that its page can be written again."""

    expect: tuple[str, ...] = ()  # rules of `--expect`
    left_out: tuple[LeftOut, ...] = ()  # files that could not be played, and why


def write_judging(folder: Path, judging: Judging) -> None:
    """Write judging.json into the folder of a run or a campaign."""
    write_json(folder / JUDGING, judging)


def read_judging(folder: Path) -> Judging:
    """Return how the runs of a folder are judged; the default where it does not say."""
    return read_json(folder / JUDGING, Judging, SIZE_MAX) or Judging()
