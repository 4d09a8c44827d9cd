"""How much of a route with an end a run drove."""

from __future__ import annotations

from skidpad.recording.campaign.added_metrics import AddedMetric
from skidpad.recording.run.log import RunLog
from skidpad.roads.journeys import Journey, progress_along


def measure_route(log: RunLog, journey: Journey) -> tuple[AddedMetric, ...]:
    """Returns the share of the route that was driven, and of it before the car was first put back.

    journey: laid anew, with nothing driven yet. () for an empty log.
    """
    if not len(log):
        return ()
    a = log.actors
    shares = 100.0 * progress_along(journey, a.x[:, 0], a.y[:, 0], a.z[:, 0]) / journey.length
    first = min((r.tick for r in log.relocations), default=None)
    rows = len(log) if first is None else int((log.tick < first).sum())
    unaided = float(shares[rows - 1]) if rows else 0.0
    return (
        AddedMetric("route_completion_pct", "share of the route driven", "%", float(shares[-1])),
        AddedMetric("route_unaided_pct", "the same until first put back", "%", unaided),
    )
