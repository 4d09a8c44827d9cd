"""The crash cards of drives without a supervisor: of a scenario, or of one run."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from skidpad.evidence.drive.collisions import contact_crashes
from skidpad.evidence.drive.prepared import prepare
from skidpad.recording.run.log import RunLog
from skidpad.recording.run.log_files import read_log
from skidpad.recording.run.motion import motion_hash
from skidpad.report.crashes.cards import Found, crash_card, severity
from skidpad.report.elements.page import Cards, Page, Section, write_page
from skidpad.roads.queries import RoadMap

PAGE = "crashes.html"
SHOWN = 20  # cards at most


def find_contacts(log: RunLog, road: RoadMap, run: Path) -> list[Found]:
    """Returns the ego's hardest contact with each other body as a crash; empty without contacts.

    run: the folder of the log.
    """
    if not log.contacts:
        return []
    drive = prepare(log, road)
    return [(crash, drive, road, run) for crash in contact_crashes(drive)]


def contact_cards(found: Sequence[Found]) -> Cards:
    """Returns the SHOWN hardest of the crashes `found` as cards, hardest first.

    Drives that moved alike count once (T-3).
    """
    found = list({(motion_hash(f[1].log), f[0].tick, f[0].other): f for f in found[::-1]}.values())
    hardest = sorted(found, key=lambda item: severity(item[0]), reverse=True)[:SHOWN]
    title = f"{len(found)} crashes" if len(found) > 1 else "One crash"
    if len(hardest) < len(found):
        title += f", the {len(hardest)} hardest"
    return Cards(title, [crash_card(*item) for item in hardest], open=True)


def write_crashes(run: Path, road: RoadMap) -> Path | None:
    """Writes crashes.html of one run and returns its path; None without a crash, no page then."""
    page = run / PAGE
    page.unlink(missing_ok=True)
    found = find_contacts(read_log(run), road, run)
    if not found:
        return None
    cards = contact_cards(found)
    write_page(Page("Crashes", run.name, [Section("Crashes", [cards])]), page)
    return page
