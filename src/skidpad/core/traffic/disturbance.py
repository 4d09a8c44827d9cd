"""Disturbances of other drivers: a random acceleration on top of what the scenario asks of a vehicle.

The acceleration is an Ornstein-Uhlenbeck process in units of its standard deviation, drawn once per
`KNOT_S` and held in between: x[0] = z[0], x[k] = r x[k-1] + sqrt(1 - r^2) z[k] with r = exp(-KNOT_S / tau)
and independent standard normal z. So the likelihood of a course of disturbances is that of its z.
"""

from __future__ import annotations

import re
from math import exp, sqrt

from msgspec import Struct

from skidpad.core.errors import ConfigError, require_range
from skidpad.core.text.told import describe_value

# What drivers do beyond the Intelligent Driver Model, pooled over cars of the highD data: a Gaussian
# process of 0.207 m/s^2 with a squared-exponential kernel of length 1.342 s (Zhang and Sun 2024,
# arXiv:2210.03571; output of PGM_highD/MA_IDM_pool_car.ipynb in Chengyuan-Zhang/IDM_Bayesian_Calibration).
# tau is 1.342 s sqrt(pi / 2): both correlations have the same integral, so speeds spread alike in time.
SIGMA, TAU = 0.207, 1.68  # m/s^2, s
SOURCE = "Zhang and Sun 2024, arXiv:2210.03571, pooled cars of highD"
KNOT_S = 1.0
LARGEST = 4.0  # standard deviations that an acceleration stays within; assumption
SHARE = 0.25  # of the speed that the scenario asks for, within which the disturbed one stays; assumption
SIGMAS, TAUS = (0.001, 5.0), (0.1, 60.0)  # that may be asked for
PREFIX = "disturb."  # of names of variables: "disturb.lead.3" is z[3] of `lead`
NUMBER = r"(\d+\.?\d*|\.\d+)"
FORM = re.compile(rf"accel(?:\({NUMBER},{NUMBER}\))?")


class Disturbance(Struct, frozen=True):
    """A vehicle whose acceleration is disturbed: standard deviation in m/s^2, correlation time in s."""

    actor: str
    sigma: float = SIGMA
    tau: float = TAU

    @property
    def source(self) -> str:
        """Returns where size and correlation were read; "" for an assumption."""
        return SOURCE if (self.sigma, self.tau) == (SIGMA, TAU) else ""

    def follow(self, x: float, z: float, *, first: bool) -> float:
        """Returns the next value of the process, in standard deviations, after x with the draw z."""
        r = 0.0 if first else exp(-KNOT_S / self.tau)
        return r * x + sqrt(1.0 - r * r) * z

    def acceleration(self, x: float) -> float:
        """Returns the acceleration in m/s^2 for a value of the process."""
        return self.sigma * min(max(x, -LARGEST), LARGEST)


def name_draw(actor: str, k: int) -> str:
    """Returns the name of the variable that is draw number k of an actor's disturbance."""
    return f"{PREFIX}{actor}.{k}"


def actor_of_draw(name: str) -> str:
    """Returns the actor whose disturbance a variable is a draw of; "" for any other variable."""
    return name.removeprefix(PREFIX).rpartition(".")[0] if name.startswith(PREFIX) else ""


def parse_disturbance(text: str) -> Disturbance:
    """Returns the disturbance of one `--disturb`.

    Raises:
        ConfigError: the text has another form, or a number is out of its range.
    """
    actor, _, words = (part.strip() for part in text.partition("="))
    found = FORM.fullmatch(words.replace(" ", ""))
    if not actor or found is None:
        raise ConfigError(
            "--disturb takes ACTOR=accel, or ACTOR=accel(SIGMA,TAU) with m/s^2 and s; "
            f"got {describe_value(text, 100)}"
        )
    if found[1] is None:
        return Disturbance(actor)
    return Disturbance(
        actor,
        require_range(f"--disturb {actor}: SIGMA", float(found[1]), *SIGMAS),
        require_range(f"--disturb {actor}: TAU", float(found[2]), *TAUS),
    )
