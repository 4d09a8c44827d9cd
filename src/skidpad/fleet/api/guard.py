"""Who asks, whether they may, and how often: before anything of a request is looked at."""

from __future__ import annotations

from dataclasses import dataclass

from fastapi import Request

from skidpad.fleet.identity import token_hash
from skidpad.fleet.service import Fleet
from skidpad.fleet.store.accounts import principal_of
from skidpad.fleet.words import Action, Principal, Refused

REMEMBERED_S = 10.0  # a credential ended by another process is refused after that
KNOWN_MAX = 100_000  # credentials remembered


class Guard:
    """Knows credentials for a moment, so that a busy vehicle costs one look-up per second."""

    def __init__(self, fleet: Fleet) -> None:
        self.fleet = fleet
        self._known: dict[str, tuple[float, Principal]] = {}

    def principal(self, authorization: str | None) -> Principal:
        """Returns the principal of a header `Bearer TOKEN`; Refused: 401 for no valid one, 429 too often."""
        scheme, _, token = (authorization or "").partition(" ")
        if scheme.lower() != "bearer" or not token:
            raise Refused(401, "a credential is needed: Authorization: Bearer TOKEN")
        who = self._look_up(token)
        wait = self.fleet.rate.take(who.id, self.fleet.clock())
        if wait > 0.0:
            raise Refused(429, f"too many requests, wait {wait:.2f} s")
        return who

    def _look_up(self, token: str) -> Principal:
        """Returns the principal of a credential, known for REMEMBERED_S s; refuses others with 401."""
        name, now = token_hash(token), self.fleet.clock()
        known = self._known.get(name)
        if known is not None and 0.0 <= now - known[0] < REMEMBERED_S:
            return known[1]
        with self.fleet.engine.connect() as connection:
            who = principal_of(connection, token, now)
        if who is None:
            self._known.pop(name, None)
            raise Refused(401, "this credential is not known, has expired or was ended")
        if len(self._known) >= KNOWN_MAX:
            self._known.clear()
        self._known[name] = now, who
        return who


@dataclass(frozen=True, slots=True)
class Needs:
    """A dependency of a route: the principal, when its role has the right to `action`."""

    action: Action

    async def __call__(self, request: Request) -> Principal:
        """Returns the principal of the request; Refused: 401 or 429 by the guard, 403 without the right."""
        guard: Guard = request.app.state.guard
        who = guard.principal(request.headers.get("authorization"))
        if not who.may(self.action):
            raise Refused(403, f"the role {who.role.value} may not {self.action.value}")
        return who


def fleet_of(request: Request) -> Fleet:
    """Returns the fleet that a request is answered from."""
    fleet: Fleet = request.app.state.fleet
    return fleet
