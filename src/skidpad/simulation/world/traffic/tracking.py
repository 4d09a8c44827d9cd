"""From a wanted path and acceleration to steer and pedals, through the vehicle's own dynamics."""

from __future__ import annotations

from math import atan, cos, sin

from skidpad.core.kernels.jit import inner_kernel
from skidpad.core.maths.constants import G
from skidpad.physics.vehicle import V_CLUTCH, steer_share
from skidpad.simulation.world.traffic.care import change_pace, steering_limit, traction_limit
from skidpad.simulation.world.traffic.path import PATH
from skidpad.simulation.world.traffic.state import CHANGE_TIME, Drivers, View

OMEGA, ZETA = 1.0, 0.9  # rad/s and damping of the lateral control: half the yaw response's
PREVIEW_TIME = 0.25  # s by which the curvature is anticipated: steering and yaw lag
V_LATERAL_MIN = 4.0  # m/s, keeps gains finite at walking speed
THROTTLE_MAX = 0.85  # CARLA's Traffic Manager
PEDAL_GAIN = 0.5  # 1/s, integral on the acceleration error
TRIM_MAX = 1.0  # m/s^2
V_STANDING = 0.3  # m/s
BRAKE_STANDING = 0.5


@inner_kernel
def steer(view: View, d: Drivers, i: int) -> float:
    """Returns the steer command that tracks the path: the curvature ahead plus a second-order control.

    The lateral offset obeys e'' = -OMEGA^2 e - 2 ZETA OMEGA e', as v^2 times curvature is lateral
    acceleration. In a lane change the wanted offset slides from `shift` to 0 along a quintic.
    """
    me, trait, body = d.state[i], d.trait[i], view.placed[i]
    v = max(body.speed, V_LATERAL_MIN)
    tau = min(me.change / CHANGE_TIME, 1.0)
    blend = tau * tau * tau * (10.0 + tau * (6.0 * tau - 15.0))
    rate = change_pace(view.care, body.speed) / CHANGE_TIME
    blend_rate = 30.0 * (tau * (1.0 - tau)) ** 2 * rate
    blend_bend = 60.0 * tau * (1.0 - tau) * (1.0 - 2.0 * tau) * rate**2
    error = me.offset - me.shift * (1.0 - blend)
    drift = body.vy * cos(me.heading) - body.vx * sin(me.heading)
    error_rate = drift + me.shift * blend_rate
    kappa = curvature_ahead(view, d, i, v * PREVIEW_TIME)
    a_lateral = -me.shift * blend_bend - OMEGA * OMEGA * error - 2.0 * ZETA * OMEGA * error_rate
    kappa += a_lateral / (v * v)
    most = steering_limit(view.care, body.speed) / max(body.speed, V_STANDING) ** 2
    kappa = min(max(kappa, -most), most)
    angle = atan(trait.wheelbase * kappa) + trait.understeer * v * v * kappa
    return float(min(max(angle / (trait.steer_angle * steer_share(v)), -1.0), 1.0))


@inner_kernel
def curvature_ahead(view: View, d: Drivers, i: int, distance: float) -> float:
    """Returns the curvature of the path `distance` m ahead, 1/m; 0 behind its end."""
    s = d.state[i].s + distance
    for k in range(PATH):
        if d.path[i, k] < 0:
            return 0.0
        lane = view.streets.net.lane[d.path[i, k]]
        if s <= lane.length:
            j = int(s / lane.length * (lane.size - 1))
            return float(view.streets.net.point[lane.first + max(j, 0)].curvature)
        s -= lane.length
    return 0.0


@inner_kernel
def pedals(view: View, d: Drivers, i: int) -> tuple[float, float]:
    """Returns throttle and brake for the acceleration asked for: feedforward plus integral (`trim`)."""
    me, trait, body = d.state[i], d.trait[i], view.placed[i]
    v, a = body.speed, me.target
    if v < V_STANDING and a <= 0.05:
        me.trim = 0.0
        return 0.0, BRAKE_STANDING
    grade = view.streets.net.point[me.at].grade
    wanted = a + G * grade + trait.drag * v * v + trait.rolling + me.trim
    sideways = body.vy * cos(body.yaw) - body.vx * sin(body.yaw)
    slide = (sideways - 0.5 * trait.wheelbase * body.yaw_rate) / max(v, 2.0)
    if wanted >= 0.0:
        force = min(trait.a_drive, trait.p_drive / max(v, 1.0))
        drag = trait.engine_drag * min(v / V_CLUTCH, 1.0)
        most = (traction_limit(view.care, v, trait.carried, slide) + drag) / (force + drag)
        throttle, brake = min(wanted / force, most), 0.0
    else:
        throttle, brake = 0.0, -wanted / trait.a_brake
    if throttle < THROTTLE_MAX and brake < 1.0:
        trim = me.trim + PEDAL_GAIN * (a - body.ax) * view.dt
        me.trim = min(max(trim, -TRIM_MAX), TRIM_MAX)
    return min(throttle, THROTTLE_MAX), min(brake, 1.0)
