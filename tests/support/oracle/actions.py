"""Elements of files for reference trajectories, as text."""

from __future__ import annotations

from support.scenarios.files import private


def longitudinal(body: str) -> str:
    return f"<LongitudinalAction>{body}</LongitudinalAction>"


def lateral(body: str) -> str:
    return f"<LateralAction>{body}</LateralAction>"


def profile(*entries: tuple[float, float], other: str = "") -> str:
    rows = "".join(f'<SpeedProfileEntry speed="{v}" time="{t}"/>' for v, t in entries)
    reference = f' entityRef="{other}"' if other else ""
    return longitudinal(
        f'<SpeedProfileAction followingMode="position"{reference}>{rows}</SpeedProfileAction>'
    )


def round_profile(*entries: tuple[float, float]) -> str:
    """Speeds with the times between them, followed within limits of jerk."""
    rows = "".join(f'<SpeedProfileEntry speed="{v}" time="{t}"/>' for v, t in entries)
    bounds = """<DynamicConstraints maxAcceleration="5" maxDeceleration="8" maxSpeed="60"
maxAccelerationRate="4" maxDecelerationRate="3"/>"""
    return longitudinal(
        f'<SpeedProfileAction followingMode="follow">{bounds}{rows}</SpeedProfileAction>'
    )


def smooth_profile(*entries: float, up: float, down: float) -> str:
    """Speeds one after the other without times, followed within limits of jerk, m/s^3."""
    rows = "".join(f'<SpeedProfileEntry speed="{v}"/>' for v in entries)
    bounds = f"""<DynamicConstraints maxAcceleration="3" maxDeceleration="4" maxSpeed="60"
maxAccelerationRate="{up}" maxDecelerationRate="{down}"/>"""
    return longitudinal(
        f'<SpeedProfileAction followingMode="follow">{bounds}{rows}</SpeedProfileAction>'
    )


def gap(how: str, *, continuous: bool, side: str, limits: str = "", axes: str = "") -> str:
    places = {
        "ahead": "leadingReferencedEntity",
        "behind": "trailingReferencedEntity",
        "any": "any",
    }
    system = f' coordinateSystem="{axes}"' if axes else ""
    return longitudinal(f"""<LongitudinalDistanceAction entityRef="ego" {how}{system}
continuous="{str(continuous).lower()}" displacement="{places[side]}">{limits}
</LongitudinalDistanceAction>""")


def limits(a: float, b: float, v: float = 60.0) -> str:
    return f'<DynamicConstraints maxAcceleration="{a}" maxDeceleration="{b}" maxSpeed="{v}"/>'


def lane_change(
    target: str, shape: str = "sinusoidal", value: float = 4.0, dimension: str = "time",
    offset: float = 0.0,
) -> str:  # fmt: skip
    return lateral(f"""<LaneChangeAction targetLaneOffset="{offset}"><LaneChangeActionDynamics
dynamicsShape="{shape}" value="{value}" dynamicsDimension="{dimension}"/>
<LaneChangeTarget>{target}</LaneChangeTarget></LaneChangeAction>""")


def lane_offset(value: float, shape: str = "sinusoidal", a: float = 1.0, other: str = "") -> str:
    target = f'<AbsoluteTargetLaneOffset value="{value}"/>'
    if other:
        target = f'<RelativeTargetLaneOffset entityRef="{other}" value="{value}"/>'
    return lateral(f"""<LaneOffsetAction continuous="false"><LaneOffsetActionDynamics
maxLateralAcc="{a}" dynamicsShape="{shape}"/><LaneOffsetTarget>{target}</LaneOffsetTarget>
</LaneOffsetAction>""")


def beside(
    distance: float, side: str, free: bool = False, axes: str = "entity", limits: str = ""
) -> str:
    bounds = f"><DynamicConstraints {limits}/></LateralDistanceAction>" if limits else "/>"
    return lateral(f"""<LateralDistanceAction entityRef="ego" distance="{distance}"
freespace="{str(free).lower()}" continuous="true" coordinateSystem="{axes}"
displacement="{side}ToReferencedEntity"{bounds}""")


def relative(value: float, kind: str = "delta", continuous: bool = False) -> str:
    return f"""<RelativeTargetSpeed entityRef="ego" value="{value}" speedTargetValueType="{kind}"
continuous="{str(continuous).lower()}"/>"""


def shape_of(body: str, timing: str = "<None/>", closed: bool = False) -> str:
    """A FollowTrajectoryAction along a shape."""
    return f"""<RoutingAction><FollowTrajectoryAction><TrajectoryRef>
<Trajectory name="t" closed="{str(closed).lower()}"><Shape>{body}</Shape></Trajectory></TrajectoryRef>
<TimeReference>{timing}</TimeReference><TrajectoryFollowingMode followingMode="position"/>
</FollowTrajectoryAction></RoutingAction>"""


def timing(domain: str = "relative", scale: float = 1.0, offset: float = 0.0) -> str:
    return f'<Timing domainAbsoluteRelative="{domain}" scale="{scale}" offset="{offset}"/>'


def assigned(*positions: str) -> str:
    points = "".join(
        f'<Waypoint routeStrategy="shortest"><Position>{p}</Position></Waypoint>' for p in positions
    )
    return private(f"""<RoutingAction><AssignRouteAction><Route name="r" closed="false">{points}
</Route></AssignRouteAction></RoutingAction>""")
