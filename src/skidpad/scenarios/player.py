"""The player: an OpenSCENARIO file as a set-up for a backend and as a script that moves its actors."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from skidpad.core.geometry import Pose
from skidpad.core.run import ActorMode
from skidpad.core.setup import DT, ActorCommand, ActorSetup
from skidpad.core.states import WorldTruth
from skidpad.core.vocabulary import ActorKind, Control
from skidpad.roads.bundled import FOLDER, bundled_maps, load_map
from skidpad.roads.queries import RoadMap
from skidpad.scenarios.actions import (
    DeleteEntity,
    Speed,
    Teleport,
    global_action,
    private_action,
)
from skidpad.scenarios.conditions import condition
from skidpad.scenarios.motion import Lane
from skidpad.scenarios.reader import Node, Unsupported, read
from skidpad.scenarios.scene import Actor, Running, Scene
from skidpad.scenarios.storyboard import Storyboard
from skidpad.simulation.scripted import ActorDriver, Motion, nearest_type

KINDS = {
    "car": ActorKind.CAR,
    "van": ActorKind.VAN,
    "truck": ActorKind.TRUCK,
    "semitrailer": ActorKind.TRUCK,
    "bus": ActorKind.BUS,
}
SHAPES = {"bicycle": "bicycle", "motorbike": "bicycle", "pedestrian": "pedestrian"}
EGO_NAMES = ("ego", "hero", "ego_vehicle")
DURATION_MAX = 3600.0  # s, for files that never end
ORIGIN = Pose(0.0, 0.0)


@dataclass
class Entity:
    """One entity of the file, as it is when the scenario begins."""

    name: str
    type: str
    wheels: bool
    properties: Mapping[str, str]
    pose: Pose = ORIGIN
    speed: float = 0.0
    change: Speed | None = None  # of speed, from the begin on
    present: bool = True


@dataclass
class Script:
    """A file, read and checked: entities, storyboard, map."""

    file: Path
    map: RoadMap
    map_name: str
    entities: dict[str, Entity]
    storyboard: Storyboard
    ego: str

    @property
    def ego_entity(self) -> Entity:
        """The ego."""
        return self.entities[self.ego]

    def setups(self) -> tuple[ActorSetup, tuple[ActorSetup, ...]]:
        """The ego and the other actors, for a backend's set-up."""
        made = {
            e.name: ActorSetup(
                name=e.name, type=e.type, place=e.pose, speed=e.speed, driver=Control.SCRIPTED
            )
            for e in self.entities.values()
        }
        return made.pop(self.ego), tuple(made.values())


def load(
    file: Path,
    parameters: Mapping[str, float | str] | None = None,
    ego: str | None = None,
    dt: float = DT,
) -> Script:
    """The file as a script; FileError for what is wrong, Unsupported for what is not known."""
    root = read(file, parameters)
    map, map_name = _map(root, file)
    entities = {e.name: e for e in _entities(root)}
    board = root.child("Storyboard")
    actors = {
        name: Actor(name, 0, None, 0.0, _still(ORIGIN), Lane(map, ORIGIN, 0.0), None)
        for name in entities
    }
    scene = Scene(map, dt, actors)
    _initialise(board.child("Init"), entities, scene)
    script = Script(file, map, map_name, entities, Storyboard(board, dt), "")
    script.ego = _ego(root, entities, ego)
    return script


def problems(file: Path) -> list[Unsupported]:
    """Everything in the file that the player does not support, in the order of lines."""
    root = read(file)
    found: dict[tuple[int, str], Unsupported] = {}

    def look(node: Node) -> None:
        for probe in _probes(node):
            try:
                probe()
            except Unsupported as error:
                found.setdefault((error.line, error.what), error)
        for child in node.children():
            look(child)

    look(root)
    return sorted(found.values(), key=lambda e: (e.line, e.what))


def _probes(node: Node) -> Iterator[Callable[[], object]]:
    """What is tried at an element: only the innermost readers, so that one fault hides no other."""
    if node.tag == "PrivateAction":
        yield lambda: private_action(node)
    elif node.tag == "GlobalAction":
        yield lambda: global_action(node)
    elif node.tag == "UserDefinedAction":
        yield lambda: _refuse(node)
    elif node.tag == "Condition":
        yield lambda: condition(node)
    elif node.tag == "CatalogReference":
        yield lambda: _refuse(node)
    elif node.tag == "ScenarioObject":
        yield lambda: _entity(node)
    elif node.tag == "Actors":
        yield lambda: _refuse_if(node, node.flag("selectTriggeringEntities", default=False))


def _refuse(node: Node) -> None:
    raise Unsupported(node)


def _refuse_if(node: Node, found: bool) -> None:
    if found:
        raise Unsupported(node, "selectTriggeringEntities is not supported")


def _map(root: Node, file: Path) -> tuple[RoadMap, str]:
    """The road beside the file; a bundled map's name where there is no such file."""
    logic = root.child("RoadNetwork").find("LogicFile")
    if logic is None:
        raise root.child("RoadNetwork").error("needs <LogicFile>")
    name = logic.text("filepath")
    stem = Path(name).stem
    if file.parent != FOLDER and (file.parent / name).is_file() and stem not in bundled_maps():
        path = str(file.parent / name)
        return load_map(path), path
    if stem in bundled_maps():
        return load_map(stem), stem
    raise logic.error(f"there is no road file {name!r} beside the scenario")


def _entities(root: Node) -> Iterator[Entity]:
    for node in root.child("Entities").children():
        if node.tag != "ScenarioObject":
            raise Unsupported(node)
        yield _entity(node)


def _entity(node: Node) -> Entity:
    for controller in node.children("ObjectController"):
        if controller.find("CatalogReference") is not None:
            raise Unsupported(controller.child("CatalogReference"))
    body = next(n for n in node.children() if n.tag != "ObjectController")
    if body.tag not in ("Vehicle", "Pedestrian", "MiscObject"):
        raise Unsupported(body)
    properties = {
        p.text("name"): p.text("value")
        for p in (body.find("Properties") or body).children("Property")
    }
    name = node.text("name")
    if body.tag != "Vehicle":
        return Entity(name, "pedestrian" if body.tag == "Pedestrian" else "box", False, properties)
    category = body.text("vehicleCategory")
    if category in SHAPES:
        return Entity(name, SHAPES[category], False, properties)
    if category not in KINDS:
        raise Unsupported(body, f"vehicleCategory={category!r} is not supported")
    size = body.child("BoundingBox", "Dimensions")
    kind = nearest_type(
        KINDS[category], size.number("length"), size.number("width"), size.number("height")
    )
    return Entity(name, kind, True, properties)


def _initialise(init: Node, entities: dict[str, Entity], scene: Scene) -> None:
    """Places and speeds at the begin."""
    actions = init.child("Actions")
    for node in actions.children():
        if node.tag == "GlobalAction":
            action = global_action(node)
            if not isinstance(action, DeleteEntity):
                raise Unsupported(node.only(), "only DeleteEntityAction is supported in <Init>")
            _known(node, entities, action.name).present = False
        elif node.tag == "Private":
            entity = _known(node, entities, node.text("entityRef"))
            for one in node.children("PrivateAction"):
                _initial(one, entity, scene)
        else:
            raise Unsupported(node)


def _known(node: Node, entities: dict[str, Entity], name: str) -> Entity:
    if name not in entities:
        raise node.error(f"there is no entity {name!r}")
    return entities[name]


def _initial(node: Node, entity: Entity, scene: Scene) -> None:
    inner = node.only()
    if inner.tag == "ControllerAction":
        return  # who drives is the player's own choice, by option
    action = private_action(node)
    if isinstance(action, Teleport):
        entity.pose = action.position.pose(scene, entity.name)
        scene.actors[entity.name].motion = _still(entity.pose)
    elif isinstance(action, Speed):
        if action.dynamics.over(1.0, 1.0) == 0.0:
            entity.speed = action.target(scene)
        else:
            entity.change = action
    else:
        raise Unsupported(inner, f"<{inner.tag}> is not supported in <Init>")


def _ego(root: Node, entities: dict[str, Entity], wanted: str | None) -> str:
    if wanted is not None:
        return _known(root.child("Entities"), entities, wanted).name
    marked = [e.name for e in entities.values() if e.properties.get("type") == "ego_vehicle"]
    named = [n for n in entities if n.lower() in EGO_NAMES]
    vehicles = [e.name for e in entities.values() if e.wheels]
    if not vehicles:
        raise root.child("Entities").error("needs a vehicle that is the ego")
    return (marked + named + vehicles)[0]


def _still(pose: Pose) -> Motion:
    return Motion(pose.x, pose.y, pose.yaw, 0.0, 0.0)


class Player:
    """Plays a script: one `step` per tick of the world.

    modes: how each actor is moved, None by somebody else; those not named are physical.
    skill: of the drivers, by actor.
    """

    def __init__(
        self,
        script: Script,
        *,
        modes: Mapping[str, ActorMode | None] | None = None,
        skill: Mapping[str, float] | None = None,
        duration: float = DURATION_MAX,
        dt: float = DT,
    ) -> None:
        self.script, self.duration = script, duration
        self.modes, self.skill = dict(modes or {}), dict(skill or {})
        self.scene = Scene(script.map, dt, {})
        self.ended = False
        self.going: list[Running] = []  # changes of speed from <Init> under way
        self.hit = False  # the ego touched something, which ends the run (B-094)

    @property
    def triggered(self) -> bool:
        """Every event of the scenario has begun."""
        return all(event.happened for event in self.script.storyboard.events)

    def step(self, truth: WorldTruth) -> Sequence[ActorCommand]:
        """Look at the moment, go on with the story, say what actors do until the next."""
        if not self.scene.actors:
            self._cast(truth)
        self.scene.observe(truth)
        self.hit = self.hit or bool(truth.contacts)
        self.going = [action for action in self.going if not action.step(self.scene)]
        self.script.storyboard.step(self.scene)
        t = self.scene.t
        self.ended = self.script.storyboard.ended or self.hit or t >= self.duration
        commands = (a.command(t, self.scene.dt) for a in self.scene.actors.values())
        return [c for c in commands if c is not None]

    def _cast(self, truth: WorldTruth) -> None:
        names = truth.table.names
        for e in self.script.entities.values():
            row = names.index(e.name)
            driver = ActorDriver(e.type, self.skill.get(e.name, 1.0)) if e.wheels else None
            lane = Lane(self.script.map, e.pose, e.speed)
            mode = self.modes.get(e.name, ActorMode.PHYSICAL)
            length = float(truth.table.length[row])
            actor = Actor(e.name, row, mode, length, _still(e.pose), lane, driver)
            self.scene.actors[e.name] = actor
            if not e.present:
                actor.present, actor.word = False, ActorCommand(e.name, present=False)
            if e.change is not None:
                self.going.append(e.change.begin(self.scene, actor))
