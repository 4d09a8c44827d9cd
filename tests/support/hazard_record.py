"""Hazard records of made traffic."""

from __future__ import annotations

from skidpad.core.vocabulary import HazardType
from skidpad.recording.channels.cycles import cycles
from skidpad.recording.hazards.records import (
    HazardRecord,
    decode_record,
    encode_record,
)
from support.channel_worlds import Eyes, World, drive, traffic


def a_record(n=4, seconds=11.0, late=False, noise=0.05) -> HazardRecord:
    eyes = (Eyes("lav", noise), Eyes("tfuse", noise, blind=(1,)))
    worlds = [
        c._replace(truth=None) for c in cycles(drive(World(objects=traffic(n)), eyes, seconds))
    ]
    if late:  # object 0 of the first channel is there from 3 s to 6 s only
        for k, cycle in enumerate(worlds):
            f = cycle.frames[0]
            if 3.0 <= cycle.t <= 6.0:
                continue
            rest = f._replace(
                objects=f.objects[1:], polygons=f.polygons[1:], polygon_size=f.polygon_size[1:],
                predictions=f.predictions[1:], ids=f.ids[1:], classes=f.classes[1:],
            )  # fmt: skip
            worlds[k] = cycle._replace(frames=(rest, cycle.frames[1]))
    return decode_record(encode_record(unwritten(worlds)))


def unwritten(worlds) -> HazardRecord:
    """A record as a monitor holds it, before it is text."""
    return HazardRecord(
        id="h0001", type=HazardType.EGO_TAILGATED, profile="practical", forms="corrected",
        t_start=5.0, t_end=6.0, t_worst=5.5, count=11, extremes={}, channels=("lav", "tfuse"),
        driving="tfuse", involved=("lav",), context={}, worlds=tuple(worlds),
    )  # fmt: skip
