"""How near others are to a place on the road, in metres and in seconds of driving."""

from __future__ import annotations

import numpy as np

from skidpad.core.arrays import Floats
from skidpad.core.states import ActorStates
from skidpad.simulation.world.placed import Places
from skidpad.simulation.world.traffic.care import FIRM_SHARE, REACTION, STOP_MARGIN, Care, grip_at
from skidpad.simulation.world.traffic.network import Network
from skidpad.simulation.world.traffic.places import CLEARANCE
from skidpad.simulation.world.traffic.right_of_way import WATCH
from skidpad.simulation.world.traffic.state import Drivers, Streets

# s to those ahead and behind of a vehicle that is moved, where it was and where it will be: 3 s, and
# what speeds change in a tick.
LEAST_TIME = 3.5
REACH = 150.0  # m of road that are searched, farther than anybody drives in LEAST_TIME


def claims(placed: Places, d: Drivers) -> Places:
    """Returns (2 n,) every actor where it is, then where it goes to: in a change of lane these are two."""
    aims = placed.copy()
    drives = d.state["active"]
    aims["lane"][drives], aims["s"][drives] = d.path[drives, 0], d.state["s"][drives]
    return np.concatenate([placed, aims])


def seconds_to_others(
    net: Network, claimed: Places, lane: int, s: float, v: float, me: int
) -> float:
    """Returns the smallest time gap in s from a place on a lane, passed at v m/s, to those before and behind.

    inf for none within REACH. claimed: of `claims`. me: row of the vehicle that is or will be there. Those
    on neighbouring lanes do not count.
    """
    placed, n = claimed, len(claimed) // 2
    least = np.inf
    there = placed["present"] & (placed["lane"] >= 0)
    there[[me, me + n]] = False
    for forward in (True, False):
        begins = np.full(len(net.lane), np.nan)
        for other, start in _way(net, lane, s, forward).items():
            begins[other] = start
        along = begins[placed["lane"]] + placed["s"]
        near = there & ((along >= 0.0) if forward else (along < 0.0))
        gap = np.abs(along) - placed["half_length"] - placed["half_length"][me]
        speed = np.maximum(v if forward else placed["speed"], 0.1)
        least = min(least, float((np.maximum(gap, 0.0) / speed)[near].min(initial=np.inf)))
    return least


def is_crossing_free(streets: Streets, claimed: Places, lane: int, s: float, me: int) -> bool:
    """Returns whether a vehicle that is put s m along `lane` before a junction surprises no driver there.

    Drivers judge gaps by those within `WATCH` m of the shared area: a driver that has decided to go
    cannot yield to a vehicle that was not there. claimed, me: as in `seconds_to_others`.
    """
    net, n = streets.net, len(claimed) // 2
    row = net.lane[lane]
    if streets.entry["line"][lane] - s > WATCH:
        return True
    there = claimed["present"].copy()
    there[[me, me + n]] = False
    on, left = (
        claimed["lane"][there],
        net.lane["length"][claimed["lane"]][there] - claimed["s"][there],
    )
    for way in net.next_lane[row["next_first"] : row["next_first"] + row["nexts"]]:
        entry = streets.entry[way]
        conflicts = streets.conflict[entry["first"] : entry["first"] + entry["size"]]
        for other in conflicts["other"].tolist():
            across = net.lane[other]
            first = int(across["prev_first"])
            before = net.prev_lane[first : first + int(across["prevs"])]
            if ((on == other) | (np.isin(on, before) & (left < WATCH))).any():
                return False
    return True


def _way(net: Network, lane: int, s: float, forward: bool) -> dict[int, float]:
    """Returns lanes within REACH before or behind a place, and the m of road from it to where each begins."""
    begins = {lane: -s}
    todo = [lane]
    for here in todo:  # which grows meanwhile
        row, start = net.lane[here], begins[here]
        end = start + float(row["length"])
        if forward and end < REACH:
            first = int(row["next_first"])
            found = [(int(n), end) for n in net.next_lane[first : first + int(row["nexts"])]]
        elif not forward and start > -REACH:
            first = int(row["prev_first"])
            before = net.prev_lane[first : first + int(row["prevs"])]
            found = [(int(p), start - float(net.lane["length"][p])) for p in before]
        else:
            continue
        for other, at in found:
            if other not in begins:
                begins[other] = at
                todo.append(other)
    return begins


def room(care: Care, v: float, states: ActorStates) -> Floats:
    """Returns (n,) m between centres that a vehicle put on the road at speed v keeps to every actor.

    At least CLEARANCE; with care so much that either can brake for the other.
    """
    clear = np.full(len(states.x), CLEARANCE)
    if not care.on:
        return clear
    other = np.hypot(states.vx, states.vy)
    faster = np.maximum(other, v)
    way = np.abs(faster**2 - np.minimum(other, v) ** 2) / (2.0 * FIRM_SHARE * grip_at(care, v))
    return np.asarray(np.maximum(clear, STOP_MARGIN + REACTION * faster + way))
