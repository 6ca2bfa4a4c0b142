"""Figure 7: thermal pictures in the paper; in their place the heating of the damper by a lumped heat balance."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from pzd.paper.figures.canvas import BASELINE, FINAL, SOFT, panels
from pzd.paper.figures.numbered import Drawing, PaperFigure
from pzd.paper.figures.sources import FigureData
from pzd.paper.published import published

MASS_KG, HEAT_J_PER_KG_K = 5.0, 500.0
"""Assumed: steel and oil that warm together, mass and mean specific heat; the paper states neither."""
AREA_M2, EXCHANGE_W_PER_M2_K = 0.10, 10.0
"""Assumed: surface of the casing and heat transfer to still air."""
AMBIENT = 22.0
"""Ambient temperature that the paper states [degC]."""
COLD, WARM = "F8-23", "F8-43"
"""The tests between whose temperatures the dissipated power is interpolated."""
_STEP = 1.0
"""Of the heating [s]."""
_STALLED = 1e-5
"""Below this rate the temperature counts as settled [K/s]."""


def heating(power_cold: float, power_warm: float, start: float, end: float) -> tuple[list[float], list[float]]:
    """Compute the temperature over time of one lump that the damper's own power warms.

    Equation: m c dT/dt = P(T) - h A (T - T_ambient), P linear between 23 and 43 degC      Source: first law

    Parameters
    ----------
    power_cold, power_warm : dissipated at 23 and 43 degC [W]
    start, end : temperatures [degC]

    Returns
    -------
    time [s] and temperature [degC] until the end is reached

    Raises
    ------
    LookupError : when the power does not suffice
    """
    times, temperatures = [0.0], [start]
    while temperatures[-1] < end:
        now = temperatures[-1]
        power = power_cold + (power_warm - power_cold) * (now - 23.0) / 20.0
        rate = (power - EXCHANGE_W_PER_M2_K * AREA_M2 * (now - AMBIENT)) / (MASS_KG * HEAT_J_PER_KG_K)
        if rate <= _STALLED:
            raise LookupError(f"{power:.0f} W do not warm the damper beyond {now:.1f} °C")
        times.append(times[-1] + _STEP)
        temperatures.append(now + _STEP * rate)
    return times, temperatures


def draw(data: FigureData) -> Iterator[Drawing]:
    """Draw the heating from 25 to 43 degC, at 0 V as the stand dissipates."""
    rows = published()
    cold, warm = (
        measure.work_per_cycle_J * (measure.frequency_Hz or 0.0)
        for measure in (data.test(rows[name].conditions).measure for name in (COLD, WARM))
    )
    start, end = rows["TEMP-start"].number, rows["TEMP-end"].number
    time, temperature = heating(cold, warm, start, end)
    figure, (ax,) = panels(ratios=(1.0,), width=6.4, height=3.4)
    minutes = np.array(time) / 60.0
    ax.plot(minutes, temperature, color=FINAL)
    for value, text in ((start, f"{start:g} °C, Figure 7a"), (end, f"{end:g} °C, Figure 7b")):
        ax.axhline(value, color=BASELINE, linewidth=1.0, linestyle="--")
        ax.annotate(text, (0.0, value), (4, -11), textcoords="offset points", color=BASELINE)
    ax.axhline(AMBIENT, color=SOFT, linewidth=0.8)
    ax.annotate("ambient 22 °C", (minutes[-1], AMBIENT), (0, 3), textcoords="offset points", ha="right")
    ax.set_xlim(0.0, float(minutes[-1]))
    ax.set_ylim(21.0, 45.0)
    ax.set_xlabel("time [min]")
    ax.set_ylabel("casing temperature [°C]")
    caption = (
        f"No thermal picture: one lump of {MASS_KG:g} kg and {HEAT_J_PER_KG_K:g} J/(kg K), "
        f"{EXCHANGE_W_PER_M2_K * AREA_M2:g} W/K to air of {AMBIENT:g} °C (all assumed), warmed by what the stand "
        f"dissipates at 2 Hz, 0.03 m and 0 V: {cold:.0f} W at 23 °C, {warm:.0f} W at 43 °C. "
        f"From {start:g} to {end:g} °C takes {minutes[-1]:.1f} min."
    )
    yield Drawing("heating", figure, "Temperature of the damper over time by a lumped heat balance.", caption)


FIGURES = (
    PaperFigure(
        7,
        "Temperature of the damper at the start and after a longer run",
        "computed",
        "The paper shows thermal pictures, which cannot be made. In their place: heating by a lumped balance of the "
        "power that the stand dissipates.",
        draw,
    ),
)
