"""The verdict on a scenario that was played: passed, failed, void, not judged or error."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum

from skidpad.evidence.drive.file_criteria import Result
from skidpad.evidence.encounters import DISTANCE, TIME, Encounter, encounter
from skidpad.evidence.expectations import NO_COLLISION, Expectation, parse_expectation
from skidpad.evidence.pairs import EGO, Pair
from skidpad.recording.run.log import RunLog
from skidpad.recording.run.staging import Staging

NO_CONTACT = "no contact of the ego"
NOTHING_UNDER_TEST = "none, as the file drives the ego and nothing is under test"


class PlayVerdict(str, Enum):
    """Verdict of one played run."""

    PASSED = "passed"
    FAILED = "failed"
    VOID = "void"  # the interaction that the file stages did not happen
    NOT_JUDGED = "not judged"  # there is no criterion
    ERROR = "error"  # it could not be played, or not to its end

    @property
    def is_good(self) -> bool:
        """Returns whether a gate may go on: passed, or not judged."""
        return self in (PlayVerdict.PASSED, PlayVerdict.NOT_JUDGED)


@dataclass(frozen=True, slots=True)
class PlayJudgement:
    """A verdict, the criterion in words, and a sentence for each reason."""

    verdict: PlayVerdict
    criterion: str
    reasons: tuple[str, ...] = ()
    failed: Mapping[str, str] | None = None  # what is wrong, by rule


@dataclass(frozen=True, slots=True)
class Counterpart:
    """The ego and one other actor: how near, how critical, how fast they touched."""

    pair: Pair
    encounter: Encounter
    staged: bool  # an event moves it
    contact_t: float | None  # s, first contact
    contact_v_ego: float | None  # m/s of the ego just before it
    contact_v: float | None  # m/s, closing

    @property
    def name(self) -> str:
        """Returns the name of the other actor."""
        return self.pair.other


def counterparts(log: RunLog, found: Sequence[Pair], staging: Staging) -> list[Counterpart]:
    """Returns every actor that was there together with the ego, in the order of `found`."""
    names = log.table.names
    out = []
    for pair in found:
        index = names.index(pair.other)
        begun = [e.began for e in staging.events if pair.other in e.actors and e.began is not None]
        met = encounter(log, EGO, index, min(begun, default=0.0))
        if met is None:
            continue
        first = next((c for c in log.contacts if c.actor == index), None)
        row = None if first is None else max(int(log.tick.searchsorted(first.tick)) - 1, 0)
        out.append(
            Counterpart(
                pair,
                met,
                pair.other in staging.partners,
                None if first is None else first.tick * log.header.dt,
                None if row is None else float(log.v_ego[row]),
                None if first is None else first.v_closing,
            )
        )
    return out


def judge_run(
    staging: Staging,
    others: Sequence[Counterpart],
    rules: Sequence[Expectation],
    of_file: Sequence[Result],
    values: dict[str, float],
) -> PlayJudgement:
    """Returns the verdict on a run that was driven to its end.

    rules: of `--expect`. of_file: results of the file's own criteria. values: numbers for rules.
    """
    criterion, wrong = _criterion(staging, rules, of_file, values)
    failed = {rule: said for rule, said in wrong.items() if said}
    missing = void_reasons(staging, others)
    if failed:
        reasons = tuple(f"{said} ({rule})" for rule, said in failed.items())
        return PlayJudgement(PlayVerdict.FAILED, criterion, reasons, wrong)
    if not wrong:
        return PlayJudgement(PlayVerdict.NOT_JUDGED, criterion, tuple(missing), wrong)
    if missing:
        return PlayJudgement(PlayVerdict.VOID, criterion, tuple(missing), wrong)
    return PlayJudgement(PlayVerdict.PASSED, criterion, (), wrong)


def _criterion(
    staging: Staging,
    rules: Sequence[Expectation],
    of_file: Sequence[Result],
    values: dict[str, float],
) -> tuple[str, dict[str, str]]:
    """Return the criterion in words, and what is wrong by rule; no rule: nothing is judged."""
    if rules:
        wrong = {rule.text: rule.explain_failure(values) for rule in rules}
        return f"--expect {', '.join(wrong)}", wrong
    known = {r.name: r.wrong for r in of_file if r.wrong is not None}
    unknown = [r.name for r in of_file if r.wrong is None]
    if known:
        left_out = f"; {', '.join(unknown)} cannot be judged here" if unknown else ""
        return f"of the file: {', '.join(known)}{left_out}", known
    if staging.driven_by_file:
        return NOTHING_UNDER_TEST, {}
    rule = parse_expectation(NO_COLLISION)
    left_out = f" (the file's {', '.join(unknown)} cannot be judged here)" if unknown else ""
    return NO_CONTACT + left_out, {NO_CONTACT: rule.explain_failure(values)}


def void_reasons(staging: Staging, others: Sequence[Counterpart]) -> list[str]:
    """Returns why the interaction did not happen; [] when it did, or when none is staged."""
    reasons = [
        f"event {event.name.rpartition('::')[2]!r} of {', '.join(event.actors)} never began"
        for event in staging.missing
    ]
    if staging.unreversed:
        reasons.append("the file lets the ego reverse, and it never went backwards")
    if staging.unturned:
        reasons.append("the file lets the ego turn off, and it went another way")
    partners = [c for c in others if c.staged] or ([] if staging.partners else list(others))
    if not partners:
        gone = ", ".join(staging.partners)
        return reasons + ([f"{gone} was never there together with the ego"] if gone else [])
    if not any(c.encounter.met for c in partners):
        reasons.append(_apart(min(partners, key=lambda c: c.encounter.distance)))
    return reasons


def _apart(nearest: Counterpart) -> str:
    """Return a sentence on how the nearest partner missed the ego."""
    met = nearest.encounter
    if met.crossed_after is None:
        how = f"came no nearer than {met.distance:.1f} m"
    elif met.crossed_after > 0.0:
        how = f"crossed the ego's way {met.crossed_after:.1f} s before the ego came"
    else:
        how = f"crossed the ego's way {-met.crossed_after:.1f} s after the ego had passed"
    return f"no partner came within {TIME:g} s or {DISTANCE:g} m: {nearest.name} {how}"
