"""Bodies of vehicles and people: each fills its box and no more, has what a vehicle has, and its own look."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from skidpad.core.vocabulary import ActorKind
from skidpad.physics.types import vehicle_types
from skidpad.sensors.bodywork.choice import STYLE_OF_TYPE, STYLES, make_body, style_of
from skidpad.sensors.scene.materials import Material
from skidpad.simulation.carla_server.actors.catalogue import Family, load_catalogue
from skidpad.simulation.world.actors import SHAPES

CLOSE = 0.02  # m between a body and each side of its box
BLUEPRINTS = [b for b in load_catalogue().values() if b.family in (Family.VEHICLE, Family.WALKER)]
ALL = (
    [(b.id, b.kind, b.size) for b in BLUEPRINTS]
    + [(n, t.actor_kind, (t.length, t.width, t.height)) for n, t in vehicle_types().items()]
    + [(n, s.kind, (s.length, s.width, s.height)) for n, s in SHAPES.items()]
)
ROAD_VEHICLES = [(id, kind, size) for id, kind, size in ALL if kind <= ActorKind.BUS]


def check_box(mesh, size):
    """Asserts that a mesh lies within the box of that size and touches each side."""
    low = np.array([-0.5 * size[0], -0.5 * size[1], 0.0])
    high = low + size
    assert (mesh.vertices >= low - 1e-9).all()
    assert (mesh.vertices <= high + 1e-9).all()
    assert (mesh.vertices.min(axis=0) <= low + CLOSE).all()
    assert (mesh.vertices.max(axis=0) >= high - CLOSE).all()


@pytest.mark.parametrize(("id", "kind", "size"), ALL, ids=[id for id, _, _ in ALL])
def test_a_body_fills_its_box_and_no_more(id, kind, size):
    body = make_body(id, kind, *size)
    check_box(body.mesh, size)
    used = np.unique(body.mesh.triangles)
    assert used[0] >= 0
    assert used[-1] < len(body.mesh.vertices)


CARS = st.tuples(st.floats(3.4, 5.4), st.floats(1.55, 2.2), st.floats(1.25, 2.1))
KINDS = {
    ActorKind.CAR: CARS,
    ActorKind.VAN: st.tuples(st.floats(4.2, 7.0), st.floats(1.7, 2.3), st.floats(1.8, 2.9)),
    ActorKind.TRUCK: st.tuples(st.floats(5.0, 12.0), st.floats(2.2, 2.9), st.floats(2.4, 4.0)),
    ActorKind.BUS: st.tuples(st.floats(8.0, 15.0), st.floats(2.3, 3.0), st.floats(2.7, 4.0)),
    ActorKind.MOTORCYCLE: st.tuples(st.floats(1.8, 2.5), st.floats(0.7, 1.0), st.floats(1.4, 1.8)),
    ActorKind.BICYCLE: st.tuples(st.floats(1.5, 2.0), st.floats(0.55, 0.9), st.floats(1.55, 1.9)),
    ActorKind.PEDESTRIAN: st.tuples(st.floats(0.3, 0.8), st.floats(0.35, 0.8), st.floats(0.9, 2.0)),
}


@given(st.sampled_from(sorted(KINDS)).flatmap(lambda k: st.tuples(st.just(k), KINDS[k])))
def test_bodies_of_unknown_types_fill_boxes_of_any_usual_size(drawn):
    kind, size = drawn
    check_box(make_body("unknown", kind, *size).mesh, size)


@pytest.mark.parametrize(("id", "kind", "size"), ROAD_VEHICLES, ids=[r[0] for r in ROAD_VEHICLES])
def test_road_vehicles_have_lamps_glass_plates_and_wheels(id, kind, size):
    body = make_body(id, kind, *size)
    found = set(body.mesh.material.tolist())
    assert found >= {
        Material.PAINT, Material.GLASS, Material.LAMP_GLASS, Material.TAIL_LAMP, Material.PLATE,
        Material.INDICATOR_LEFT, Material.INDICATOR_RIGHT, Material.TYRE, Material.RIM,
    }  # fmt: skip
    assert sum(w.steered for w in body.wheels) == 2
    for w in body.wheels:
        rim = body.mesh.vertices[w.first : w.end] - (w.x, w.y, w.z)
        assert np.hypot(rim[:, 0], rim[:, 2]).max() == pytest.approx(w.radius, abs=1e-6)
        assert w.z == pytest.approx(w.radius)
    left = body.mesh.triangles[body.mesh.material == Material.INDICATOR_LEFT]
    assert (body.mesh.vertices[left][:, :, 1] > 0.0).all()


def test_every_type_has_a_style_of_its_own_kind():
    assert set(STYLE_OF_TYPE) >= {id for id, _, _ in ROAD_VEHICLES}
    assert set(STYLE_OF_TYPE.values()) <= set(STYLES)
    looks = [style_of(f"vehicle.{t}", ActorKind.CAR, 4.5, 1.5)
             for t in ("tesla.model3", "audi.tt", "mini.cooper_s")]  # fmt: skip
    assert len(set(looks)) == 3
    walkers = {
        style_of(b.id, b.kind, b.size[0], b.size[2])
        for b in BLUEPRINTS
        if b.family is Family.WALKER
    }
    assert len(walkers) == 4


def test_outlines_of_three_cars_differ_by_more_than_their_size():
    """Heights of the outline at 40 places along the car, as shares: Model 3, TT and Mini stand apart."""
    outlines = []
    for id in ("vehicle.tesla.model3", "vehicle.audi.tt", "vehicle.mini.cooper_s"):
        size = load_catalogue()[id].size
        v = make_body(id, ActorKind.CAR, *size).mesh.vertices / size
        places = np.linspace(-0.48, 0.48, 40)
        top = [v[np.abs(v[:, 0] - p) < 0.05][:, 2].max() for p in places]
        outlines.append(np.array(top))
    for a, b in ((0, 1), (0, 2), (1, 2)):
        assert np.abs(outlines[a] - outlines[b]).max() > 0.08
