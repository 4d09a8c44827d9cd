"""Compiling the largest parts of a step ahead: another process can do it meanwhile.

Machine code goes to the disk by the types of the arguments, so these must be those of a step.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from skidpad.core.setup import DT
from skidpad.physics.contact import CONTACT_LAW, Contacts, resolve_contacts
from skidpad.physics.fleet import Fleet
from skidpad.physics.segments import static_segments
from skidpad.physics.vehicle import step_vehicles
from skidpad.simulation.world.rows import Rows, bodies_of


def vehicles_of_nobody() -> tuple[Any, ...]:
    """Returns what `step_vehicles` is called with for no vehicles."""
    rows = Rows.of([], 0)
    fleet = Fleet([], DT, states=rows.states)
    active = np.zeros(0, dtype=np.bool_)
    return (
        rows.states, fleet.wheels, fleet.params, rows.commands, fleet.feel, rows.grade, rows.bank,
        active, np.zeros((0, 2)), DT, 1,
    )  # fmt: skip


def contacts_of_nobody() -> tuple[Any, ...]:
    """Returns what `resolve_contacts` is called with for no bodies and no obstacles."""
    nothing = static_segments(np.zeros((0, 4)), np.zeros(0), np.zeros(0))
    return Rows.of([], 0).states, bodies_of([]), nothing, CONTACT_LAW, DT, Contacts.room()


def compile_parts() -> None:
    """Compiles the kernels of vehicle motion and of contacts by running them on no actors."""
    resolve_contacts(*contacts_of_nobody())
    step_vehicles(*vehicles_of_nobody())
