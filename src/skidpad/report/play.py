"""The crash cards of a scenario or a folder of them: OUT/crashes.html."""

from __future__ import annotations

from pathlib import Path

from skidpad.evidence.drive.collisions import contact_crashes
from skidpad.evidence.drive.prepared import prepare
from skidpad.recording.campaigns import RUNS
from skidpad.recording.logfiles import TICKS, read_log
from skidpad.report.cards import crash_card, severity
from skidpad.report.page import Cards, Page, Section, write_page
from skidpad.roads.bundled import kept_map
from skidpad.roads.queries import RoadMap

PAGE = "crashes.html"
CARDS_MAX = 40


def write_crashes(out: Path, road: RoadMap | None = None) -> Path | None:
    """Write the page with the hardest crashes; None when there was none, and no page then.

    out: of a campaign, or of one run; road: the map of all, where it is at hand.
    """
    page = out / PAGE
    page.unlink(missing_ok=True)
    found = []
    for ticks in (*out.glob(TICKS), *sorted((out / RUNS).glob(f"*/{TICKS}"))):
        log = read_log(ticks.parent)
        if not log.contacts:
            continue
        road_map = kept_map(out, log.header.map, log.header.map_hash) if road is None else road
        drive = prepare(log, road_map)
        found += [(crash, drive, road_map, ticks.parent) for crash in contact_crashes(drive)]
    if not found:
        return None
    found.sort(key=lambda item: severity(item[0]), reverse=True)
    title = f"{len(found)} crashes" if len(found) > 1 else "One crash"
    shown = found[:CARDS_MAX]
    if len(shown) < len(found):
        title += f", the {len(shown)} hardest"
    cards = Cards(title, [crash_card(*item) for item in shown], open=True)
    write_page(Page("Crashes", out.name, [Section("Crashes", [cards])]), page)
    return page
