"""Access to pages: an invitation in the address is exchanged once for a session (R-10)."""

from __future__ import annotations

import secrets
import threading
import time
from collections.abc import Callable
from math import inf

BYTES = 32  # of a token, 256 bits


class Sessions:
    """Keeps invitations that are unused, and the sessions that came of others. Safe between threads."""

    def __init__(self, valid_s: float = inf, clock: Callable[[], float] = time.monotonic) -> None:
        """valid_s: of an invitation that nobody used; a session ends by `end` alone."""
        self._lock = threading.Lock()
        self._valid_s, self._clock = valid_s, clock
        self._invited: dict[str, tuple[str, float]] = {}  # token: who, since when
        self._admitted: dict[str, str] = {}  # id of the session, kept in a cookie: who

    def invite(self, who: str) -> str:
        """Returns a token for `who`, which opens one session."""
        token = secrets.token_urlsafe(BYTES)
        with self._lock:
            self._forget()
            self._invited[token] = who, self._clock()
        return token

    def admit(self, token: str) -> str | None:
        """Returns the id of a fresh session for a token, which is void then; None for a void one."""
        with self._lock:
            self._forget()
            invited = self._invited.pop(token, None)
            if invited is None:
                return None
            id = secrets.token_urlsafe(BYTES)
            self._admitted[id] = invited[0]
        return id

    def _forget(self) -> None:
        """Drops the invitations that are older than they are valid for."""
        oldest = self._clock() - self._valid_s
        self._invited = {t: one for t, one in self._invited.items() if one[1] >= oldest}

    def __len__(self) -> int:
        """Returns the number of unused invitations, those that are out of date among them."""
        return len(self._invited)

    def who(self, id: str | None) -> str | None:
        """Returns the owner of a session's id; None where it is of no session."""
        with self._lock:
            return None if id is None else self._admitted.get(id)

    def end(self, id: str) -> None:
        """Ends a session that was open."""
        with self._lock:
            self._admitted.pop(id, None)
