"""What is seen of background traffic from outside: overlaps, headways, standing, moves.

Nothing here asks the drivers or the contact solver: bodies are rectangles in the plane, leaders are
found by lane and place. Only the cause of standing and the desired speed of followers are the
drivers' own word.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from skidpad.campaign.bench.headways import field_sources, headways_of, judge
from skidpad.core.arrays import Flags, Floats, Ints32
from skidpad.core.geometry import footprint
from skidpad.scenarios.movement.measures import overlap
from skidpad.simulation.world.traffic.manager import CHECK_PERIOD
from skidpad.simulation.world.traffic.state import Held
from skidpad.simulation.world.world import World

# Steady following: speeds within 1.52 m/s and accelerations within 0.75 m/s^2 for 3.5 s (Parashar et
# al. 2025, Communications in Transportation Research, 10.1016/j.commtr.2025.100169, from NGSIM I-80).
STEADY_SPEED, STEADY_ACCELERATION, STEADY_TIME = 1.52, 0.75, 3.5  # m/s, m/s^2, s
# Followers, as sources that part them from free drivers count them: in steady following, held up (they
# would drive at least this much faster than their leader), and no longer closing in. Who has just got a
# leader and speeds up towards it passes its speed for a moment: at the 0.26 m/s^2 that 5 % of wanted
# speed give, the band of speeds takes 4 s. All three are ours.
HELD_UP, NOT_CLOSING, HELD_FOR = 1.05, 0.5, 10.0  # over the leader's speed; m/s; s
CUT_OFF = 5.0  # s: a vehicle farther behind follows none (King et al. 2022, see `headways.csv`)
SLOWEST = 5.0  # m/s: slower traffic is a queue
LOOK = 10  # ticks between two looks at headways
FAST_ROAD = 80.0 / 3.6 - 0.1  # m/s: limits from here on are those of motorways
STANDING = 0.5  # m/s
LONG = 120.0  # s of standing that are listed
CIRCLE = 60.0  # s for which all of a circle have stood; longer than a cycle of lights
CAUSE_LOOK = 20  # ticks between two looks at causes
STOREY = 2.5  # m of height between roads that cross
CLOSE = 3.0  # s between neighbours, either may be the follower


@dataclass(frozen=True, slots=True)
class Stand:
    """A vehicle that stood long, and for what the first of its queue stood most of the time."""

    weather: str
    seed: int
    actor: int
    seconds: float
    cause: str
    x: float
    y: float


@dataclass(slots=True)
class TrafficCounts:
    """What a watch has seen so far, of one world or several."""

    overlaps: int = 0  # pairs of vehicles that began to overlap
    moved: int = 0  # from afar to near the ego
    moved_close: int = 0  # of these with another one within CLOSE s before or after
    fast: list[float] = field(default_factory=list)  # s, headways in steady following
    slow: list[float] = field(default_factory=list)  # likewise, on roads below FAST_ROAD
    followers_fast: list[float] = field(default_factory=list)  # s, of followers alone
    followers_fast_fronts: list[float] = field(default_factory=list)  # likewise, front to front
    followers_slow: list[float] = field(default_factory=list)
    stands: list[Stand] = field(default_factory=list)
    longest_stand: float = 0.0  # s
    circles: list[list[str]] = field(default_factory=list)  # of vehicles that wait for each other

    def summary(self) -> dict[str, Any]:
        """Returns plain data for JSON: headways as quantiles, everything else as it is."""
        return {
            "overlaps": self.overlaps,
            "moved": self.moved,
            "moved_close": self.moved_close,
            "headways_fast": headways_of(self.fast),
            "headways_town": headways_of(self.slow),
            "followers_fast": headways_of(self.followers_fast),
            "followers_fast_fronts": headways_of(self.followers_fast_fronts),
            "followers_town": headways_of(self.followers_slow),
            "field": self.beside_field(),
            "longest_stand_s": round(self.longest_stand, 1),
            "stands": [asdict(stand) for stand in self.stands],
            "circles": self.circles,
        }

    def beside_field(self) -> list[dict[str, Any]]:
        """Returns the judged headways of followers beside each source that gives a distribution of them."""
        result = []
        for source in field_sources():
            if source.kind != "followers":
                continue
            fast = self.followers_fast if source.headway == "gap" else self.followers_fast_fronts
            ours = fast if source.road == "motorway" else self.followers_slow
            result.append({"road": source.road, **judge(ours, source)})
        return result


class Watch:
    """Looks at a world after each of its steps."""

    def __init__(self, world: World, seen: TrafficCounts, weather: str, seed: int) -> None:
        n = len(world.table)
        self.world, self.seen, self.weather, self.seed = world, seen, weather, seed
        self._touching: set[tuple[int, int]] = set()
        self._steady, self._leader = np.zeros(n), np.full(n, -1)
        self._stood = np.zeros(n)
        self._causes = np.zeros((n, len(Held)), dtype=np.int64)
        self._circles: set[tuple[int, ...]] = set()
        self._before = world.states.copy()
        self._times = np.full(n, np.inf)  # s to neighbours before the tick in which some are moved

    def look(self) -> None:
        """Counts overlaps, moves, stands and headways of the last step; to be called after each."""
        w = self.world
        pairs = overlaps(w)
        self.seen.overlaps += len(pairs - self._touching)
        self._touching = pairs
        self._note_moves()
        self._note_stands()
        if w.tick % LOOK == 0:
            self._note_headways()
        self._before = w.states.copy()

    def end(self) -> None:
        """Ends the watch of a drive: a vehicle that still stands is listed as well if it stood LONG."""
        for i in range(len(self._stood)):
            self._close_stand(i)

    def _note_moves(self) -> None:
        """Counts the vehicles that were moved on, and those of them near others in time."""
        moved = list(self.world.events.moved_on)
        if moved:
            close = np.minimum(self._times, times_to_neighbours(self.world))[moved] < CLOSE
            self.seen.moved += len(moved)
            self.seen.moved_close += int(close.sum())
        if (self.world.tick + 1) % CHECK_PERIOD == 0:
            self._times = times_to_neighbours(self.world)

    def _note_stands(self) -> None:
        """Adds the standing of each vehicle up, ends that of vehicles that move, keeps the longest."""
        w = self.world
        assert w.traffic is not None
        stands = w.states.present & (w.placed["speed"] < STANDING)
        stands &= w.traffic.drivers.state["active"]
        for i in np.flatnonzero(~stands & (self._stood > 0.0)).tolist():
            self._close_stand(i)
        self._stood[stands] += w.dt
        self.seen.longest_stand = max(self.seen.longest_stand, float(self._stood.max()))
        if w.tick % CAUSE_LOOK == 0:
            self._note_causes(stands)

    def _note_causes(self, stands: NDArray[np.bool_]) -> None:
        """Counts for what each queue stands, and keeps new circles of vehicles that wait for each other."""
        assert self.world.traffic is not None
        driver = self.world.traffic.drivers.state
        for i in np.flatnonzero(stands).tolist():
            root = root_of(driver["blocker"], stands, i)
            self._causes[i, driver["held"][root]] += 1
        circles = set(wait_circles(driver["blocker"], self._stood > CIRCLE))
        for circle in circles - self._circles:
            standing = np.isin(np.arange(len(stands)), circle)
            self.seen.circles.append([str(wait) for wait in wait_graph(self.world, standing)])
        self._circles = circles

    def _close_stand(self, i: int) -> None:
        """Ends the standing of vehicle `i` and keeps it with its commonest cause if it was over LONG s."""
        if self._stood[i] > LONG:
            cause = cause_name(Held(int(self._causes[i].argmax())))
            x, y = float(self._before.x[i]), float(self._before.y[i])
            seconds = round(float(self._stood[i]), 1)
            self.seen.stands.append(Stand(self.weather, self.seed, i, seconds, cause, x, y))
        self._stood[i] = 0.0
        self._causes[i] = 0

    def _note_headways(self) -> None:
        """Keeps the headways in s of vehicles that have followed the same leader steadily."""
        w = self.world
        assert w.traffic is not None
        limit = w.traffic.net.point["limit"]
        leader, gap = leaders(w)
        v = w.placed["speed"]
        for i in range(len(leader)):
            j = int(leader[i])
            steady = j >= 0 and j == self._leader[i] and v[i] > SLOWEST
            steady = steady and abs(v[i] - v[j]) <= STEADY_SPEED
            steady = steady and abs(w.placed["ax"][i]) <= STEADY_ACCELERATION
            self._steady[i] = self._steady[i] + LOOK * w.dt if steady else 0.0
            self._leader[i] = j
            headway = float(gap[i] / v[i]) if steady else np.inf
            if self._steady[i] >= STEADY_TIME and headway <= CUT_OFF:
                fast = limit[w.placed["sample"][i]] >= FAST_ROAD
                (self.seen.fast if fast else self.seen.slow).append(headway)
                if self._is_follower(i, j):
                    self._note_follower(i, j, headway, bool(fast))

    def _is_follower(self, i: int, j: int) -> bool:
        """Returns True when vehicle i, in steady following of j, wants to go HELD_UP times faster than j.

        It has followed for HELD_FOR s and its speed is within NOT_CLOSING m/s of j's.
        """
        w, v = self.world, self.world.placed["speed"]
        assert w.traffic is not None
        wanted = w.traffic.drivers.state["v_desired"][i]
        held = self._steady[i] >= HELD_FOR and abs(v[i] - v[j]) <= NOT_CLOSING
        return bool(held and wanted >= HELD_UP * v[j])

    def _note_follower(self, i: int, j: int, headway: float, fast: bool) -> None:
        """Keeps the headway in s of vehicle i behind j; on `fast` roads also that from front to front."""
        if not fast:
            self.seen.followers_slow.append(headway)
            return
        length = 2.0 * float(self.world.placed["half_length"][j])
        self.seen.followers_fast.append(headway)
        self.seen.followers_fast_fronts.append(
            headway + length / float(self.world.placed["speed"][i])
        )


def leaders(world: World) -> tuple[NDArray[np.int64], Floats]:
    """Returns (n,) the next vehicle ahead on the lane or the one straight on, -1: none; and the gap in m."""
    assert world.traffic is not None
    placed, lanes = world.placed, world.traffic.net.lane
    there = np.flatnonzero(world.states.present & (placed["lane"] >= 0))
    found, gap = np.full(len(placed), -1, dtype=np.int64), np.full(len(placed), np.inf)
    lane, s = placed["lane"][there], placed["s"][there]
    for i in there.tolist():
        here, start = int(placed["lane"][i]), -float(placed["s"][i])
        for _ in range(6):
            on = (lane == here) & (start + s > 0.0) & (there != i)
            if on.any():
                k = int(np.flatnonzero(on)[np.argmin(s[on])])
                found[i] = there[k]
                halves = placed["half_length"][i] + placed["half_length"][there[k]]
                gap[i] = start + s[k] - halves
                break
            start += float(lanes["length"][here])
            here = int(lanes["ahead"][here])
            if here < 0 or start > CUT_OFF * 45.0:
                break
    return found, gap


def overlaps(world: World) -> set[tuple[int, int]]:
    """Returns the pairs of vehicles (i < j) whose rectangles overlap in the plane.

    Heights differ by less than STOREY m. Method: separating axis theorem.
    """
    s, table = world.states, world.table
    there = np.flatnonzero(s.present)
    x, y, z = s.x[there], s.y[there], s.z[there]
    near = np.hypot(x[:, None] - x, y[:, None] - y) < 12.0
    near &= np.abs(z[:, None] - z) < STOREY
    found = set()
    for a, b in zip(*np.nonzero(np.triu(near, 1)), strict=True):
        i, j = int(there[a]), int(there[b])
        one, other = (
            footprint(s.x[k], s.y[k], s.yaw[k], table.length[k], table.width[k]).tolist()
            for k in (i, j)
        )
        if overlap(one, other) <= 0.0:
            found.add((i, j))
    return found


def times_to_neighbours(world: World) -> Floats:
    """Returns (n,) the least s between each vehicle and the next ahead or behind on its lane; inf: none."""
    leader, gap = leaders(world)
    time: Floats = np.maximum(gap, 0.0) / np.maximum(world.placed["speed"], 0.1)
    behind = np.full(len(time), np.inf)
    follows = leader >= 0
    np.minimum.at(behind, leader[follows], time[follows])
    nearest: Floats = np.minimum(time, behind)
    return nearest


# The graph of vehicles of background traffic that wait for each other, as their drivers note it.


@dataclass(frozen=True, slots=True)
class Wait:
    """A vehicle that stands, for what, and for which other vehicle."""

    actor: int
    cause: Held
    blocker: int | None
    lane: int
    s: float  # m along the lane
    seconds: float  # of standing before a line

    def __str__(self) -> str:
        place = f"{self.actor} on lane {self.lane} at {self.s:.0f} m for {self.seconds:.0f} s"
        whom = "" if self.blocker is None else f" of {self.blocker}"
        return f"{place}: {cause_name(self.cause)}{whom}"


def cause_name(cause: Held) -> str:
    """Returns the cause of standing in words."""
    return cause.name.lower().replace("_", " ")


def wait_graph(world: World, stands: Flags) -> list[Wait]:
    """Returns for each vehicle that stands (n,) for what and whom it waits."""
    assert world.traffic is not None
    state, path = world.traffic.drivers.state, world.traffic.drivers.path
    return [
        Wait(
            actor=i,
            cause=Held(int(state["held"][i])),
            blocker=int(state["blocker"][i]) if state["blocker"][i] >= 0 else None,
            lane=int(path[i, 0]),
            s=float(state["s"][i]),
            seconds=float(state["stood"][i]),
        )
        for i in np.flatnonzero(stands).tolist()
    ]


def root_of(blocker: Ints32, stands: Flags, i: int) -> int:
    """Returns the last vehicle that stands in the chain of those for whom vehicle i waits.

    In a circle it is the one before the first that comes twice.
    """
    chain = {i}
    while blocker[i] >= 0 and stands[blocker[i]] and int(blocker[i]) not in chain:
        i = int(blocker[i])
        chain.add(i)
    return i


def wait_circles(blocker: Ints32, stands: Flags) -> list[tuple[int, ...]]:
    """Returns the circles of vehicles that stand and wait for each other, each from its least row on.

    None of them can go before another one does: they stand until a rule lets one go first.
    """
    circles, seen = [], set[int]()
    for start in np.flatnonzero(stands).tolist():
        way: list[int] = []
        here = start
        while here >= 0 and stands[here] and here not in seen:
            seen.add(here)
            way.append(here)
            here = int(blocker[here])
        if here in way:
            circle = way[way.index(here) :]
            first = circle.index(min(circle))
            circles.append(tuple(circle[first:] + circle[:first]))
    return circles
