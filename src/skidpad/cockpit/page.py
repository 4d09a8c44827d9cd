"""The page: the canvases, and beside them what can be set. Built by NiceGUI, one object per tab."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from enum import Enum
from functools import lru_cache
from importlib import resources
from typing import Any
from uuid import uuid4

from nicegui import ui
from nicegui.element import Element
from nicegui.events import GenericEventArguments

from skidpad.cockpit.about import About
from skidpad.cockpit.bridge import LAMP_ORDER, Bridge
from skidpad.cockpit.hud import TIERS
from skidpad.core.geometry import mps_from_kmh
from skidpad.core.run import Function
from skidpad.core.vocabulary import GripModel, RangeModel
from skidpad.core.weather import RANGES, Weather
from skidpad.physics.grip import grip_params, mu_at, road_surface
from skidpad.physics.presets import all_presets
from skidpad.sensors.finish.extras import Extra
from skidpad.stack.functions import FUNCTIONS

STYLE = resources.files("skidpad.cockpit").joinpath("cockpit.css").read_text(encoding="utf-8")
SYNC = 0.3  # s between two looks at how things really stand
SETTLES = 1.2  # s after a change by hand in which that look leaves a control alone
SLIDERS = {
    "precipitation": "rain",
    "fog_density": "fog",
    "wetness": "wetness",
    "precipitation_deposits": "water on the road",
    "ice_thickness": "ice",
    "snow_depth_mm": "snow, mm",
    "sun_altitude_deg": "sun, deg",
}
SHOWN_RANGES = {"snow_depth_mm": (0.0, 100.0)}
PICTURE = "picture "  # before the name of an addition, as lamps have a switch of their own
EXTRAS = {
    Extra.SHADOWS: "shadows",
    Extra.LAMPS: "bloom of lamps",
    Extra.REFLECTIONS: "lamps on a wet road",
    Extra.RETRO: "reflective signs, lines",
    Extra.CLOUDS: "clouds, stars",
    Extra.FOG: "fog, haze",
    Extra.FALLING: "rain and snow with depth",
    Extra.SPRAY: "spray",
    Extra.EDGES: "soft edges",
    Extra.SNOW: "snow, ice on the road",
    Extra.TONE: "contrast, dim corners",
    Extra.CALM: "less camera noise",
}
MEANINGS = {
    "grip": {
        "none": "tyres grip as on a dry road",
        "statistical": "the published formula for wet and icy roads",
        "physical": "water, ice and snow under each wheel, by speed",
    },
    "range": {
        "none": "depth, labels and radar see through any weather",
        "physical": "rain, fog and snow shorten what sensors see",
    },
}
SHOWN_SPEED = mps_from_kmh(80.0)
RATES = {0.25: "0.25 x", 0.5: "0.5 x", 1.0: "1 x", 2.0: "2 x", 4.0: "4 x", 0.0: "as fast as it can"}
Keys = list[tuple[str, str]]  # a key, and what it does
KEYS_OF_VIEWS: Keys = [
    ("C", "next camera: driver, follow, top, crash; or click a small view"),
    ("T, Y, U", "hide or show depth, classes, view from the top"),
    ("G", "additions to the pictures on and off"),
    (
        "drag",
        "a small view onto another to change places; the edge of the main view to change sizes",
    ),
    ("?", "this list"),
]
KEYS: dict[str, Keys] = {
    "drive": [
        ("M", "take over the wheel, hand it back"),
        (
            "W S A D, arrows",
            "throttle, brake, left, right; hold the brake at standstill to reverse",
        ),
        ("space", "handbrake"),
        (
            "touch screen",
            "wheel on the left, brake and throttle on the right: the higher, the more",
        ),
        ("1 to 7", "switch a driving function on or off"),
        ("L", "headlights: automatic, low, high, off"),
        ("N, H", "next weather, next time of day"),
        ("P, full stop", "pause, one tick further"),
        *KEYS_OF_VIEWS,
    ],
    "replay": [
        ("space, P", "play, pause"),
        ("arrows", "one tick back or further, with shift 5 s"),
        ("time line", "click it to go there"),
        *KEYS_OF_VIEWS,
    ],
}


class Canvases(Element, component="cockpit.js"):
    """Shows pictures, heads-up display and keys."""

    def __init__(self, tab: str, kind: str, timeline: dict[str, Any] | None) -> None:
        super().__init__()
        self._props["tab"] = tab
        self._props["kind"] = kind
        self._props["tiers"] = list(TIERS)
        self._props["timeline"] = timeline
        self._props["help"] = KEYS[kind]


class Panel:
    """Holds the controls of one tab; they follow what the run tells."""

    def __init__(self, bridge: Bridge, tab: str, vehicles: int = 0) -> None:
        """vehicles: in the background as the run began; 0: there is nothing to choose."""
        self.bridge, self.tab, self.vehicles = bridge, tab, vehicles
        self.syncing: list[Callable[[dict[str, Any]], None]] = []
        self.touched: dict[str, float] = {}
        self.elements: list[Any] = []

    def say(self, word: str, value: Any = None) -> None:
        """Says a word as this tab, and shows a warning if something was wrong with it."""
        wrong = self.bridge.say(self.tab, word, value)
        if wrong is not None:
            ui.notify(wrong, type="warning")

    def button(self, text: str, word: str, value: Any = None, icon: str | None = None) -> None:
        """Adds a button that says a word with this value."""
        made = ui.button(text, icon=icon, on_click=lambda: self.say(word, value))
        self.elements.append(made.props("dense no-caps unelevated").classes(f"say-{word}"))

    def follow(self, name: str, element: Any) -> None:
        """Lets an element show what is the case for its control, unless it was just moved by hand.

        name: of the control. What is not known leaves the element as it is.
        """

        def sync(seat: dict[str, Any]) -> None:
            value = self._real(name, seat)
            if time.monotonic() - self.touched.get(name, -SETTLES) < SETTLES or value is None:
                return
            if element.value != value:
                element.value = value

        self.syncing.append(sync)
        self.elements.append(element)

    def switch(self, name: str, title: str, word: str, value: str) -> None:
        """Adds a switch that says a word with this value."""
        made = ui.switch(title, on_change=lambda e: self.apply_change(name, e.value, word, value))
        self.follow(name, made.props("dense"))

    def select(self, name: str, options: Any, label: str) -> None:
        """Adds a choice, whose word is its name."""
        made = ui.select(
            options,
            label=label,
            on_change=lambda e: self.apply_change(name, e.value, name, e.value),
        )
        self.follow(name, made.props("dense outlined options-dense"))

    def slider(self, name: str, title: str, low: float, high: float) -> None:
        """Adds a slider, which acts while it is moved: on a field of the weather, or by its own word."""
        ui.label(title)
        slider = ui.slider(min=low, max=high, step=1).props("label dense")

        def on_moved(event: GenericEventArguments) -> None:
            now = event.args
            said = ("sky", {name: now}) if name in SLIDERS else (name, now)
            self.apply_change(name, now, *said)

        slider.on("update:model-value", on_moved, throttle=0.15)
        self.follow(name, slider)

    def apply_change(self, name: str, now: Any, word: str, value: Any) -> None:
        """Says the word of a control that was moved, unless it already shows what is the case.

        now: the control's new state; value: said with the word.
        """
        seat = self.bridge.told.get("seat", {})
        if now == self._real(name, seat):
            return
        self.touched[name] = time.monotonic()
        self.say(word, value)

    def _real(self, name: str, seat: dict[str, Any]) -> Any:
        """Returns what is really the case for a control, None where that is not known."""
        if name in SLIDERS:
            return seat.get("sky", {}).get(name)
        if name.startswith(PICTURE):
            return _has(self.bridge.told.get("extras"), name.removeprefix(PICTURE))
        if name in {f.value for f in Function}:
            return _has(seat.get("functions"), name)
        if name == "weather":  # one of no name cannot be shown
            return seat.get(name) if seat.get(name) in all_presets() else None
        return seat.get(name)

    def sync(self) -> None:
        """Sets all controls to how things stand, and enables them if this tab drives."""
        seat = self.bridge.told.get("seat", {})
        for one in self.syncing:
            one(seat)
        may = self.bridge.may(self.tab)
        for element in self.elements:
            element.set_enabled(may)


def build(bridge: Bridge, about: About) -> Callable[[], None]:
    """Returns a function that builds the page of one tab each time it is called."""
    kind = about.kind

    def page() -> None:
        tab = uuid4().hex
        panel = Panel(bridge, tab, about.vehicles)
        with ui.element("main").classes("whole"):
            Canvases(tab, kind, about.timeline)
            with ui.element("aside").classes("panel"):
                time_controls(panel, kind)
                if about.again:
                    again_controls(panel, about.again)
                picture_controls(panel)
                if kind == "drive":
                    drive_controls(panel)
                    weather_controls(panel)
                part_lines(about.parts)
                ui.label("?: what every key does").classes("help")
        ui.timer(SYNC, panel.sync)

    return page


def time_controls(panel: Panel, kind: str) -> None:
    """Draws the controls of pause, rate, camera and end."""
    with ui.element("div").classes("row"):
        if kind == "drive":
            panel.button("take over / hand back", "take", icon="swap_horiz")
        panel.button("pause", "pause", icon="pause")
        panel.button("step", "step", 1, icon="skip_next")
        panel.button("camera", "main", icon="videocam")
        if kind == "replay":
            panel.button("film of 10 s", "film", icon="movie")
        panel.button("end", "end", icon="stop")
    rate = ui.select(
        RATES, value=1.0, label="speed", on_change=lambda e: panel.say("rate", e.value)
    )
    panel.elements.append(rate.props("dense outlined options-dense"))


def again_controls(panel: Panel, changes: Mapping[str, str]) -> None:
    """Draws a button per change with which the run is driven again and shown beside this one."""
    ui.label("Beside it, the same seed driven again:").classes("help")
    with ui.element("div").classes("row"):
        for word, title in changes.items():
            panel.button(title, "again", word)


def picture_controls(panel: Panel) -> None:
    """Adds switches of what is added to the pictures for people; they do not change the run."""
    with ui.expansion("pictures (G)").props("dense"), ui.element("div").classes("switches"):
        for extra in Extra:
            panel.switch(PICTURE + extra.value, EXTRAS[extra], "extra", extra.value)


def part_lines(parts: Sequence[tuple[str, str]]) -> None:
    """Draws what the run is made of: stack, functions, road, weather, simulator."""
    if not parts:
        return
    with ui.expansion("this run").props("dense"):
        for kind, name in parts:
            ui.label(f"{kind}  {name}").classes("help part")


def drive_controls(panel: Panel) -> None:
    """Adds the switches of our stack's functions and the choice of headlights."""
    with ui.element("div").classes("switches"):
        own = [FUNCTIONS.get(n) for n, s in FUNCTIONS.sources().items() if s.package == "skidpad"]
        for key, kind in enumerate(own, start=1):
            panel.switch(kind.name, f"{kind.title} ({key})", "toggle", kind.name)
    lamps = ui.toggle(
        [switch.value for switch in LAMP_ORDER],
        on_change=lambda e: panel.apply_change("lamps", e.value, "lamps", e.value),
    ).props("dense no-caps unelevated")
    panel.follow("lamps", lamps)


def _has(names: list[str] | None, name: str) -> bool | None:
    """Returns whether the name is among the names; None where those are not known."""
    return None if names is None else name in names


def weather_controls(panel: Panel) -> None:
    """Adds the choices of weather and how it acts, and sliders of its fields."""
    titles = {name: one.title or name for name, one in all_presets().items()}
    with ui.element("div").classes("selects"):
        panel.select("weather", titles, "weather (N)")
        meaning_line(panel, meaning_of_weather)
        acting_select(panel, "grip", GripModel)
        acting_select(panel, "range", RangeModel)
    with ui.element("div").classes("sliders"):
        if panel.vehicles:
            panel.slider("crowd", "vehicles", 0, panel.vehicles)
        for field, title in SLIDERS.items():
            panel.slider(field, title, *SHOWN_RANGES.get(field, RANGES[field]))


def acting_select(panel: Panel, word: str, kinds: type[Enum]) -> None:
    """Adds the choice of a model by which weather acts: `grip` on tyres, `range` on sight."""
    panel.select(word, [k.value for k in kinds], word)
    meaning_line(panel, lambda seat: MEANINGS[word].get(seat.get(word, ""), ""))


def meaning_line(panel: Panel, read: Callable[[dict[str, Any]], str]) -> None:
    """Draws the line below a choice that says what the chosen one means."""
    line = ui.label("").classes("help meaning")

    def sync(seat: dict[str, Any]) -> None:
        line.text = read(seat)

    panel.syncing.append(sync)


def meaning_of_weather(seat: dict[str, Any]) -> str:
    """Returns water, ice, snow and grip of the weather of a seat."""
    sky = seat.get("sky")
    if not sky:
        return ""
    return describe_weather(Weather(**sky), GripModel(seat.get("grip", GripModel.PHYSICAL.value)))


@lru_cache(maxsize=64)
def describe_weather(weather: Weather, model: GripModel) -> str:
    """Returns what lies on the road in a weather, and the grip at 80 km/h that a model leaves."""
    surface = road_surface(weather)
    depths = (("water", surface.film_mm), ("ice", surface.ice_mm), ("snow", surface.snow_mm))
    lies = [f"{depth:.1f} mm of {name}" for name, depth in depths if depth >= 0.05]
    grip = float(mu_at(grip_params(weather, model), SHOWN_SPEED))
    return f"{', '.join(lies) or 'dry road'}; grip {grip:.2f} at 80 km/h"
