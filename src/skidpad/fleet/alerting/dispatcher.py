"""Relays alerts as they come, tries again what failed, and escalates alerts that stay open.

Every relay has a thread of its own, so that one that does not answer delays no other.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

from sqlalchemy import Engine

from skidpad.core.errors import BackendError
from skidpad.fleet.alerting.hub import Hub
from skidpad.fleet.alerting.keeping import SUBJECT, Alert, What, alerts_since, overdue
from skidpad.fleet.alerting.relays import Relay
from skidpad.fleet.rounds import Rounds
from skidpad.fleet.store.events import add_event

DAY = 86400.0  # s that an alert is looked after
LOOK_S = 1.0  # between two looks when nothing comes
TRIES = 8
SERVICE = "dispatcher"


class Dispatcher:
    """Escalates and relays the alerts of the last DAY s in threads of its own."""

    def __init__(
        self, engine: Engine, hub: Hub, clock: Callable[[], float], relays: Sequence[Relay] = ()
    ) -> None:
        self.engine, self.hub, self.clock, self.relays = engine, hub, clock, tuple(relays)
        self._rounds: list[Rounds] = []

    def start(self) -> None:
        """Starts a thread that escalates and one per relay, each looking every LOOK_S s or when woken."""
        self._rounds = [Rounds("escalation", self.escalate, LOOK_S)]
        self._rounds += [Rounds(r.name, partial(self.relay, r), LOOK_S) for r in self.relays]
        for one in self._rounds:
            one.start()

    def wake(self) -> None:
        """Wakes all threads, as there is something new."""
        for one in self._rounds:
            one.wake()

    def close(self) -> None:
        """Ends all threads and waits for them; safe to call twice."""
        for one in self._rounds:
            one.ended.set()
        for one in self._rounds:
            one.close()

    def work(self) -> None:
        """Does one round of all threads in the caller's: escalates overdue alerts, then sends what is due."""
        self.escalate()
        for relay in self.relays:
            self.relay(relay)

    def escalate(self) -> None:
        """Raises each alert that is still open when its time is over by one level."""
        now, up = self.clock(), False
        with self.engine.begin() as connection:
            for alert in alerts_since(connection, now - DAY):
                if overdue(alert, now):
                    add_event(
                        connection, (SUBJECT, alert.row.id), What.ESCALATED.value, (SERVICE, now)
                    )
                    self.hub.tell(f"alerts {alert.row.operator}")
                    up = True
        if up:
            self.wake()

    def relay(self, relay: Relay) -> None:
        """Sends by `relay` each alert that it wants and that is due there at the alert's present level."""
        now = self.clock()
        with self.engine.connect() as connection:
            known = alerts_since(connection, now - DAY)
        for alert in known:
            if relay.wants(alert.row.operator) and _is_due(alert, relay.name, now):
                self._send(alert, relay)

    def _send(self, alert: Alert, relay: Relay) -> None:
        """Sends an alert by one relay and adds an event of whether it was relayed or failed, and why."""
        what, reason = What.RELAYED, ""
        try:
            relay.send(alert.plain())
        except BackendError as error:
            what, reason = What.FAILED, str(error)
        at = self.clock()
        with self.engine.begin() as connection:
            add_event(
                connection, (SUBJECT, alert.row.id), what.value, (SERVICE, at),
                relay=relay.name, level=alert.level, reason=reason,
            )  # fmt: skip


def _is_due(alert: Alert, relay: str, now: float) -> bool:
    """Returns True when an open alert was not relayed at this level and a try is due, of TRIES at most.

    A try is due at once, then 1, 2, 4, ... s after the one before.
    """
    mine = [
        e
        for e in alert.events
        if e.detail.get("relay") == relay and e.detail.get("level") == alert.level
    ]
    if any(e.what == What.RELAYED.value for e in mine) or alert.is_closed or len(mine) >= TRIES:
        return False
    return not mine or now - mine[-1].at >= 2.0 ** (len(mine) - 1)
