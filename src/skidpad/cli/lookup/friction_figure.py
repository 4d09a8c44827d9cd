"""The curves and the surface of the friction study (B-041), and the physical model beside them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from skidpad.cli.output.pictures import write_figure
from skidpad.core.geometry import mps_from_kmh
from skidpad.core.vocabulary import GripModel
from skidpad.core.weather import Weather
from skidpad.physics.grip import friction_ratio, grip_params, mu_at
from skidpad.physics.presets import preset

PERCENT = np.linspace(0.0, 100.0, 51)
SHOWN = ("rain_20", "rain_40", "rain_100", "snow", "icy_30")


def _rain(w: float, p: float) -> float:
    """Returns the statistical grip ratio for wetness `w` and deposits of rain `p`, both in %."""
    weather = Weather(wetness=w, precipitation_deposits=p)
    return friction_ratio(weather, GripModel.STATISTICAL)


def _curves(axes: Any) -> None:
    """Draws the statistical grip ratio over wetness and over ice thickness in %."""
    for p, style in ((0.0, "-"), (50.0, "--"), (100.0, ":")):
        axes.plot(PERCENT, [_rain(w, p) for w in PERCENT], style, label=f"rain, deposits {p:g} %")
    ice = [friction_ratio(Weather(ice_thickness=i), GripModel.STATISTICAL) for i in PERCENT]
    axes.plot(PERCENT, ice, color="tab:purple", label="ice thickness")
    axes.set(xlabel="wetness or ice thickness, %", ylabel="ratio of dry grip", ylim=(0, 1.05))
    axes.set_title("statistical model")
    axes.legend()
    axes.grid(alpha=0.3)


def _over_deposits(axes: Any) -> None:
    """Draws the statistical grip ratio over the deposits of rain in %."""
    for w, style in ((0.0, "-"), (50.0, "--"), (100.0, ":")):
        axes.plot(PERCENT, [_rain(w, p) for p in PERCENT], style, label=f"wetness {w:g} %")
    axes.set(xlabel="deposits of rain, %", ylabel="ratio of dry grip", ylim=(0, 1.05))
    axes.set_title("statistical model, ratio over rain")
    axes.legend()
    axes.grid(alpha=0.3)


def draw_surface(axes: Any) -> None:
    """Draws the statistical grip ratio in rain over wetness and deposits in %, on 3-D axes."""
    coarse = PERCENT[::5]
    w, p = np.meshgrid(coarse, coarse)
    axes.plot_surface(w, p, np.vectorize(_rain)(w, p), cmap="viridis", linewidth=0)
    axes.set(xlabel="wetness, %", ylabel="deposits, %", zlabel="ratio of dry grip")
    axes.set_title("statistical model, ratio in rain")


def _speeds(axes: Any, mu_ref: float) -> None:
    """Draws the friction of the physical model over speed in km/h, beside measured values."""
    kmh = np.linspace(0.0, 130.0, 66)
    for name in SHOWN:
        params = grip_params(preset(name), GripModel.PHYSICAL, mu_ref)
        axes.plot(kmh, [mu_at(params, mps_from_kmh(float(v))) for v in kmh], label=name)
    for mu, text in ((0.67, "wet braking test"), (0.34, "packed snow test"), (0.117, "ice test")):
        axes.axhline(mu, color="black", linewidth=0.6, linestyle=":")
        axes.annotate(text, (129.0, mu + 0.01), ha="right", fontsize=8)
    axes.set(xlabel="speed, km/h", ylabel="friction coefficient", ylim=(0, mu_ref * 1.05))
    axes.set_title(f"physical model, mu_ref {mu_ref:g}")
    axes.legend()
    axes.grid(alpha=0.3)


def draw_figure(figure: Any, mu_ref: float) -> None:
    """Draws the four panels of both models. mu_ref: friction of the dry road."""
    _curves(figure.add_subplot(2, 2, 1))
    _over_deposits(figure.add_subplot(2, 2, 2))
    draw_surface(figure.add_subplot(2, 2, 3, projection="3d"))
    _speeds(figure.add_subplot(2, 2, 4), mu_ref)


def draw(path: Path, mu_ref: float) -> None:
    """Writes the figure of both models; the suffix of `path` chooses the format."""
    write_figure(path, lambda figure: draw_figure(figure, mu_ref), (14.0, 8.6), dpi=80)
