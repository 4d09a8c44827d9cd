"""Which blueprint attributes act; all others are accepted without effect (decision X-15)."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

from skidpad.simulation.carla_server.actors.catalogue import Blueprint, Family, load_data

log = logging.getLogger("skidpad.carla_server")


@dataclass(frozen=True, slots=True)
class Acting:
    """Ids of the attributes that act: of every actor, by sensor that sends, and by family."""

    always: frozenset[str]
    sensors: dict[str, frozenset[str]]
    additions: dict[str, frozenset[str]]  # by sensor: ours, which CARLA does not have
    families: dict[Family, frozenset[str]]
    in_the_client: frozenset[str]  # sensors computed there from map and snapshots


@cache
def load_acting() -> Acting:
    """Reads what acts, as listed beside the blueprints."""
    data, additions = load_data()["acting"], load_data()["additions"]
    return Acting(
        always=frozenset(data["always"]),
        sensors={id: frozenset(names) for id, names in data["sensors"].items()},
        additions={id: frozenset(names) for id, names in additions.items()},
        families={Family(name): frozenset(ids) for name, ids in data["families"].items()},
        in_the_client=frozenset(data["in_the_client"]),
    )


def acting(blueprint: Blueprint) -> set[str]:
    """Returns the ids of a blueprint's attributes that change something.

    Those that clients cannot modify are among them; of a sensor that sends nothing, `role_name` alone.
    """
    if blueprint.family is Family.SENSOR and not is_produced(blueprint.id):
        return {"role_name"}
    table = load_acting()
    known = table.always | table.sensors.get(blueprint.id, frozenset()) | additions(blueprint)
    known |= table.families.get(blueprint.family, frozenset())
    return {a.id for a in blueprint.attributes.values() if a.id in known or not a.modifiable}


def additions(blueprint: Blueprint) -> frozenset[str]:
    """Returns the ids of a blueprint's attributes that are additions of ours; all of them act."""
    return load_acting().additions.get(blueprint.id, frozenset())


def is_produced(sensor: str) -> bool:
    """Returns whether a sensor with this blueprint id sends anything, from here or in the client."""
    table = load_acting()
    return sensor in table.sensors or sensor in table.in_the_client


class Remarks:
    """Says once for each attribute that a client sets in vain."""

    def __init__(self) -> None:
        self.made: set[tuple[str, str]] = set()

    def remark(self, blueprint: Blueprint, given: Mapping[str, str]) -> None:
        """Logs each attribute of `given` that acts on nothing, and a sensor that sends nothing.

        Each is logged once per blueprint; default values and names that it lacks are not logged.
        """
        known = acting(blueprint)
        for name, value in given.items():
            attribute = blueprint.attributes.get(name)
            if attribute is None or name in known or value == attribute.recommended[0]:
                continue
            self._once(blueprint.id, f"attribute {name}")
        if blueprint.family is Family.SENSOR and not is_produced(blueprint.id):
            self._once(blueprint.id, "the sensor, which sends nothing,")

    def _once(self, id: str, what: str) -> None:
        """Logs once for each blueprint that a setting is accepted without effect."""
        if (id, what) not in self.made:
            self.made.add((id, what))
            log.info("%s: %s is accepted without effect", id, what)
