"""Who may look at a page: an invitation in the address is exchanged once for a session (R-10)."""

from __future__ import annotations

import secrets
import threading

BYTES = 32  # of a token, 256 bits


class Sessions:
    """Invitations that were not used yet, and sessions that came of others. Safe between threads."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._invited: dict[str, str] = {}  # token: who
        self._admitted: dict[str, str] = {}  # id of the session, kept in a cookie: who

    def invite(self, who: str) -> str:
        """A token for `who`; it opens one session."""
        token = secrets.token_urlsafe(BYTES)
        with self._lock:
            self._invited[token] = who
        return token

    def admit(self, token: str) -> str | None:
        """The id of a fresh session for a token, which is worth nothing from now on."""
        with self._lock:
            who = self._invited.pop(token, None)
            if who is None:
                return None
            id = secrets.token_urlsafe(BYTES)
            self._admitted[id] = who
        return id

    def who(self, id: str | None) -> str | None:
        """Whose session this is; None: nobody's."""
        with self._lock:
            return None if id is None else self._admitted.get(id)

    def end(self, id: str) -> None:
        """The session is over."""
        with self._lock:
            self._admitted.pop(id, None)
