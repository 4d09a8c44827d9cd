"""Many runs on a graphics card: their ticks in launches of one kernel, all else as on the CPU.

Runs begin on the CPU. Those with a quick way ask for calls of `drive_ticks`; here the calls of all runs are
answered together by that very function, compiled for the card, a thread for each world. After each launch
of up to `ROWS` ticks the log's rows come back. A world in which something happened comes back too: the run
does what it does on the CPU, and asks for its next call. A run without a quick way is driven on the CPU.

A card has a fingerprint of its own: its sines differ from the CPU's in their last digits.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from hashlib import sha256
from math import nan
from time import perf_counter
from typing import Any

import numpy as np
from numba import cuda
from numpy.typing import NDArray

from skidpad.campaign.driving.quick import Call, Calls, Returned
from skidpad.campaign.driving.quick_tables import DONE
from skidpad.campaign.runs.card_kernel import KeyLeaves, find_kernel
from skidpad.campaign.runs.run import OpenRun, Run
from skidpad.core.kernels.batch import FLOATS, INTS, Leaves, find_leaves
from skidpad.core.kernels.card import SIMULATED, Stores, move_bytes
from skidpad.core.run import RunSpec
from skidpad.stack.interface import Stack

ROWS = 64  # ticks of a launch
MOST = 4096  # worlds at once
MANY = 1_000_000  # ticks, more than a run has
THREADS = 1 if SIMULATED else 64  # of a block
INTERLEAVED = (
    not SIMULATED
)  # values element by element, so that neighbouring threads read neighbours
LOGS = {
    "tables.ticks": 0, "tables.rows": 0, "columns.actors": 1, "columns.present": 0, "columns.mu": 0,
}  # fmt: skip
WORK = frozenset(
    {
        "sensors.one.runs", "sensors.one.classes", "sensors.other.runs", "sensors.other.classes",
        "tables.room",
    }
)  # fmt: skip
FIXED = ("sensors.around.walls.", "sensors.around.posts.")  # of a map, never written
BEGUN, TICK, LEFT, GRACE, STANDING, HANDBRAKE, TICKS, WHY, TOUCHES, CROSSED, LANE = range(11)
NOWHERE = (-1, nan, nan)


class Stages:
    """Seconds that each stage of runs on a card took."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self.ticks, self.launches, self.events = 0, 0, 0

    @contextmanager
    def time(self, stage: str) -> Iterator[None]:
        """Counts what is done within it for a stage."""
        begin = perf_counter()
        try:
            yield
        finally:
            self.seconds[stage] = self.seconds.get(stage, 0.0) + perf_counter() - begin


class World:
    """A run on its way, and the call that it asks for; None: it is over."""

    def __init__(self, number: int, run: OpenRun) -> None:
        self.number, self.run = number, run
        self._calls = _drive_to_end(run)
        self.call: Call | None = next(self._calls, None)
        self.driven = 0  # ticks of the present call
        self.place = NOWHERE  # of the ego in the last of them
        self._joined: object = None
        self._leaves: Leaves | None = None
        self.numbers: tuple[NDArray[Any], ...] = ()
        self.moves: NDArray[np.int64] | None = None
        self.kind: object = None

    @property
    def leaves(self) -> Leaves:
        """Returns what the kernel is given of this world, and sets `kind`: what worlds have in common."""
        assert self.call is not None
        if self._leaves is None or self.call.joined is not self._joined:
            leaves = _intern(find_leaves(self.call.joined))
            own = zip(leaves.paths, leaves.arrays, strict=True)
            shapes = tuple(a.shape for path, a in own if path not in LOGS)
            self._joined, self._leaves = self.call.joined, leaves
            self.numbers, self.moves = leaves.number_arrays(), None
            self.kind = leaves.source, shapes, tuple(a.dtype for a in leaves.arrays)
        return self._leaves

    def answer(self, told: Returned) -> None:
        """Hands the run what its call gave, and takes the next one."""
        self.driven, self.place = 0, NOWHERE
        try:
            self.call = self._calls.send(told)
        except StopIteration:
            self.call = None


_FIXED: dict[bytes, NDArray[Any]] = {}  # by what is in them


def _intern(leaves: Leaves) -> Leaves:
    """Returns leaves whose arrays of the map are the very ones of other worlds on it."""
    arrays = list(leaves.arrays)
    for k, path in enumerate(leaves.paths):
        if path.startswith(FIXED):
            content = sha256(arrays[k].tobytes()).digest()
            arrays[k] = _FIXED.setdefault(content, arrays[k])
    return leaves._replace(arrays=tuple(arrays))


def _drive_to_end(run: OpenRun) -> Calls:
    """Asks for all calls of a run; one whose stack an envelope governs is driven on the CPU."""
    ticks, driven = 0, 1
    while driven:
        governed = run.quick is not None and run.quick.parts.governed is not None
        driven = run.drive(MANY) if governed else (yield from run.ask(MANY))
        ticks += driven
    return ticks


def drive_on_card(
    described: Sequence[tuple[RunSpec, type[Stack] | None]],
    judge: Callable[[Run], Any] | None = None,
    stages: Stages | None = None,
    most: int = MOST,
) -> list[Any]:
    """Drives runs on the card and returns them in their order, or what `judge` makes of them.

    most: runs at once.
    """
    stages = Stages() if stages is None else stages
    found: list[Any] = []
    for first in range(0, len(described), most):
        found += _drive_some(described[first : first + most], judge, stages)
    return found


def _drive_some(
    described: Sequence[tuple[RunSpec, type[Stack] | None]],
    judge: Callable[[Run], Any] | None,
    stages: Stages,
) -> list[Any]:
    """Drives runs that are on the card at the same time; where one raises, all are closed."""
    with ExitStack() as opened:
        worlds = []
        with stages.time("set-up"):
            for k, (spec, kind) in enumerate(described):
                run = OpenRun(spec, kind)
                opened.callback(run.close)
                worlds.append(World(k, run))
        _drive_worlds(worlds, stages)
        found = []
        for world in worlds:
            with stages.time("judging"):
                world.run.close()
                driven = world.run.finish()
                found.append(driven if judge is None else judge(driven))
        return found


def _drive_worlds(worlds: Sequence[World], stages: Stages) -> None:
    """Drives worlds until none has a call."""
    going = [world for world in worlds if world.call is not None]
    while going:  # again where a world has changed its kind on the way
        kinds: dict[object, list[World]] = {}
        with stages.time("set-up"):
            for world in going:
                _ = world.leaves
                kinds.setdefault(world.kind, []).append(world)
        for group in kinds.values():
            Group(group, stages).drive()
        going = [world for world in going if world.call is not None]


_LAUNCHED: set[Any] = set()  # kernels of this process that are compiled


class Group:
    """Worlds of one kind on the card, until each is over or of another kind."""

    def __init__(self, worlds: Sequence[World], stages: Stages) -> None:
        self.worlds, self.stages = list(worlds), stages
        leaves = [world.leaves for world in worlds]
        self.kind = worlds[0].kind
        dtypes = {a.dtype for a in leaves[0].arrays} | {FLOATS, INTS}
        ordered = tuple(sorted(dtypes, key=repr))
        with stages.time("compiling"):
            self.kernel = find_kernel(KeyLeaves(leaves[0]), ordered)
        with stages.time("copying"):
            self.stores = Stores(leaves, ordered, LOGS, ROWS, WORK, INTERLEAVED)
        n = len(worlds)
        self.ints = np.zeros((n, LANE + 1), np.int64)
        self.floats = np.zeros((n, 5))

    def drive(self) -> None:
        """Drives all worlds until none is left on the card."""
        self._send(range(len(self.worlds)))
        while self.ints[:, LEFT].any():
            going = np.flatnonzero(self.ints[:, LEFT])
            self._launch()
            self._take_rows(going)
            ended = [int(b) for b in going if self._note(int(b))]
            self._answer(ended)
            self._send([b for b in ended if self._stays(self.worlds[b])])

    def _stays(self, world: World) -> bool:
        """Tells whether a world has another call for the card."""
        if world.call is None:
            return False
        known, leaves = world.moves, world.leaves
        return world.moves is known or (world.kind == self.kind and self.stores.has_shared(leaves))

    def _launch(self) -> None:
        """Drives up to ROWS ticks of all worlds."""
        stages, stores = self.stages, self.stores
        with stages.time("card" if self.kernel in _LAUNCHED else "compiling"):
            ints, floats = cuda.to_device(self.ints), cuda.to_device(self.floats)
            blocks = -(-len(self.worlds) // THREADS)
            self.kernel[blocks, THREADS](stores.table, ints, floats, ROWS, *stores.data)
            cuda.synchronize()
            self.ints[:], self.floats[:] = ints.copy_to_host(), floats.copy_to_host()
        _LAUNCHED.add(self.kernel)
        stages.launches += 1

    def _take_rows(self, going: NDArray[np.int64]) -> None:
        """Copies rows of the log into the runs'."""
        stores = self.stores
        with self.stages.time("log"):
            logs = stores.fetch(stores.log, going)
            for j, b in enumerate(going.tolist()):
                world, ticks = self.worlds[b], int(self.ints[b, TICKS])
                assert world.call is not None
                self.stages.ticks += ticks
                if ticks:
                    stores.copy_rows(logs, j, world.leaves, world.call.at + world.driven, ticks)

    def _note(self, b: int) -> bool:
        """Tells whether the call of a world is answered; if not, the next launch goes on with it."""
        row, world = self.ints[b], self.worlds[b]
        ticks = int(row[TICKS])
        world.driven += ticks
        row[LEFT] -= ticks
        if ticks or row[LANE] >= 0:  # else an event of the first tick, before the ego is looked for
            world.place = int(row[LANE]), float(self.floats[b, 3]), float(self.floats[b, 4])
        if row[WHY] != DONE or row[LEFT] == 0:
            row[LEFT] = 0
            return True
        row[TICK] += ticks - row[BEGUN]
        row[BEGUN], row[GRACE] = 0, row[GRACE] - ticks
        return False

    def _answer(self, ended: Sequence[int]) -> None:
        """Takes the state of worlds from the card, and lets their runs go on to the next call."""
        if not ended:
            return
        stores, stages = self.stores, self.stages
        stages.events += len(ended)
        with stages.time("copying"):
            states = stores.fetch(stores.state, np.array(ended))
            for j, b in enumerate(ended):
                move_bytes(self._moves(self.worlds[b]), _bases(states, j), True)
        with stages.time("events"):
            for b in ended:
                row, drawn, world = self.ints[b].tolist(), self.floats[b].tolist(), self.worlds[b]
                world.answer(
                    (
                        world.driven, row[WHY], row[TOUCHES], row[CROSSED], *drawn[:3],
                        row[HANDBRAKE] != 0, *world.place, row[STANDING],
                    )
                )  # fmt: skip

    def _send(self, which: Sequence[int]) -> None:
        """Copies worlds with their calls to the card."""
        if not which:
            return
        stores = self.stores
        with self.stages.time("copying"):
            states = stores.make_states(len(which))
            for j, b in enumerate(which):
                world = self.worlds[b]
                call = world.call
                assert call is not None
                move_bytes(self._moves(world), _bases(states, j), False)
                row, last = self.ints[b], call.last
                row[BEGUN], row[TICK], row[LEFT] = call.begun, call.tick, call.n
                row[GRACE], row[STANDING] = call.grace, call.standing
                row[HANDBRAKE] = last.handbrake
                self.floats[b, :3] = last.throttle, last.brake, last.steer
            stores.send(np.array(which), states)

    def _moves(self, world: World) -> NDArray[np.int64]:
        """Returns what is copied of a world."""
        leaves = world.leaves
        if world.moves is None:
            world.moves = self.stores.list_moves(world.numbers, leaves)
        return world.moves


def _bases(states: Sequence[NDArray[Any]], j: int) -> NDArray[np.int64]:
    """Returns the addresses of state j in each region."""
    return np.array([s.ctypes.data + j * s.strides[0] for s in states], np.int64)
