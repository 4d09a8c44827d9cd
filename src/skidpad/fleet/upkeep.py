"""What the service does by itself: trends, looks at releases under way, a search for recurring hazards."""

from __future__ import annotations

from contextlib import suppress

from sqlalchemy import select

from skidpad.fleet.insight.trends import compact
from skidpad.fleet.loop.rollout import look_at, under_way
from skidpad.fleet.patterns.analysis import SERVICE, analyse, own
from skidpad.fleet.rounds import Rounds
from skidpad.fleet.service import Fleet
from skidpad.fleet.store.rights import visible
from skidpad.fleet.store.tables import analyses, hazards, vehicles
from skidpad.fleet.words import Principal, Refused, Role

LOOK_S = 5.0  # between two rounds: what came shows within 10 s
REST_S = 60.0  # at least, from one analysis of a tenant to its next
LOOKER = "upkeep"  # actor of looks that nobody asked for
OWNERS = ((Role.OPERATOR, vehicles.c.operator), (Role.MANUFACTURER, vehicles.c.manufacturer))


class Upkeep:
    """Looks after releases, trends and analyses in one thread; `work` is one round of it."""

    def __init__(self, fleet: Fleet) -> None:
        self.fleet = fleet
        self._rounds = Rounds("upkeep", self.work, LOOK_S)

    def start(self) -> None:
        """Starts the thread that does the rounds."""
        self._rounds.start()

    def close(self) -> None:
        """Ends the thread; safe to call twice."""
        self._rounds.close()

    def work(self) -> None:
        """Does one round: sums indicators up, looks at releases, analyses tenants with newer hazards."""
        compact(self.fleet)
        self._look()
        for who in self._tenants():
            if self._due(who) and not self._rounds.ended.is_set():
                analyse(self.fleet, who)

    def _look(self) -> None:
        """Looks at every release under way, so that a bad update is taken back unasked."""
        with self.fleet.engine.connect() as connection:
            found = under_way(connection)
        for tenant, release in found:
            who = Principal(LOOKER, tenant, Role.MANUFACTURER, LOOKER)
            with suppress(Refused):  # a person or another process looked at the same moment
                look_at(self.fleet, who, release)

    def _tenants(self) -> list[Principal]:
        """Returns a principal of the service for each tenant and role that owns a vehicle."""
        with self.fleet.engine.connect() as connection:
            return [
                Principal(SERVICE, str(tenant), role, SERVICE)
                for role, column in OWNERS
                for tenant in connection.execute(
                    select(column).distinct().order_by(column)
                ).scalars()
            ]

    def _due(self, who: Principal) -> bool:
        """Returns True when new hazards came since the last analysis and that is REST_S s ago."""
        with self.fleet.engine.connect() as connection:
            last = connection.execute(
                select(analyses.c.at).where(own(who)).order_by(analyses.c.at.desc()).limit(1)
            ).scalar()
            if last is not None and self.fleet.clock() - last < REST_S:
                return False
            newest = connection.execute(
                select(hazards.c.at)
                .where(visible(who, hazards))
                .order_by(hazards.c.at.desc())
                .limit(1)
            ).first()
        return newest is not None and (last is None or newest.at > last)
