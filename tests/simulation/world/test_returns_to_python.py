"""With every tyre and surface effect a drive stays on the compiled tick: its Python is counted."""

import sys
from collections import Counter
from dataclasses import replace

import pytest
from msgspec import structs

from skidpad.campaign.driving.run_setup import stage_of
from skidpad.core.environment.surface import SurfacePatch
from skidpad.core.settings.parts import load_profile
from skidpad.core.weather import Weather
from skidpad.simulation.world.stage import build_world
from support.runs import adas_run

RAIN = Weather(name="rain", precipitation=60.0, wetness=100.0, air_temperature_c=0.5)
TYRES = {
    "tyres": "summer",
    "tyre_stiffness": True,
    "water_drag": True,
    "wakes": True,
    "anti_lock": "wheel_speeds",
    "stability": "wheel_speeds",
}
TICKS = 40  # at least one of them looks for wrecks, in both worlds the same one


def calls(settings, surface=(), vehicles=20):
    """How often each Python function of the package is entered in TICKS steps of a world."""
    spec = adas_run(2, settings=load_profile("recommended", settings), duration=10.0)
    setup = stage_of(structs.replace(spec, weather=RAIN, surface=surface)).setup
    traffic = replace(setup.traffic, vehicles=vehicles)
    world = build_world(replace(setup, traffic=traffic), 3)
    world.step()
    found = Counter()

    def note(frame, event, _):
        if event == "call" and frame.f_globals.get("__name__", "").startswith("skidpad."):
            found[frame.f_globals["__name__"], frame.f_code.co_qualname] += 1

    sys.setprofile(note)
    try:
        for _ in range(TICKS):
            world.step()
    finally:
        sys.setprofile(None)
    return found


@pytest.fixture(scope="module")
def off():
    return calls({})


def test_without_effects_a_step_is_one_call_of_the_compiled_tick(off):
    assert off["skidpad.simulation.world.world", "World._advance"] <= 2 * TICKS
    assert sum(off.values()) < 30 * TICKS


def test_tyres_stiffness_drag_controls_and_wakes_add_no_python(off):
    assert calls(TYRES) == off


def test_a_surface_adds_one_compiled_call_however_many_patches_and_vehicles(off):
    roads = [
        SurfacePatch(name=f"{k}", water_mm=1.0 + 0.1 * k, road=(1, 3, 5)[k % 3]) for k in range(9)
    ]
    icy = SurfacePatch(ice_mm=1.0, circle=(0.0, 0.0, 20.0), air_below_c=1.0)
    added = calls(TYRES, (*roads, icy)) - off
    assert added == {
        ("skidpad.simulation.world.wheel_grip", "WheelGrip.feel"): TICKS,
        ("skidpad.simulation.world.patches", "Patches.fill"): TICKS,
    }
    assert calls({**TYRES, "sheet_flow": True}) - off == added
    few = calls({}, vehicles=4)
    assert calls(TYRES, tuple(roads[:1]), vehicles=4) - few == added


def test_roll_over_asks_twice_a_step_what_lies_on_its_side(off):
    added = calls({**TYRES, "roll_over": True}) - off
    assert added == {("skidpad.physics.fleet", "Fleet.on_side"): 2 * TICKS}
