"""Drives of an encounter as paths that `splitting` follows: checkpoints, and disturbances that branch.

A drive branches at the first tick at which its margin is below a level. It is driven again to there from
where it branched last, as its draws are known by name; so one checkpoint a drive is enough. Sensor noise
stays that of the run's seed: only disturbances branch.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np
from msgspec import structs

from skidpad.campaign.runs.checkpoints import RunCheckpoint
from skidpad.campaign.runs.run import OpenRun
from skidpad.core.arrays import Floats
from skidpad.core.errors import InputError
from skidpad.core.maths.randomness import stream
from skidpad.core.maths.space import Space, Value
from skidpad.core.setup import DT
from skidpad.core.traffic.disturbance import actor_of_draw
from skidpad.core.vocabulary import Outcome
from skidpad.recording.campaign.risks import Repetition, Risk
from skidpad.recording.campaign.searches import Trial
from skidpad.roads.bundled import load_map
from skidpad.scenarios.playing.disturbing import Disturbances
from skidpad.search.margin import NO_CONFLICT, approach, closeness
from skidpad.search.space import apply_values
from skidpad.search.splitting import Split, split_paths
from skidpad.search.trial import list_columns, unit_tuple

BRANCH_ABOVE = 1.0  # margin: of a contact it is not known at once how hard it was
APART_S = 1.0  # s since a branch between distances that are noted
OBJECTIVE = "combined"


@dataclass(slots=True)
class DrivenPath:
    """One drive to its end.

    Attributes:
        begun: the run, and where its own draws begin; None: it logged no tick, and nothing can leave it.
        name: of the streams of its draws.
        levels: (T,) margin so far, by tick.
        places: (T, n, 2) m of the disturbed vehicles.
        score: its margin.
        kind: of its failure; "" where it is none.
        cut: the level under which it was followed last, and the state there.
    """

    begun: tuple[OpenRun, RunCheckpoint] | None
    name: str
    levels: Floats
    places: Floats
    score: float
    kind: str
    cut: tuple[float, RunCheckpoint] | None = None


class Drives:
    """The process of one repetition: its drives, and what they cost."""

    def __init__(self, asked: Risk, repetition: int) -> None:
        self.asked, self.repetition = asked, repetition
        self.template = asked.template
        plain = [v for v in asked.space.variables if not actor_of_draw(v.name)]
        self.space = Space(tuple(plain)) if plain else None
        self.begun: dict[tuple[Value, ...], tuple[OpenRun, RunCheckpoint]] = {}
        self.ticks = 0  # that were driven
        self.faults = 0
        self.apart: list[Floats] = []  # by branch: m from the drive that it left, each APART_S

    def begin(self, number: int) -> DrivenPath:
        """Returns a drive with values of its own and disturbances from the beginning."""
        values: dict[str, Value] = {}
        if self.space is not None:
            rng = stream(self.asked.seed, "splitting", self.repetition, number)
            values = self.space.values(unit_tuple(rng.random(len(self.space.variables))))
        key = tuple(values.values())
        name = f"{self.repetition}.{number}"
        if key not in self.begun:
            run = self._first_tick(values)
            if run is None:
                self.faults += 1
                return DrivenPath(None, name, np.empty(0), np.empty((0, 0, 2)), NO_CONFLICT, "")
            self.begun[key] = run, run.save()
        return self._drive(*self.begun[key], name)

    def _first_tick(self, values: dict[str, Value]) -> OpenRun | None:
        """Returns a run that has driven its first tick, in which nothing is drawn; None where it cannot."""
        try:
            run = OpenRun(apply_values(self.template, values))
        except InputError:  # the file refuses the values
            return None
        if run.step() is None:
            run.close()
            return None
        return run

    def branch(self, path: DrivenPath, below: float, name: str) -> DrivenPath:
        """Returns the drive that leaves `path` where its margin first is under `below`."""
        row = int(np.argmax(path.levels < below))
        assert path.begun is not None, "what logged no tick has no level below any other"
        run, origin = path.begun
        if path.cut is None or path.cut[0] != below:
            self._go_back(run, origin, path.name)
            while len(run.log.log) <= row:
                run.step()
                self.ticks += 1
            path.cut = below, run.save()
        found = self._drive(run, path.cut[1], name)
        both = min(len(path.places), len(found.places))
        apart = np.linalg.norm(path.places[row:both] - found.places[row:both], axis=2).mean(axis=1)
        self.apart.append(apart[:: round(APART_S / DT)])
        return found

    def close(self) -> None:
        """Releases the simulators of all drives."""
        for run, _ in self.begun.values():
            run.close()

    def _go_back(self, run: OpenRun, origin: RunCheckpoint, name: str) -> Disturbances:
        """Puts a run back to where draws of this name begin."""
        run.restore(origin)
        assert run.stage.player is not None
        disturbances = run.stage.player.disturbances
        disturbances.branch(name)
        return disturbances

    def _drive(self, run: OpenRun, origin: RunCheckpoint, name: str) -> DrivenPath:
        """Drives from there to the end and returns the path."""
        disturbances = self._go_back(run, origin, name)
        while run.step() is not None:
            self.ticks += 1
        driven = run.finish()
        log = driven.log
        assert driven.off_road is not None
        levels = approach(log, driven.off_road)
        rows = [log.table.names.index(drift.law.actor) for drift in disturbances.drifts]
        places = np.stack([log.actors.x[:, rows], log.actors.y[:, rows]], axis=2)
        score, kind = float(levels[-1]), ""
        self.faults += driven.outcome is Outcome.AGENT_ERROR
        if score <= BRANCH_ABOVE:
            near = closeness(log, load_map(driven.road), driven.off_road, OBJECTIVE)
            blank = Trial(number=0, unit=(), values={}, margin=NO_CONFLICT)
            score = near.margin
            kind = structs.replace(blank, **list_columns(log, near)).kind
        return DrivenPath((run, origin), name, levels, places.astype(float), score, kind)


@dataclass(frozen=True, slots=True)
class SplitTask:
    """What a worker is given: one repetition of splitting."""

    asked: Risk
    repetition: int


def split_drives(task: SplitTask) -> Repetition:
    """Drives one repetition of splitting in this process and returns what it came to."""
    process = Drives(task.asked, task.repetition)
    rng = stream(task.asked.seed, "splitting", task.repetition)
    try:
        found = split_paths(process, task.asked.per_level, rng, BRANCH_ABOVE)
    finally:
        process.close()
    return _describe(task, found, process)


def _describe(task: SplitTask, found: Split[DrivenPath], process: Drives) -> Repetition:
    """Returns a repetition as a record."""
    longest = max((len(a) for a in process.apart), default=0)
    noted = [[float(a[k]) for a in process.apart if len(a) > k] for k in range(longest)]
    return Repetition(
        number=task.repetition,
        p=found.p,
        levels=found.levels,
        ancestors=found.ancestors,
        failing=len(found.failing),
        runs=found.paths,
        simulated_s=process.ticks * DT,
        kinds=dict(Counter(path.kind for path in found.failing)),
        faults=process.faults,
        apart=tuple((len(ds), float(np.mean(ds))) for ds in noted),
    )
