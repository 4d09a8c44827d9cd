"""Between tabs and producer: which tab may do what, and what its messages mean. It knows no web."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from time import monotonic
from typing import Any

import msgspec

from skidpad.cockpit.pictures import Encoder
from skidpad.cockpit.producer import Producer
from skidpad.cockpit.studio import MAIN, View
from skidpad.cockpit.words import Again, Do, End, Film, Pace, Pause, Seek, Show, Step, Word
from skidpad.core.errors import ConfigError
from skidpad.core.inputs import (
    Crowd,
    Functions,
    Input,
    Lamps,
    LampSwitch,
    Pedals,
    Sky,
    Wheel,
)
from skidpad.core.run import Function
from skidpad.core.vocabulary import GripModel, RangeModel
from skidpad.core.weather import Weather
from skidpad.physics.grip import grip_params
from skidpad.physics.presets import all_presets, preset
from skidpad.sensors.finish.extras import ALL_EXTRAS, Extra

RELEASE_AFTER = 0.3  # s without a sign of the driving tab, after which the pedals are released
ASLEEP_AFTER = 10.0  # s without an answer of a tab, after which it counts as closed; our choice
LAMP_ORDER = (LampSwitch.AUTO, LampSwitch.LOW, LampSwitch.HIGH, LampSwitch.OFF)
CUSTOM = "-custom"  # behind the name of a preset of which something was changed
SUNRISE, NOON, NIGHT = (
    preset(f"clear-{hour}").sun_altitude_deg for hour in ("sunrise", "noon", "night")
)  # deg
MORNING = 0.5 * (SUNRISE + NOON)  # below it is still sunrise
FILM_SECONDS = 10.0
HIDEABLE = (View.DEPTH, View.SEMANTIC, View.TOP)


class Bridge:
    """Passes words of several tabs to one producer, and its newest picture to all of them.

    Words that say no value are relative to the last picture's state.
    """

    def __init__(
        self, producer: Producer, pauses: bool = False, clock: Callable[[], float] = monotonic
    ) -> None:
        """pauses: when the last tab is closed or falls asleep."""
        self.pauses = pauses
        self.producer, self.tabs, self.encoder = producer, Tabs(clock), Encoder()
        self.pedals = Pedals()  # as they were said last
        self.dead_man = DeadMan(self._release, clock)
        self.told: dict[str, Any] = {}  # of the newest picture
        self.main, self.hidden = View.DRIVER, set[View]()
        self.extras = ALL_EXTRAS
        self.acting: Sky | None = None  # set, but perhaps not yet shown

    # --- pictures

    def newest(self, after: int) -> tuple[int, bytes] | None:
        """Returns number and message of the newest picture; None without one or if it is number `after`."""
        if self.producer.feed.last == after:
            return None
        packet = self.producer.feed.take()
        if packet is None or packet.number == after:
            return None
        message = self.encoder.message(packet)
        self.told = msgspec.json.decode(packet.told)
        return packet.number, message

    # --- tabs

    def leave(self, tab: str) -> None:
        """Removes a tab that was closed or sleeps; if it drove, its pedals are released.

        With `pauses`, the producer pauses when it was the last one.
        """
        if self.tabs.driver == tab:
            self._release()
        self.tabs.go(tab)
        if self.pauses and not len(self.tabs):
            self.producer.say(Pause(True))

    def check(self) -> None:
        """Releases pedals that no tab has touched lately and removes tabs that sleep; to be called often."""
        self.dead_man.check()
        for tab in self.tabs.asleep():
            self.leave(tab)

    def may(self, tab: str) -> bool:
        """Returns True when this tab drives, so that its words count."""
        return self.tabs.driver == tab

    def say(self, tab: str, word: str, value: Any = None) -> str | None:
        """Acts on a word of a tab; returns what was wrong with it as a sentence, or None."""
        if not self.may(tab):
            return "another tab drives: this one watches"
        try:
            self._obey(word, value)
        except (ConfigError, ValueError, TypeError, KeyError, msgspec.ValidationError) as error:
            return f"{word}: {error}"
        return None

    # --- words

    def _obey(self, word: str, value: Any) -> None:
        """Acts on a word of a tab; raises ConfigError for a word that does not exist."""
        simple: Mapping[str, Callable[[], Word]] = {
            "pause": lambda: Pause(not self.told.get("paused", False)),
            "play": lambda: Pause(False),
            "stand": lambda: Pause(True),
            "step": lambda: Step(int(value or 1)),
            "rate": lambda: Pace(float(value)),
            "seek": lambda: Seek(int(value)),
            "film": lambda: Film(float(value or FILM_SECONDS)),
            "again": lambda: Again(str(value)),
            "end": End,
        }
        acts: Mapping[str, Callable[[Any], Input]] = {
            "take": lambda _: Wheel(not self._seat("manual", False)),
            "lamps": self._lamps,
            "toggle": self._toggle,
            "crowd": self._crowd,
            "weather": self._weather,
            "sky": self._change,
            "hour": lambda _: self._change({"sun_altitude_deg": next_hour(self._present())}),
            "grip": lambda v: self._acting(grip=GripModel(v)),
            "range": lambda v: self._acting(range=RangeModel(v)),
        }
        if word in simple:
            self.producer.say(simple[word]())
        elif word == "pedals":
            self._pedals(value)
        elif word == "main":
            self._show(View(value) if value else self._next_main())
        elif word == "hide":
            self.hidden ^= {View(value)} & set(HIDEABLE)
            self._show(self.main)
        elif word == "extra":  # None: all of them, or none
            chosen = {Extra(value)} if value else self.extras or ALL_EXTRAS
            self.extras ^= chosen
            self._show(self.main)
        elif word in acts:
            self._do(acts[word](value))
        else:
            raise ConfigError(f"there is no word {word!r}")

    def _do(self, one: Input) -> None:
        """Sends an input to the producer to carry out."""
        self.producer.say(Do(one))

    def _seat(self, name: str, otherwise: Any) -> Any:
        """Returns a value of the driver's seat as last told; `otherwise` where it is absent or None."""
        value = self.told.get("seat", {}).get(name)
        return otherwise if value is None else value

    def _pedals(self, value: Mapping[str, Any]) -> None:
        """Moves the pedals as a tab sends them; the dead man's switch learns whether any is pressed."""
        pedals = msgspec.convert(dict(value), Pedals)
        still = Pedals(method=pedals.method) == pedals
        self.dead_man.note_pedals(not still)
        self._move(pedals)

    def _move(self, pedals: Pedals) -> None:
        """Sends the pedals to the producer if they stand otherwise than before."""
        if pedals != self.pedals:
            self.pedals = pedals
            self._do(pedals)

    def _release(self) -> None:
        """Lets go of pedals and wheel, the method kept."""
        self._move(Pedals(method=self.pedals.method))

    def _show(self, main: View) -> None:
        """Sets the main view and asks the producer for the views that are shown."""
        self.main = main
        self.producer.say(Show(main, tuple(sorted(self.hidden)), tuple(sorted(self.extras))))

    def _next_main(self) -> View:
        """Returns the main view after the present one, the first where it is none of MAIN."""
        return MAIN[(MAIN.index(self.main) + 1) % len(MAIN)] if self.main in MAIN else MAIN[0]

    def _lamps(self, value: Any) -> Lamps:
        """Returns the lamp switch of this value; None: the position after the present one."""
        if value is not None:
            return Lamps(LampSwitch(value))
        now = self._seat("lamps", "auto")
        at = LAMP_ORDER.index(LampSwitch(now)) if now != "sun" else 0
        return Lamps(LAMP_ORDER[(at + 1) % len(LAMP_ORDER)])

    def _toggle(self, value: Any) -> Functions:
        """Returns the functions that are on, with the given one switched."""
        own = {f.value for f in Function}  # those of packages have no switch
        on = {Function(name) for name in self._seat("functions", []) if name in own}
        return Functions(tuple(sorted(on ^ {Function(value)}, key=lambda f: f.value)))

    def _weather(self, value: Any) -> Sky:
        """Returns the input for a preset by name; None: the next one (A-217)."""
        names = list(all_presets())
        if value is None:
            now = str(self._seat("weather", names[0])).removesuffix(CUSTOM)
            at = names.index(now) if now in names else -1
            value = names[(at + 1) % len(names)]
        return self._acting(preset(value))

    def _change(self, value: Mapping[str, float]) -> Sky:
        """Returns the input for the present weather with these fields changed, as a preset if it is one."""
        now = self._present()
        name = now.name if now.name.endswith(CUSTOM) else now.name + CUSTOM
        fields = {k: float(v) for k, v in value.items() if k in now.values()}
        return self._acting(find_preset(replace(now, name=name, title="", **fields)))

    def _present(self) -> Weather:
        """Returns the weather that is outside now."""
        return self._sky().weather

    def _sky(self) -> Sky:
        """Returns weather and how it acts, as set last here, else as the last picture told."""
        if self.acting is None:
            name = str(self._seat("weather", "clear-noon"))
            self.acting = Sky(
                Weather(name=name, **self._seat("sky", {})),
                GripModel(self._seat("grip", "physical")),
                RangeModel(self._seat("range", "physical")),
            )
        return self.acting

    def _acting(
        self,
        weather: Weather | None = None,
        grip: GripModel | None = None,
        range: RangeModel | None = None,
    ) -> Sky:
        """Returns the input for the given and else present weather and models, which it remembers.

        Raises ConfigError for what cannot be combined, and nothing is set then.
        """
        now = self._sky()
        wanted = Sky(weather or now.weather, grip or now.grip, range or now.range)
        grip_params(wanted.weather, wanted.grip)  # snow, or rain on ice, in the statistical model
        self.acting = wanted
        return wanted

    def _crowd(self, value: Any) -> Crowd:
        """Returns the wish for so many vehicles; raises ConfigError where traffic cannot change."""
        seat = self.told.get("seat", {})
        if "crowd" in seat and seat["crowd"] is None:
            raise ConfigError("only on roads with background traffic can vehicles leave or come")
        return Crowd(int(value))


def next_hour(weather: Weather) -> float:
    """Returns the sun's altitude in deg at the next time of day: sunrise, noon, night, sunrise."""
    if weather.is_night:
        return SUNRISE
    return NOON if weather.sun_altitude_deg < MORNING else NIGHT


def find_preset(weather: Weather) -> Weather:
    """Returns the preset with the same values as this weather, else the weather itself."""
    known = all_presets().values()
    return next((one for one in known if one.values() == weather.values()), weather)


# Which tab of the page drives: the first one, until it is gone; the others watch.


class Tabs:
    """Keeps the open tabs in order of coming; one that sleeps is removed, and is new when it wakes."""

    def __init__(self, clock: Callable[[], float] = monotonic) -> None:
        self.clock = clock
        self._open: dict[str, float] = {}  # when each of them was last heard of

    def note_tab(self, tab: str) -> None:
        """Notes that a tab was opened, or is awake."""
        self._open[tab] = self.clock()

    def go(self, tab: str) -> None:
        """Removes a tab that was closed or sleeps; the next one in order drives."""
        self._open.pop(tab, None)

    def asleep(self) -> list[str]:
        """Returns the open tabs that were not heard of for ASLEEP_AFTER s."""
        now = self.clock()
        return [tab for tab, heard in self._open.items() if now - heard > ASLEEP_AFTER]

    @property
    def driver(self) -> str | None:
        """Returns the tab whose words count, the first one; None without tabs."""
        return next(iter(self._open), None)

    def __len__(self) -> int:
        return len(self._open)


class DeadMan:
    """Calls `release` when a pressed pedal was not heard of for RELEASE_AFTER s (A-274)."""

    def __init__(self, release: Callable[[], None], clock: Callable[[], float] = monotonic) -> None:
        self.release, self.clock = release, clock
        self._heard: float | None = None  # None: they are released

    def note_pedals(self, pressed: bool) -> None:
        """Notes that the driving tab told whether a pedal is pressed; if none is, the clock stops."""
        self._heard = self.clock() if pressed else None

    def check(self) -> None:
        """Calls `release` once if the time is over."""
        if self._heard is not None and self.clock() - self._heard > RELEASE_AFTER:
            self._heard = None
            self.release()
