"""Manoeuvres that show how far the vehicle can be trusted; `python tools/vehicle_validation.py DIR`
draws the figures of docs/physics.md, writes step-steer.csv beside DIR and prints its tables of
manoeuvres. The comparison needs
commonroad-vehicle-models (extra `test`).
"""

from __future__ import annotations

import csv
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from avoidance import ENDS, Lanes, attempts, highest, through
from manoeuvres import (
    DWELL,
    DWELL_FREQUENCY,
    DWELL_SPEED,
    MU,
    RATIOS,
    Bench,
    dwell_steer,
    dwell_unit,
    lateral_limit,
    pedals_in_turn,
    sine_with_dwell,
    time_to_speed,
    understeer,
)
from skidpad.core.errors import MissingExtra
from skidpad.core.geometry import Pose, kmh_from_mps, mps_from_kmh
from skidpad.core.maths.constants import G
from skidpad.physics.fleet import Fleet
from skidpad.physics.grip import GripParams, RoadSurface, mu_at, physical_params, stiffness_at
from skidpad.physics.stopping import stops
from skidpad.physics.types import EGO_TYPE, DrivenWheels, VehicleType, traffic_types, vehicle_type
from skidpad.physics.vehicle import steer_share

Floats = NDArray[np.float64]

TICK = 0.01  # s
# Parameters of vehicle 2 (BMW 320i) of commonroad-vehicle-models 3.0.2, in our terms. Brakes are
# strong enough for the deceleration to be demanded, split as there (66 % front).
ORACLE = VehicleType(
    title="BMW 320i of commonroad-vehicle-models",
    kind="car",
    length=4.508,
    width=1.61,
    height=1.45,
    mass=1093.3,
    wheelbase=2.579,
    front_overhang=0.9,
    track=1.387,
    cog_height=0.614,
    front_share=1.4227 / 2.579,
    wheel_radius=0.344,
    wheel_inertia=1.7,
    drive=DrivenWheels.REAR,
    power=150_000.0,
    force_max=8000.0,
    brake_torque_front=1500.0,
    brake_torque_rear=773.0,
    drag_area=0.0,
    rolling_resistance=0.0,
    engine_drag=0.0,
    stiffness_front=21.92,
    stiffness_rear=21.92,
    source="commonroad-vehicle-models 3.0.2, parameters_vehicle2",
)
ORACLE_MU = 1.05  # its peak lateral friction


@dataclass(frozen=True, slots=True)
class Trace:
    """One manoeuvre over time, arrays (k,)."""

    t: Floats
    x: Floats
    y: Floats
    yaw: Floats
    v: Floats
    yaw_rate: Floats


# Surfaces of the step steer: depth of water, ice and snow, mm
SURFACES = {
    "dry": (0.0, 0.0, 0.0),
    "0.5 mm of water": (0.5, 0.0, 0.0),
    "1 mm of water": (1.0, 0.0, 0.0),
    "packed snow": (0.0, 0.0, 50.0),
    "sheet ice, -5 C": (0.0, 3.0, 0.0),
}
STEP_SPEED, STEP_DEMAND = (
    20.0,
    0.3,
)  # m/s; of the friction, as lateral acceleration of a neutral car
RISEN = 0.9  # of the last yaw rate


def drive(fleet: Fleet, duration: float, mu: float, commands: Any) -> Trace:
    """Drive vehicle 0; commands(t, fleet) gives throttle, brake, steer, handbrake, reverse."""
    rows = []
    for k in range(round(duration / fleet.dt)):
        inputs = np.array([commands(k * fleet.dt, fleet)], dtype=np.float64)
        fleet.step(inputs, np.full((1, 4), mu))
        s = fleet.states
        rows.append((k * fleet.dt, s.x[0], s.y[0], s.yaw[0], fleet.speed(0), s.yaw_rate[0]))
    return Trace(*np.array(rows).T)


def placed(kind: VehicleType, v: float, **options: Any) -> Fleet:
    """One vehicle at the origin, heading along x at speed v."""
    fleet = Fleet([kind], TICK, **options)
    fleet.place(0, Pose(0.0, 0.0), v)
    return fleet


def step_steer(
    v: float, delta: float, duration: float = 2.5, mu: float = ORACLE_MU, stiffness: float = 1.0
) -> Trace:
    """Our model of ORACLE: road-wheel angle delta at once, speed held.

    stiffness: slip stiffness of all tyres over the dry one.
    """

    def commands(_: float, fleet: Fleet) -> tuple[float, ...]:
        speed = fleet.speed(0)
        steer = delta / (ORACLE.steer_max * steer_share(speed))
        return max(0.5 * (v - speed), 0.0), 0.0, steer, 0.0, 0.0

    fleet = placed(ORACLE, v)
    fleet.stiffness[:] = stiffness
    return drive(fleet, duration, mu, commands)


def brake(v: float, deceleration: float, duration: float = 6.0) -> Trace:
    """Our model of ORACLE: a pedal that asks for this deceleration."""
    full = 2.0 * (ORACLE.brake_torque_front + ORACLE.brake_torque_rear)
    pedal = deceleration * ORACLE.mass * ORACLE.wheel_radius / full
    return drive(placed(ORACLE, v), duration, ORACLE_MU, lambda *_: (0, pedal, 0, 0, 0))


def oracle(
    v: float, delta: float, deceleration: float, duration: float, mu: float = ORACLE_MU,
    stiffness: float = 1.0,
) -> Trace:  # fmt: skip
    """The single-track drift model of commonroad-vehicle-models under the same demand.

    mu and stiffness scale its Magic Formula tyres: peak friction and initial slope, along and across.
    """
    try:
        from vehiclemodels.init_std import init_std
        from vehiclemodels.parameters_vehicle2 import parameters_vehicle2
        from vehiclemodels.vehicle_dynamics_std import vehicle_dynamics_std
    except ImportError as error:
        raise MissingExtra("the comparison of vehicle models", "test") from error
    dt = 0.001
    p = parameters_vehicle2()
    p.tire.p_dx1, p.tire.p_dy1 = p.tire.p_dx1 * mu / ORACLE_MU, p.tire.p_dy1 * mu / ORACLE_MU
    p.tire.p_kx1, p.tire.p_ky1 = p.tire.p_kx1 * stiffness, p.tire.p_ky1 * stiffness
    state = np.array(init_std([0.0, 0.0, 0.0, v, 0.0, 0.0, 0.0], p))
    rows = []
    for k in range(round(duration / dt)):
        if state[3] < 0.3:
            break
        rate = float(np.clip((delta - state[2]) / dt, -0.4, 0.4))
        state = state + dt * np.array(vehicle_dynamics_std(list(state), [rate, -deceleration], p))
        rows.append((k * dt, state[0], state[1], state[4], state[3], state[5]))
    return Trace(*np.array(rows).T)


def rise_time(trace: Trace) -> float:
    """s from the step of the steer until the yaw rate has come to RISEN of the last one."""
    return float(trace.t[np.argmax(np.abs(trace.yaw_rate) > RISEN * abs(trace.yaw_rate[-1]))])


def rises() -> list[dict[str, float | str]]:
    """Rise times of the yaw rate on SURFACES, here and in the drift model: rows of docs/step-steer.csv."""
    rows: list[dict[str, float | str]] = []
    for name, (film, ice, snow) in SURFACES.items():
        surface = RoadSurface(film, ice, snow, 0.0, -5.0 if ice or snow else 15.0)
        params = physical_params(surface, stiffness=True)
        mu, stiffness = mu_at(params, STEP_SPEED), stiffness_at(params, STEP_SPEED)
        delta = STEP_DEMAND * mu * G * ORACLE.wheelbase / STEP_SPEED**2
        ours = step_steer(STEP_SPEED, delta, 4.0, mu, stiffness)
        theirs = oracle(STEP_SPEED, delta, 0.0, 4.0, mu, stiffness)
        plain = step_steer(STEP_SPEED, delta, 4.0, mu)
        rows.append(
            {
                "surface": name,
                "friction": round(mu, 3),
                "stiffness": round(stiffness, 3),
                "rise_here_s": round(rise_time(ours), 2),
                "rise_drift_model_s": round(rise_time(theirs), 2),
                "rise_here_dry_stiffness_s": round(rise_time(plain), 2),
                "yaw_rate_here_rad_s": round(float(ours.yaw_rate[-1]), 4),
                "yaw_rate_drift_model_rad_s": round(float(theirs.yaw_rate[-1]), 4),
            }
        )
    return rows


def handbrake_turn(mu: float, v: float, steer: float = 0.02) -> Trace:
    """The ego under handbrake with a little steer until it stands."""
    fleet = placed(vehicle_type(EGO_TYPE), v)
    return drive(fleet, 30.0, mu, lambda t, _: (0, 0, steer, float(t > 0.5), 0))


def _stopping_figure(axes: Any) -> None:
    mus = np.geomspace(0.08, 1.05, 25)
    for kmh, colour in ((50.0, "tab:blue"), (80.0, "tab:orange"), (100.0, "tab:green")):
        v = mps_from_kmh(kmh)
        for anti_lock, style in ((True, "-"), (False, "--")):
            params = [GripParams(float(mu), 1.0, 0.0, 0.0) for mu in mus]
            found = stops(params, [v] * len(mus), anti_lock=anti_lock)
            label = f"{kmh:g} km/h, {'anti-lock' if anti_lock else 'locked'}"
            axes.loglog(mus, [s.distance for s in found], style, color=colour, label=label)
        axes.loglog(mus, v * v / (2 * G * mus), ":", color="black", linewidth=0.8)
    axes.plot([], [], ":", color="black", label="v² / (2 mu g)")
    axes.set(xlabel="friction coefficient", ylabel="stopping distance, m")
    axes.grid(which="both", alpha=0.25)
    axes.legend(fontsize=8)


def _step_figure(axes: Any) -> None:
    for delta in (0.015, 0.03):
        ours, theirs = step_steer(20.0, delta), oracle(20.0, delta, 0.0, 2.5)
        axes.plot(ours.t, ours.yaw_rate, label=f"ours, {delta:g} rad")
        axes.plot(theirs.t, theirs.yaw_rate, "--", label=f"drift model, {delta:g} rad")
        axes.axhline(20.0 * np.tan(delta) / ORACLE.wheelbase, color="black", lw=0.6, ls=":")
    axes.set(xlabel="time, s", ylabel="yaw rate, rad/s", title="step steer at 20 m/s")
    axes.grid(alpha=0.25)
    axes.legend(fontsize=8)


def _brake_figure(axes: Any) -> None:
    for a in (4.0, 8.0):
        ours, theirs = brake(mps_from_kmh(100.0), a, 9.0), oracle(mps_from_kmh(100.0), 0.0, a, 10.0)
        axes.plot(ours.x, kmh_from_mps(1.0) * ours.v, label=f"ours, {a:g} m/s²")
        axes.plot(theirs.x, kmh_from_mps(1.0) * theirs.v, "--", label=f"drift model, {a:g} m/s²")
    axes.set(xlabel="distance, m", ylabel="speed, km/h", title="braking from 100 km/h")
    axes.grid(alpha=0.25)
    axes.legend(fontsize=8)


def _spin_figure(axes: Any) -> None:
    for mu, colour in ((0.9, "tab:blue"), (0.4, "tab:orange"), (0.15, "tab:green")):
        trace = handbrake_turn(mu, mps_from_kmh(50.0))
        turned = np.degrees(np.unwrap(trace.yaw)[-1])
        axes.plot(trace.x, trace.y, color=colour, label=f"mu {mu:g}: turned by {turned:.0f}°")
        every = slice(None, None, 40)
        axes.quiver(
            trace.x[every],
            trace.y[every],
            np.cos(trace.yaw[every]),
            np.sin(trace.yaw[every]),
            color=colour,
            scale=40,
            width=0.003,
        )
    axes.set(xlabel="x, m", ylabel="y, m", title="handbrake at 50 km/h, steer 0.02")
    axes.grid(alpha=0.25)
    axes.legend(fontsize=8)


def _dwell_figure(axes: Any) -> None:
    kind = vehicle_type(EGO_TYPE)
    unit, end = dwell_unit(kind), 1.0 / DWELL_FREQUENCY + DWELL
    for stability, style in ((True, "-"), (False, "--")):
        bench = Bench([kind] * 3, DWELL_SPEED, stability=stability)
        amplitudes = np.array([2.0, 5.0, 9.0])
        while bench.ticks * TICK < end + 2.0:
            bench.step(unit * amplitudes * dwell_steer(bench.ticks * TICK))
        t = bench.trace()
        for i, colour in enumerate(("tab:blue", "tab:orange", "tab:green")):
            label = f"{amplitudes[i]:g}, {'with' if stability else 'without'} control"
            axes.plot(t.t, np.degrees(t.yaw_rate[:, i]), style, color=colour, label=label)
    for after, share in RATIOS:
        axes.axvline(end + after, color="black", lw=0.6, ls=":")
        axes.text(end + after, 32.0, f" {share:.0%}", fontsize=8)
    axes.set(xlabel="time, s", ylabel="yaw rate, deg/s", title="sine with dwell at 80 km/h")
    axes.grid(alpha=0.25)
    axes.legend(fontsize=8)


def _avoidance_figure(axes: Any) -> None:
    kind, lanes = vehicle_type(EGO_TYPE), Lanes.of(vehicle_type(EGO_TYPE).width)
    for k in range(3):
        for y in (lanes.right[k], lanes.left[k]):
            axes.plot(ENDS[2 * k : 2 * k + 2], [y, y], color="black")
    for stability, colour in ((True, "tab:blue"), (False, "tab:orange")):
        t = attempts(kind, 68.0, stability=stability)
        passed = through(kind, t)
        best = (
            int(np.argmax(passed)) if passed.any() else int(np.argmin(np.abs(t.slip).max(axis=0)))
        )
        word = "with" if stability else "without"
        label = f"{word} control: {int(passed.sum())} of {len(passed)} drivers through"
        axes.plot(t.x[:, best], t.y[:, best], color=colour, label=label)
    axes.set(xlabel="x, m", ylabel="y, m", title="obstacle avoidance at 68 km/h", xlim=(-15, 75))
    axes.grid(alpha=0.25)
    axes.legend(fontsize=8)


def _turn_figure(axes: Any) -> None:
    shares = (0.4, 0.5, 0.6, 0.7, 0.8)
    for brake, colour in ((0.0, "tab:blue"), (0.2, "tab:orange"), (1.0, "tab:green")):
        for stability, style in ((True, "-"), (False, "--")):
            slip = [
                pedals_in_turn(vehicle_type(EGO_TYPE), s * MU * G, (brake,), stability=stability)[0]
                for s in shares
            ]
            label = f"pedal {brake:g}, {'with' if stability else 'without'} control"
            values = [min(float(np.degrees(p.slip)), 60.0) for p in slip]
            axes.plot(shares, values, style, color=colour, label=label)
    axes.set(xlabel="lateral acceleration over mu g", ylabel="largest side slip, deg (60: spun)",
             title="lift-off and brakes on R 100 m")  # fmt: skip
    axes.grid(alpha=0.25)
    axes.legend(fontsize=8)


def table() -> str:
    """What the standards' manoeuvres give for every passenger car, as Markdown."""
    heads = (
        "car", "understeer, deg/g; characteristic speed", "lateral limit, mu 0.9", "0 to 100 km/h",
        "sine with dwell passed to, with / without", "obstacle avoidance, with / without",
    )  # fmt: skip
    rows = [f"| {' | '.join(heads)} |", "|---" * len(heads) + "|"]
    for name in traffic_types():
        kind = vehicle_type(name)
        gradient = understeer(kind)
        speed = kmh_from_mps(float(np.sqrt(kind.wheelbase / gradient)))
        dwell = [_stable_to(kind, stability) for stability in (True, False)]
        cones = [highest(kind, stability=stability) for stability in (True, False)]
        rows.append(
            f"| {kind.title} | {np.degrees(gradient) * G:.1f}; {speed:.0f} km/h "
            f"| {lateral_limit(kind) / G:.2f} g | {time_to_speed(kind, mps_from_kmh(100.0)):.1f} s "
            f"| {dwell[0]:g} / {dwell[1]:g} | {cones[0]} / {cones[1]} km/h |"
        )
    return "\n".join(rows)


def _stable_to(kind: VehicleType, stability: bool) -> float:
    """Largest amplitude up to 9 below which every sine with dwell is passed."""
    amplitudes = np.arange(1.5, 9.1, 0.5).tolist()
    passed = 0.0
    for done in sine_with_dwell(kind, amplitudes, stability=stability):
        if not (done.stable and done.responsive):
            break
        passed = done.amplitude
    return passed


def main(folder: Path) -> None:
    """Write the figures into `folder`, print the table."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot as plt

    pages = {
        "stopping": (_stopping_figure,),
        "handling": (_step_figure, _brake_figure, _spin_figure),
        "limits": (_dwell_figure, _turn_figure, _avoidance_figure),
    }
    folder.mkdir(parents=True, exist_ok=True)
    for name, panels in pages.items():
        width = 7.0 if len(panels) == 1 else 4.8 * len(panels)
        figure, axes = plt.subplots(1, len(panels), figsize=(width, 4.2), layout="constrained")
        for panel, place in zip(panels, np.atleast_1d(axes), strict=True):
            panel(place)
        figure.savefig(folder / f"physics_{name}.png", dpi=75)
        plt.close(figure)
    rows = rises()
    with (folder.parent / "step-steer.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, rows[0], lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
    print(table())


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path("docs/img"))
