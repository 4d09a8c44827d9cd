"""OpenCRG surfaces: hollows of a cross section by hand, and puddles of a file where its package is there."""

import sys

import numpy as np
import pytest

from skidpad.core.errors import ConfigError, FileError, MissingExtra
from skidpad.simulation.world.crg import (
    LEVELS_MM,
    hollow_depths,
    puddles,
    read_crg,
    slippery_parts,
)
from skidpad.simulation.world.surface_files import read_surface

V = np.linspace(-1.5, 1.5, 61)


def rut(depth, at=0.5, half=0.3, fall=0.0):
    """Heights of a cross section with a trough of a cosine's form and a cross fall."""
    inside = np.abs(V - at) < half
    return fall * V - np.where(inside, depth * 0.5 * (1 + np.cos(np.pi * (V - at) / half)), 0.0)


def test_a_level_road_with_a_rut_holds_as_much_as_it_is_deep():
    depth = hollow_depths(rut(0.008))
    assert depth.max() == pytest.approx(0.008, rel=1e-6)
    assert V[depth.argmax()] == pytest.approx(0.5)
    assert not depth[V < 0.19].any()


def test_cross_fall_empties_a_rut_to_its_lower_rim():
    """The flank falls by 0.5 pi 8 mm / 0.3 m = 4.2 % at most: 2 % leave some water, 6 % none.

    On 2 % the rim is 4 mm high and the lowest point 1.2 mm, by hand.
    """
    assert hollow_depths(rut(0.008, fall=0.02)).max() == pytest.approx(0.0029, abs=2e-4)
    assert not hollow_depths(rut(0.008, fall=0.06)).any()


def test_a_crown_and_an_even_slope_hold_nothing_and_unknown_heights_neither():
    assert not hollow_depths(-0.01 * V**2).any()
    assert not hollow_depths(0.03 * V).any()
    assert not hollow_depths(np.full(len(V), np.nan)).any()
    some = rut(0.008)
    some[V < 0.0] = np.nan
    assert hollow_depths(some).max() == pytest.approx(0.008, rel=1e-6)


class Road:
    """What is asked of a road of the package: straight on from (10, 20) to the left of the map's x axis."""

    u_start, u_end, v_min, v_max = 0.0, 10.0, -1.5, 1.5

    def uv_to_z(self, u, v):
        deep = np.where((u > 4.0) & (u < 6.0), 0.0045, 0.0)
        return -np.where(np.abs(v - 0.5) < 0.3, deep, 0.0)

    def uv_to_xy(self, u, v):
        return 10.0 - v, 20.0 + u


def test_puddles_lie_where_the_hollows_are():
    (patch,) = puddles(Road(), "rut")
    assert patch.water_mm == 4.0
    assert patch.water_mm in LEVELS_MM
    x, y = np.transpose(patch.polygon)
    assert (x.min(), x.max()) == pytest.approx((10.0 - 0.8, 10.0 - 0.2), abs=0.06)
    assert (y.min(), y.max()) == pytest.approx((24.0, 26.0))


def test_without_the_package_one_sentence_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyopencrg", None)
    with pytest.raises(MissingExtra, match=r"road\.crg \(OpenCRG\) needs an optional part: .*crg"):
        read_surface(tmp_path / "road.crg")


def test_a_file_gives_its_puddles_and_a_bad_one_a_sentence(tmp_path):
    crg = pytest.importorskip("pyopencrg")
    u, v = np.arange(0.0, 20.01, 0.1), np.arange(-1.5, 1.51, 0.05)
    z = np.zeros((len(u), len(v)))
    z[:, np.abs(v + 0.5) < 0.3] = -0.003
    road = crg.CrgRoad(z, u_inc=0.1, v=v, heading=np.pi / 2, x_start=100.0, y_start=50.0)
    road.save(tmp_path / "road.crg")
    patches = read_surface(tmp_path / "road.crg")
    assert len(patches) == 10
    assert {p.water_mm for p in patches} == {2.0}
    corners = np.concatenate([p.polygon for p in patches])
    assert corners[:, 0].mean() == pytest.approx(100.5, abs=0.05)
    assert (corners[:, 1].min(), corners[:, 1].max()) == pytest.approx((50.0, 70.0), abs=0.01)
    crg.CrgRoad(0.0 * z, u_inc=0.1, v=v).save(tmp_path / "flat.crg")
    with pytest.raises(ConfigError, match="no hollow"):
        read_crg(tmp_path / "flat.crg")
    (tmp_path / "bad.crg").write_text("nothing")
    with pytest.raises(FileError, match="cannot be read as OpenCRG"):
        read_crg(tmp_path / "bad.crg")
    with pytest.raises(FileError):
        read_crg(tmp_path / "none.crg")


class Polished(Road):
    """A lane of 0.9 with a polished strip of 0.45 from v = 0 to 1 in its middle 4 m; unknown beyond v = 1."""

    def uv_to_z(self, u, v):
        polished = (u > 4.0) & (u < 8.0) & (v > 0.0) & (v < 1.0)
        return np.where(v > 1.0, np.nan, np.where(polished, 0.45, 0.9))


def test_friction_of_a_grid_is_one_patch_where_it_is_the_same():
    (patch,) = slippery_parts(Polished(), "polished")
    assert patch.friction == pytest.approx(0.5)
    x, y = np.transpose(patch.polygon)
    assert (x.min(), x.max()) == pytest.approx((9.0, 10.0))
    assert (y.min(), y.max()) == pytest.approx((24.0, 28.0))
    assert len(patch.polygon) == 6  # three places on either side


def test_friction_out_of_range_is_one_sentence():
    road = Polished()
    road.uv_to_z = lambda u, v: np.full(len(v), 2.0)
    with pytest.raises(ConfigError, match=r"friction must be between 0.009 and 1.35, got 2.0"):
        list(slippery_parts(road, "odd"))


def test_a_surface_names_files_of_friction_and_of_heights(tmp_path):
    crg = pytest.importorskip("pyopencrg")
    u, v = np.arange(0.0, 20.01, 0.1), np.arange(-1.5, 1.51, 0.05)
    mu = np.full((len(u), len(v)), 0.9)
    mu[u < 9.99] = 0.3
    crg.CrgRoad(mu, u_inc=0.1, v=v, x_start=100.0, y_start=50.0).save(tmp_path / "mu.crg")
    surface = tmp_path / "surface.yaml"
    surface.write_text("crg: [{file: mu.crg, purpose: friction}]\n")
    (patch,) = read_surface(surface)
    assert patch.friction == pytest.approx(1 / 3)
    corners = np.array(patch.polygon)
    assert np.ptp(corners[:, 0]) == pytest.approx(10.0, abs=0.01)
    surface.write_text("crg: [{file: mu.crg}]\n")
    with pytest.raises(ConfigError, match=r"mu.crg has no hollow"):
        read_surface(surface)
    surface.write_text("patches: [{ice_mm: 1, road: 1}]\ncrg: [{file: mu.crg, purpose: friction}]")
    assert [p.ice_mm for p in read_surface(surface)] == [1.0, 0.0]
    for text, complaint in (
        ("crg: []", "crg must be a list of at least one file"),
        ("crg: [{file: mu.crg, purpose: colour}]", r"surface.yaml: crg\[0\]: .*colour"),
        ("crg: [{file: none.crg}]", r"none.crg cannot be read as OpenCRG"),
    ):
        surface.write_text(text)
        with pytest.raises((ConfigError, FileError), match=complaint):
            read_surface(surface)
