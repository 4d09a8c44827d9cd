"""What a click may do: who clicked is looked up anew, and asked for the right, at every click."""

from __future__ import annotations

from typing import Any

from starlette.requests import Request

from skidpad.fleet.alerting.keeping import What
from skidpad.fleet.alerting.orders import Order
from skidpad.fleet.api.alerts import keep_answer, keep_order
from skidpad.fleet.api.hazards import export_scenario
from skidpad.fleet.api.recurring import TriageText, triage
from skidpad.fleet.identity import new_id
from skidpad.fleet.patterns.analysis import analyse
from skidpad.fleet.service import Fleet
from skidpad.fleet.store.accounts import principal_by_id
from skidpad.fleet.words import Action, Principal, Refused
from skidpad.pages.guard import WHO


def visitor(fleet: Fleet, request: Request) -> Principal:
    """Returns the principal whose session opened the page; Refused (401) when its credentials ended."""
    return person(fleet, str(request.scope.get(WHO)))


def person(fleet: Fleet, id: str) -> Principal:
    """Returns the principal of this id with a credential that still holds; Refused (401) otherwise."""
    with fleet.engine.connect() as connection:
        who = principal_by_id(connection, id, fleet.clock())
    if who is None:
        raise Refused(401, "this session's credential has ended")
    return who


def require_right(fleet: Fleet, id: str, action: Action) -> Principal:
    """Returns the principal of this id, if its role may do `action`; Refused (401, 403) otherwise."""
    who = person(fleet, id)
    if not who.may(action):
        raise Refused(403, f"the role {who.role.value} may not {action.value}")
    return who


def click_answer(fleet: Fleet, id: str, alert: str, what: What) -> dict[str, Any]:
    """Acknowledges, escalates or closes an alert and returns it; Refused without the right."""
    return keep_answer(fleet, require_right(fleet, id, Action.ANSWER_ALERTS), alert, what)


def click_order(fleet: Fleet, id: str, alert: str, what: Order) -> dict[str, Any]:
    """Orders the vehicle of an alert to stop, slow down or go on; Refused without the right."""
    return keep_order(fleet, require_right(fleet, id, Action.GUIDE), alert, (what, new_id()))


def click_triage(fleet: Fleet, id: str, subject: str, text: TriageText) -> dict[str, Any]:
    """Sets state, owner and release of a recurring hazard; Refused without the right."""
    return triage(fleet, require_right(fleet, id, Action.TRIAGE), subject, text)


def click_export(fleet: Fleet, id: str, hazard: str) -> bytes:
    """Returns the scenario of a hazard as .zip; Refused without the right."""
    return export_scenario(fleet, require_right(fleet, id, Action.EXPORT_SCENARIO), hazard)


def click_analyse(fleet: Fleet, id: str) -> int:
    """Clusters the newest hazards, stores the analysis and returns how many clusters were found.

    Fixed hazards that came back are reopened. id: of the account that asks. Raises Refused without
    a valid credential (401) or the right (403).
    """
    return len(analyse(fleet, require_right(fleet, id, Action.ANALYSE)).clusters)
