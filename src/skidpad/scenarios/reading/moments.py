"""Dates with a time of day, as files write them (ISO 8601)."""

from __future__ import annotations

import re
from datetime import datetime, timedelta, timezone

MOMENT = re.compile(
    r"(\d{4})-(\d\d)-(\d\d)T(\d\d):(\d\d)(?::(\d\d)(\.\d+)?)?(?:(Z)|([+-])(\d\d):?(\d\d))?"
)


def moment(text: str) -> float:
    """Returns a time in s since 1970, without a zone as that of Greenwich; ValueError where it is none."""
    found = MOMENT.fullmatch(text.strip())
    if found is None:
        raise ValueError(f"{text!r} is no ISO 8601 time")
    year, month, day, hour, minute, second = (int(found[k] or 0) for k in range(1, 7))
    shift = timedelta(hours=int(found[10] or 0), minutes=int(found[11] or 0))
    zone = timezone(-shift if found[9] == "-" else shift)
    whole = datetime(year, month, day, hour, minute, second, tzinfo=zone)
    return whole.timestamp() + float(found[7] or 0.0)
