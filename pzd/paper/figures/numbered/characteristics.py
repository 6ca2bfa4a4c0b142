"""Figure 18: the characteristics of the damper, and the range of force that the control may use."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from pzd.paper.figures.canvas import FORCE, INK, SOFT, VELOCITY, key, panels
from pzd.paper.figures.numbered import Drawing, PaperFigure
from pzd.paper.figures.sources import FigureData
from pzd.report.drawing import shades

_CHOSEN_SHARE = 0.6
"""Where between both limits the force of the example lies, and at which share of the fastest speed."""


def draw(data: FigureData) -> Iterator[Drawing]:
    """Draw force over velocity by voltage, shaded between both limits, and one V_i that leads to T_i."""
    temperature = data.simulate.temperature_degC
    known = [row.temperature_degC for row in data.rides_of_setting.table.force]
    if temperature not in known:
        temperature = min(known, key=lambda t: t or 0.0)
    rows = [r for r in data.rides_of_setting.table.force if r.temperature_degC == temperature and r.force_N is not None]
    voltages = sorted({row.voltage_V or 0.0 for row in rows})
    curves = {
        u: np.array([(r.velocity_m_per_s, r.force_N) for r in rows if (r.voltage_V or 0.0) == u], dtype=np.float64)
        for u in voltages
    }
    figure, (ax,) = panels(ratios=(1.0,), width=6.4, height=4.2)
    low, high = curves[voltages[0]], curves[voltages[-1]]
    ax.fill_between(low[:, 0], low[:, 1], high[:, 1], color="#e8f0f6", label="control range")
    for (voltage, curve), colour in zip(curves.items(), shades(len(curves)), strict=True):
        ax.plot(curve[:, 0], curve[:, 1], color=colour, label=f"{voltage:g} V")
    speed = _CHOSEN_SHARE * float(low[-1, 0])
    bounds = [float(np.interp(speed, curve[:, 0], curve[:, 1])) for curve in (low, high)]
    force = bounds[0] + _CHOSEN_SHARE * (bounds[1] - bounds[0])
    ax.plot([speed, speed, 0.0], [0.0, force, force], color=INK, linewidth=1.0, linestyle=":")
    ax.plot(speed, force, "o", color=INK, markersize=4.0)
    ax.annotate(r"$V_i$", (speed, 0.0), (0, -12), textcoords="offset points", ha="center")
    ax.annotate(r"$T_i$", (0.0, force), (-6, 0), textcoords="offset points", ha="right", va="center")
    ax.annotate(r"$\alpha_i$", (speed, force), (5, -9), textcoords="offset points")
    for text, curve in ((r"$\alpha_{min}$", low), (r"$\alpha_{max}$", high)):
        ax.annotate(text, tuple(curve[-1]), (4, -3), textcoords="offset points")
    ax.axhline(0.0, color=SOFT, linewidth=0.8)
    ax.axvline(0.0, color=SOFT, linewidth=0.8)
    ax.set_xlim(right=1.18 * float(low[-1, 0]))
    ax.set_xlabel(VELOCITY)
    ax.set_ylabel(FORCE)
    key(figure, ax, 5)
    caption = (
        f"{data.setting}, {temperature:g} °C. At V_i = {speed:.3f} m/s the table gives {bounds[0]:.0f} to "
        f"{bounds[1]:.0f} N; the control picks T_i = {force:.0f} N, and the inverse table the voltage for it."
    )
    yield Drawing("characteristics", figure, "Force over velocity by voltage; the control range is shaded.", caption)


FIGURES = (
    PaperFigure(
        18,
        "Characteristics of the damper and the control range between its limits",
        "stand",
        "The table of force over voltage and velocity computed from the plain Bingham damper that was identified.",
        draw,
    ),
)
