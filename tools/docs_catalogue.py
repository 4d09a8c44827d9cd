"""Pages of the site that list every weather, vehicle, tyre and sensor, a section per item.

They are made from what the program itself reads, so they cannot be out of date. Numbers that follow
from an item (water on the road, sight, grip, braking distance) are computed by the models.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from skidpad.core.environment.tyres import TREADS, known_tyres
from skidpad.core.geometry import mps_from_kmh
from skidpad.core.maths.lefthanded import pose_to_carla
from skidpad.core.sensor_types import SENSORS
from skidpad.core.specs import CameraSpec, PointSensorSpec, RadarSpec, SensorSpec
from skidpad.core.vocabulary import GripModel
from skidpad.core.weather import Weather
from skidpad.physics.grip import GripParams, Road, mu_at, road_surface
from skidpad.physics.optics import depth_range, label_range, radar_range, visibility
from skidpad.physics.presets import preset_groups
from skidpad.physics.stopping import stops
from skidpad.physics.types import EGO_TYPE, vehicle_types
from skidpad.sensors.published_sensors import twelve_sensors

V = mps_from_kmh(80.0)
FARTHEST = 1000.0  # m, beyond which distances are not told apart
RADAR_RANGE = next(s.range for s in twelve_sensors() if isinstance(s, RadarSpec))
GROUPS = {
    "matrix": "Weathers of the driver assistance study",
    "grip": "Weathers of the friction study, and snow",
}
WEATHER_TEXT = """\
Use one by `--weather NAME`; a YAML file of the same fields is a weather of your own. Percentages are those
of CARLA. What follows is computed by the physical models ([grip](../physics.md), [sight](../rendering.md))
for new winter tyres; braking is the default ego's full stop from 80 km/h."""
VEHICLE_TEXT = f"""\
The ego is `{EGO_TYPE}` unless a scenario says otherwise; background traffic draws from the cars. How they
move is on the page on [physics](../physics.md). Pictures show what `--bodywork shaped` draws
([bodies](../rendering.md#bodies))."""
TYRE_TEXT = f"""\
Chosen by `--set tyres=NAME`. A name may end in {", ".join(f"`{s}`" for s in TREADS if s)}, the tread that is
left; without it the tyre is new. Frictions are those of a road on which a new winter tyre has 0.9."""
SENSOR_TEXT = """\
Positions are in m and degrees on CARLA's axes: x forward, y to the right, z up, from the middle of the
footprint on the road. What weather does to them: [cameras and radar](../rendering.md),
[lidar](../lidar-weather.md)."""
ASKED_TEXT = """\
A stack names these in `sensors()`; readings arrive in `frame.extra` by id. [Your own stack](../your-stack.md)
shows how, [extending](../extending.md) how to add a sensor."""


def on_files(files: Any, config: Any) -> Any:
    """Adds the pages to the site's files."""
    from mkdocs.structure.files import File

    for name, page in (
        ("weathers", weather_page),
        ("vehicles", vehicle_page),
        ("sensors", sensor_page),
    ):
        files.append(File.generated(config, f"reference/{name}.md", content=page()))
    return files


def weather_page() -> str:
    """Returns a section per weather preset: what is set, and what follows from it."""
    presets = {g: list(members.values()) for g, members in preset_groups().items()}
    grips = [Road(w, GripModel.PHYSICAL).params() for each in presets.values() for w in each]
    braking = iter([stop.distance for stop in stops(grips, [V] * len(grips))])
    lines = [
        "# Weather presets",
        "",
        WEATHER_TEXT,
    ]
    for group, weathers in presets.items():
        lines += ["", f"## {GROUPS.get(group, group)}"]
        for weather in weathers:
            lines += _weather_lines(weather, next(braking))
    return "\n".join(lines) + "\n"


def _weather_lines(weather: Weather, braking: float) -> list[str]:
    surface, grip = road_surface(weather), Road(weather, GripModel.PHYSICAL).params()
    plain = Weather()
    told = {n: v for n, v in weather.values().items() if v != getattr(plain, n)}
    return [
        "", f"### {weather.name}", "", f"{weather.title or weather.name}.", "",
        *_table(
            ("quantity", "value"),
            [
                ("set", ", ".join(f"`{n}` {v:g}" for n, v in told.items()) or "nothing"),
                ("rain", f"{surface.rain_mm_h:.1f} mm/h"),
                ("water on the road", f"{surface.film_mm:.2f} mm"),
                ("ice, snow on the road", f"{surface.ice_mm:.1f}, {surface.snow_mm:.1f} mm"),
                ("visibility", _far(visibility(weather))),
                ("depth is measured to", _far(depth_range(weather))),
                ("objects are labelled to", _far(label_range(weather))),
                ("the radar reaches", _far(radar_range(weather, RADAR_RANGE))),
                ("friction at 0, 80 km/h", f"{_mu(grip, 0.0):.2f}, {_mu(grip, V):.2f}"),
                ("braking from 80 km/h", f"{braking:.1f} m"),
            ],
        ),
    ]  # fmt: skip


def _far(distance: float) -> str:
    return f"{distance:.0f} m" if distance < FARTHEST else f"over {FARTHEST:.0f} m"


def _mu(grip: GripParams, v: float) -> float:
    return float(mu_at(grip, v))


def vehicle_page() -> str:
    """Returns a section per vehicle type and per kind of tyre, with sources."""
    lines = [
        "# Vehicles and tyres",
        "",
        VEHICLE_TEXT,
    ]
    for name, v in vehicle_types().items():
        lines += ["", f"## {name}", "", f"{v.title}. Source: {v.source}.", ""]
        lines += [f"![{v.title} from five sides](../img/bodies/{name}.webp)", ""]
        lines += _table(
            ("quantity", "value"),
            [
                ("length, width, height", f"{v.length:.2f}, {v.width:.2f}, {v.height:.2f} m"),
                ("mass with driver", f"{v.mass:.0f} kg"),
                ("wheelbase, track", f"{v.wheelbase:.2f}, {v.track:.2f} m"),
                ("height of the centre of gravity", f"{v.cog_height:.2f} m"),
                ("weight on the front axle", f"{100 * v.front_share:.0f} %"),
                ("driven wheels, power", f"{v.drive.value}, {v.power / 1000:.0f} kW"),
                ("brake torque of a front wheel", f"{v.brake_torque_front:.0f} N m"),
                ("brake torque of a rear wheel", f"{v.brake_torque_rear:.0f} N m"),
                ("drag area", f"{v.drag_area:.2f} m²"),
                ("tread width", f"{1000 * v.tyre_width:.0f} mm"),
            ],
        )  # fmt: skip
    lines += ["", "## Tyres", "", TYRE_TEXT, ""]
    kinds = {n: t for n, t in known_tyres().items() if not any(n.endswith(s) for s in TREADS if s)}
    lines += _table(
        ("name", "tyre", "dry", "ice at -5 °C", "packed snow", "source"),
        [
            (f"`{n}`", t.title, f"{t.dry:.2f}", f"{t.ice:.3f}", f"{t.snow:.2f}", t.source)
            for n, t in kinds.items()
        ],
    )
    return "\n".join(lines) + "\n"


def sensor_page() -> str:
    """Returns the published suite, and a section per sensor that a stack can ask for."""
    lines = [
        "# Sensors",
        "",
        SENSOR_TEXT,
        "",
        "## The twelve of the driver assistance study",
        "",
    ]
    lines += _table(
        ("id", "measures", "x, y, z", "pitch, yaw", "properties"),
        [_mounted(spec) for spec in twelve_sensors()],
    )
    lines += [
        "",
        "## What a stack can ask for",
        "",
        ASKED_TEXT,
    ]
    for kind in SENSORS.entries():
        lines += ["", f"### {kind.name}", "", f"{kind.title}.", ""]
        word = f'("id", "{kind.word}")' if kind.word else '("id", ...)'
        lines += _table(
            ("quantity", "value"),
            [
                ("ask for it by", f"`skidpad.core.specs.{kind.spec.__name__}{word}`"),
                ("a reading", f"`{kind.reading.__name__}`: {kind.units}"),
            ],
        )
    return "\n".join(lines) + "\n"


def _mounted(spec: SensorSpec) -> tuple[str, ...]:
    """A row of the published suite."""
    x, y, z, _, pitch, yaw = (round(v, 3) + 0.0 for v in pose_to_carla(spec.mount))
    where, turned = f"{x:g}, {y:g}, {z:g}", f"{pitch:g}, {yaw:g}"
    match spec:
        case CameraSpec():
            size = f"{spec.width} x {spec.height} px, {spec.fov_deg:g} degrees across"
            return f"`{spec.id}`", spec.modality.value, where, turned, size
        case RadarSpec():
            field = f"{spec.horizontal_fov_deg:g} x {spec.vertical_fov_deg:g} degrees"
            rate = f"{spec.points_per_second} points/s"
            return f"`{spec.id}`", "radar", where, turned, f"{field}, {spec.range:g} m, {rate}"
        case PointSensorSpec():
            return f"`{spec.id}`", spec.kind, where, turned, ""
    raise TypeError(f"no row for {spec}")


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    """A table in Markdown."""
    return [
        f"| {' | '.join(head)} |",
        f"|{'---|' * len(head)}",
        *(f"| {' | '.join(cell.replace('|', '/') for cell in row)} |" for row in rows),
    ]
