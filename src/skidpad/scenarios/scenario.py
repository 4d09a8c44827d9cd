"""From a file to a scenario that can be played: the one compiler, for checks and for runs alike."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from skidpad.core.errors import ConfigError, FileError, NoLaneError
from skidpad.core.files.reading import is_file
from skidpad.recording.run.staging import FileCriterion
from skidpad.roads.bundled import bundled_maps, load_map
from skidpad.roads.map_files import is_made_map, map_file
from skidpad.roads.queries import RoadMap
from skidpad.scenarios.actions.controllers import Activate, Several
from skidpad.scenarios.context import Context
from skidpad.scenarios.criteria import file_criteria
from skidpad.scenarios.movement.network import Network, network_of
from skidpad.scenarios.places.routes import route_position
from skidpad.scenarios.places.trajectories import trajectory_position
from skidpad.scenarios.reading.catalogs import Catalogs
from skidpad.scenarios.reading.document import Node, parse
from skidpad.scenarios.reading.entities import (
    LOCK_MAX,
    Entity,
    choose_ego,
    compile_entities,
    spectator,
)
from skidpad.scenarios.reading.findings import HARMLESS, Fault, Finding, Kind, ScenarioError
from skidpad.scenarios.reading.lenient import fill_in
from skidpad.scenarios.reading.parameters import root_values, variables
from skidpad.scenarios.reading.schema import violations
from skidpad.scenarios.registry import ControllerOf, Names, controller_of
from skidpad.scenarios.shipped import FOLDER
from skidpad.scenarios.signals import SignalController, compile_signals
from skidpad.scenarios.start import Begin, Start, compile_start
from skidpad.scenarios.storyboard import Storyboard, compile_storyboard
from skidpad.scenarios.trailers import line_up, spare_own_trailers

NOTHING: Mapping[str, float | str] = {}
FURTHER_POSITIONS = {
    "RoutePosition": route_position,
    "TrajectoryPosition": trajectory_position,
}
EMPTY_ROAD = "straight"  # for files without a road


@dataclass(frozen=True, slots=True)
class Scenario:
    """A file, compiled: everything that is named in it is there."""

    file: Path
    network: Network
    entities: Mapping[str, Entity]
    ego: str
    start: Start
    storyboard: Storyboard
    parameters: Mapping[str, str]
    variables: Mapping[str, str]
    ego_is_handed_later: bool  # the file drives the ego until it activates its controller
    signals: tuple[SignalController, ...] = ()
    criteria: tuple[FileCriterion, ...] = ()  # by which the file judges a run
    findings: tuple[Finding, ...] = ()  # of the schema, and what is left out on request

    @property
    def map(self) -> RoadMap:
        """Returns the road network on which the scenario plays."""
        return self.network.map

    @property
    def map_name(self) -> str:
        """Returns a bundled map's name, or a file's path."""
        return self.network.name

    @property
    def ego_entity(self) -> Entity:
        """Returns the entity that is the ego."""
        return self.entities[self.ego]


@dataclass(frozen=True, slots=True)
class Compiled:
    """What compiling gives: a scenario where nothing forbids it, and all findings."""

    scenario: Scenario | None
    findings: tuple[Finding, ...]

    def playable(self) -> Scenario:
        """Returns the scenario; ScenarioError lists everything that keeps it from being played."""
        if self.scenario is None:
            raise ScenarioError([f for f in self.findings if f.kind not in HARMLESS])
        return self.scenario


def compile_scenario(
    file: Path,
    parameters: Mapping[str, float | str] = NOTHING,
    *,
    maps: Sequence[Path] = (),
    lenient: bool = False,
) -> Scenario:
    """Returns the file as a scenario; ScenarioError lists everything that keeps it from being played.

    maps: folders with roads that files name without saying where they are. FileError for what is no
    scenario at all. The other options: as in `check`.
    """
    return check(file, parameters, maps=maps, lenient=lenient).playable()


def check(
    file: Path,
    parameters: Mapping[str, float | str] = NOTHING,
    ego: str | None = None,
    *,
    maps: Sequence[Path] = (),
    ignore_unsupported: bool = False,
    lenient: bool = False,
    names: Names | None = None,
) -> Compiled:
    """Compiles a file, and returns the scenario with all findings; FileError for what is no scenario at all.

    ego: the entity that is to be it, None for the file's own; maps: folders with roads;
    ignore_unsupported: what is unknown here is left out; lenient: what is missing but clear is filled
    in, with a warning; names: that the file may use.
    """
    allowed = HARMLESS | {Kind.UNSUPPORTED} if ignore_unsupported else HARMLESS
    root = parse(file)
    findings: list[Finding] = []
    scenario = None
    try:
        findings += violations(root.element, file.name, _minor_revision(root))
        findings += fill_in(root, parameters) if lenient else ()
        scenario = _compile_scenario(
            root, _Wish(parameters, ego, maps, allowed, names or Names()), findings
        )
    except Fault as fault:
        findings.append(fault.finding)
    found = tuple(sorted(set(findings), key=lambda f: (f.file != file.name, f.line, f.what)))
    if not all(f.kind in allowed for f in found):
        scenario = None
    return Compiled(scenario, found)


def _minor_revision(root: Node) -> str:
    """Returns the minor revision of the header, for the schema; "" where none fits (before 1.0)."""
    if root.find("ParameterValueDistribution") is not None:
        raise root.unsupported_fault("a distribution is a campaign of another file: play it as one")
    if root.find("Catalog") is not None:
        raise root.unsupported_fault("a catalog holds no scenario")
    header = root.child("FileHeader")
    if any("$" in str(value) for value in header.element.attrib.values()):
        header = header.with_parameters(root_values(root, {}))
    major, minor = header.whole("revMajor"), header.whole("revMinor")
    if (major, minor) == (0, 9):
        return ""
    if major != 1 or minor > NEWEST:
        raise header.unsupported_fault(f"OpenSCENARIO XML {major}.{minor} is not supported")
    return str(minor)


NEWEST = 3  # minor revision


@dataclass(frozen=True, slots=True)
class _Wish:
    """What is asked of a compilation; allowed: findings in spite of which the file is played."""

    parameters: Mapping[str, float | str]
    ego: str | None
    maps: Sequence[Path]
    allowed: frozenset[Kind]
    names: Names


def _compile_scenario(root: Node, wish: _Wish, findings: list[Finding]) -> Scenario | None:
    """Compiles the scenario of a parsed file; None, with findings, where a fault is not allowed."""
    values = root_values(root, wish.parameters)
    root = root.with_parameters(values)
    findings += oddities(root)
    network = _network(root, wish.maps, findings)
    catalogs = Catalogs(root, findings)
    entities = compile_entities(root, catalogs)
    findings += entities.findings
    watching = spectator(entities.by_name)
    by_name = dict(entities.by_name)
    if watching is not None:
        by_name[watching.name] = watching
        what = f"no vehicle can be the ego: {watching.name!r} stands at the origin"
        findings.append(root.child("Entities").finding(what, Kind.NOTE))
    ctx = Context(
        network, catalogs, by_name, entities.groups, values, variables(root),
        findings=findings, further_positions=FURTHER_POSITIONS,
    )  # fmt: skip
    ctx.names = wish.names
    ctx.controllers, unknown = _entity_controllers(root, catalogs, wish.names)
    board = root.child("Storyboard")
    ctx.added = _added_entities(board)
    signals = ctx.attempt(lambda: compile_signals(root.find("RoadNetwork"))) or ()
    start = compile_start(board.child("Init"), ctx)
    storyboard = compile_storyboard(board, ctx)
    faulty = any(f.kind not in wish.allowed for f in findings)
    chosen = None if faulty else ctx.attempt(lambda: choose_ego(root, by_name, wish.ego))
    if chosen is None:
        return None
    findings += [finding for name, finding in unknown if name != chosen]
    if any(f.kind not in wish.allowed for f in findings):
        return None
    if start.entities[chosen].place is None:
        findings.append(
            board.child("Init").finding(f"the ego {chosen!r} is not there at the begin")
        )
        return None
    later = not start.handed.get(chosen, False) and any(_activations(storyboard, chosen))
    later = later or watching is not None
    absent = dict.fromkeys(ctx.hired, Begin(None, 0.0))
    start = replace(start, entities={**start.entities, **absent})
    start = line_up(start, by_name, network)
    by_name = spare_own_trailers(by_name, chosen)
    return Scenario(
        root.file, network, by_name | ctx.hired, chosen, start, storyboard, values, ctx.variables,
        later, signals, file_criteria(root), tuple(findings),
    )  # fmt: skip


def _entity_controllers(
    root: Node, catalogs: Catalogs, names: Names
) -> tuple[dict[str, ControllerOf], list[tuple[str, Finding]]]:
    """Returns the controllers of entities by name, and what is said of those that are not known."""
    known: dict[str, ControllerOf] = {}
    unknown: list[tuple[str, Finding]] = []
    for entity in root.child("Entities").children("ScenarioObject"):
        for node in entity.children("ObjectController"):
            try:
                found, finding = controller_of(catalogs.resolve(node.only(), "Controller"), names)
            except Fault:
                continue  # its entity says so
            if found is not None:
                known.setdefault(entity.label(), found)
            if finding is not None:
                unknown.append((entity.label(), finding))
    return known, unknown


def _added_entities(board: Node) -> frozenset[str]:
    """Returns the names of entities that events put into the world."""
    found = board.element.iterfind("Story//EntityAction[AddEntityAction]")
    return frozenset(node.get("entityRef", "") for node in found)


def _activations(board: Storyboard, name: str) -> Iterator[bool]:
    """Yields True for each controller of an entity that an event switches on."""
    for story in board.stories:
        for act in story.acts:
            for group in act.groups:
                if name not in group.actors:
                    continue
                events = [e for m in group.manoeuvres for e in m.events]
                for action in (a.private for e in events for a in e.actions):
                    parts = action.actions if isinstance(action, Several) else (action,)
                    yield from (True for p in parts if isinstance(p, Activate) and p.says)


def _network(root: Node, maps: Sequence[Path], findings: list[Finding]) -> Network:
    """Returns the road beside the file; a bundled map by its bare name; a straight road for none.

    A Fault where the road named is not there; a straight road, with a note, where it has no lane.
    """
    logic = root.find("RoadNetwork", "LogicFile")
    if logic is None:
        return network_of(load_map(EMPTY_ROAD), EMPTY_ROAD, stand_in=True)
    name = logic.text("filepath").replace("\\", "/")
    beside = root.file.parent / name
    elsewhere = [folder / f"{Path(name).stem}.xodr" for folder in maps]
    found = [p for p in (beside, *elsewhere) if is_file(p)]
    if found and not _is_bundled(root.file, name):
        path = str(found[0])
    elif _bare(name) in bundled_maps():
        path = _bare(name)
    elif is_made_map(name):
        path = str(map_file(name))
    else:
        raise logic.error(f"there is no road file {name!r} beside the scenario")
    try:
        return network_of(load_map(path), path)
    except NoLaneError as error:
        findings.append(logic.finding(f"{error}: a straight road is taken", Kind.NOTE))
        return network_of(load_map(EMPTY_ROAD), EMPTY_ROAD, stand_in=True)
    except (FileError, ConfigError) as error:
        raise logic.error(f"the road {name!r} cannot be read: {error}") from None


def _bare(name: str) -> str:
    """Returns the name of a map where a file names no folder, else ""."""
    return Path(name).stem if len(Path(name).parts) == 1 else ""


def _is_bundled(file: Path, name: str) -> bool:
    """Returns whether the road beside a scenario of our catalogue is a copy of a bundled one."""
    return file.parent == FOLDER and _bare(name) in bundled_maps()


# What a file says that can be read, but is hardly meant: one note each.

V_MAX = 150.0  # m/s, 540 km/h: faster is no road vehicle


def oddities(root: Node) -> Iterator[Finding]:
    """Yields a note for every absurd speed, count of zero and negative time or distance."""
    for element in root.element.iter(*LOOKS):
        node = Node(element, root.file, root.values)
        try:
            what = LOOKS[node.tag](node)
        except Fault:
            continue  # is reported where it is compiled, or depends on a nested parameter
        if what:
            yield node.finding(what, Kind.NOTE)


def _speed(node: Node) -> str:
    """Returns a remark on a speed above `V_MAX` in m/s; empty where there is none."""
    name = "speed" if node.tag == "SpeedProfileEntry" else "value"
    v = node.number(name) if node.has(name) else 0.0
    return f"{name}: {v:g} m/s is faster than any road vehicle" if abs(v) > V_MAX else ""


def _count(node: Node) -> str:
    """Returns a remark on a maximumExecutionCount of 0 or less; empty where there is none."""
    if node.whole("maximumExecutionCount", 1) > 0:
        return ""
    how = "it never begins" if node.tag == "Event" else "it is carried out once all the same"
    return f"maximumExecutionCount is {node.text('maximumExecutionCount')}: {how}"


def _dynamics(node: Node) -> str:
    """Returns a remark on a negative time or distance of a transition; empty where there is none."""
    if not node.has("value") or node.text("dynamicsShape", "") == "step":
        return ""
    value, dimension = node.number("value"), node.text("dynamicsDimension", "")
    if dimension == "rate" or value >= 0.0:
        return ""
    return f"value: a {dimension} of {value:g} is read as a step"


def _front_axle(node: Node) -> str:
    """Returns a remark on a maxSteering angle in rad out of range; empty where there is none."""
    angle = node.number("maxSteering", 0.0)
    if 0.0 <= angle < LOCK_MAX:
        return ""
    what = f"maxSteering: {angle:g} must be between 0 and {LOCK_MAX:g} rad"
    return f"{what}; that of the usual vehicle is taken"


LOOKS: Mapping[str, Callable[[Node], str]] = {
    "AbsoluteTargetSpeed": _speed,
    "AbsoluteSpeed": _speed,
    "SpeedProfileEntry": _speed,
    "Event": _count,
    "ManeuverGroup": _count,
    "FrontAxle": _front_axle,
    "SpeedActionDynamics": _dynamics,
    "LaneChangeActionDynamics": _dynamics,
}
