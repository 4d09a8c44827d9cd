"""What a user expects of a run: `no-collision`, or a comparison of one of its numbers."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from math import inf

from skidpad.core.text.wording import count_text
from skidpad.evidence.comparisons import parse_comparison
from skidpad.evidence.pairs import Pair, pairs
from skidpad.recording.run.log import RunLog

NO_COLLISION = "no-collision"
LEAST = tuple(name for name in Pair._fields if name.startswith("min_"))
MOST = tuple(name for name in Pair._fields if name.startswith("max_"))
NAMES = ("collisions", "duration_s", *LEAST, *MOST)


@dataclass(frozen=True, slots=True)
class Expectation:
    """One number of a run compares so with `limit`."""

    text: str
    name: str
    compare: Callable[[float, float], bool]
    limit: float

    def explain_failure(self, values: dict[str, float]) -> str:
        """Returns what is wrong in words; "" when it is as expected.

        values: of `run_values`.
        """
        value = values[self.name]
        if self.compare(value, self.limit):
            return ""
        if self.name == "collisions":
            return f"the ego had {count_text(round(value), 'contact')}"
        return f"{self.name} is {value:.4g}"


def parse_expectation(text: str) -> Expectation:
    """Returns what `no-collision`, or a text such as `min_ttc_s > 1.5`, expects of a run.

    One of NAMES, one of > >= < <=, and a number; ConfigError for anything else.
    """
    plain = "collisions <= 0" if text.strip() == NO_COLLISION else text
    name, compare, limit = parse_comparison("--expect", plain, NAMES)
    return Expectation(text, name, compare, limit)


def run_values(log: RunLog, found: Iterable[Pair] | None = None) -> dict[str, float]:
    """Returns the values of NAMES: collisions, duration, and each extreme over the ego's pairs.

    found: the pairs, None: of the log. Without a conflict a least value is inf and a greatest one 0.
    """
    known = list(pairs(log) if found is None else found)
    seconds = float(log.t[-1] - log.t[0]) if len(log) else 0.0
    values = {"collisions": float(len(log.contacts)), "duration_s": seconds}
    values |= {
        n: min((v for p in known if (v := getattr(p, n)) is not None), default=inf) for n in LEAST
    }
    values |= {
        n: max((v for p in known if (v := getattr(p, n)) is not None), default=0.0) for n in MOST
    }
    return values
