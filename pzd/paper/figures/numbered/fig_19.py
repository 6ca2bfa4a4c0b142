"""Figure 19: acceleration at K over time, constant c and controlled; and what stands behind its peaks."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from pzd.artefacts import RIDE_COLUMNS, WheelRow
from pzd.paper.car_search import CONSTANT_PEAKS, CONTROLLED_PEAKS, FREQUENCIES
from pzd.paper.figures.canvas import BASELINE, FINAL, key, panels
from pzd.paper.figures.cars import survey
from pzd.paper.figures.fidelities import fidelities
from pzd.paper.figures.figure import Drawing, PaperFigure
from pzd.paper.figures.sources import FigureData
from pzd.schema.errors import ConfigError

_SHOWN = 2.0
"""Length of what is shown of the settled ride [s]."""
_TIME, _ACCELERATION = RIDE_COLUMNS[0], RIDE_COLUMNS[-1]
_CURVES = {"constant": ("c-const.", BASELINE), "comfort": ("c-control", FINAL)}


def draw(data: FigureData) -> Iterator[Drawing]:
    """The paper's picture, the survey of cars, and the peaks by fidelity."""
    yield accelerations(data)
    yield survey(data)
    yield from fidelities(data)


def accelerations(data: FigureData) -> Drawing:
    """|a_K| over the last two seconds of the ideal rides at 2.25 and 4.5 Hz.

    Raises
    ------
    ConfigError : when no history was written
    """
    rides = {ride.case: ride.columns for ride in data.rides_of_setting.rides.rides}
    figure, axes = panels()
    captions = []
    for ax, frequency, printed in zip(
        axes, FREQUENCIES, zip(CONSTANT_PEAKS, CONTROLLED_PEAKS, strict=True), strict=True
    ):
        for (policy, (label, colour)), peak in zip(_CURVES.items(), printed, strict=True):
            row = data.ride(frequency, policy, "ideal")
            if row.case not in rides:
                raise ConfigError("simulate.histories: Fig. 19 is drawn from them; say csv or parquet (got none)")
            time = rides[row.case][_TIME]
            part = time >= time[-1] - _SHOWN
            ax.plot(time[part] - time[part][0], np.abs(rides[row.case][_ACCELERATION][part]), color=colour, label=label)
            captions.append(f"{frequency:g} Hz {label} {row.peak_abs_aK_m_per_s2:.3f} m/s², paper {peak:g}")
        ax.set_xlabel("time t [s]")
        ax.set_ylabel("|a_K| [m/s²]")
        ax.set_xlim(0.0, _SHOWN)
        ax.set_ylim(bottom=0.0)
    key(figure, axes[0])
    caption = (
        f"Settled rides, forces ideal within c_min and c_max, tie-break {data.simulate.tie_break}. Peaks: "
        + "; ".join(captions)
        + f". {contact(data)}"
    )
    return Drawing("acceleration", figure, "Magnitude of the acceleration at K over time at 2.25 and 4.5 Hz.", caption)


def contact(data: FigureData) -> str:
    """The force between wheels and road in the controlled rides, in words.

    The paper's half-car has no unsprung masses: wheels without mass hand on the force of spring and damper, so that
    the road feels it and the static load, see `pzd.simulate.outcome.wheel_rows`.
    """
    told = []
    for frequency in FREQUENCIES:
        case = data.ride(frequency, "comfort", "ideal").case
        worst = min((w for w in data.rides_of_setting.rides.wheels if w.case == case), key=_least)
        told.append(
            f"{worst.min_contact_force_N / 1000.0:.1f} kN at axle {worst.axle} at {frequency:g} Hz, "
            f"0 or less {worst.pulling:.0%} of the time"
        )
    return (
        "The car has no unsprung masses, so the force between wheel and road is the static load less the force of "
        f"spring and damper; under control it falls to {'; '.join(told)}: below 0 the wheels pull on the road, which "
        "no wheel can."
    )


def _least(wheel: WheelRow) -> float:
    return wheel.min_contact_force_N


FIGURE = PaperFigure(
    19,
    "Acceleration at K with and without control, 2.25 and 4.5 Hz",
    "rides",
    "Rides of the half-car. The paper leaves a1, a2, J_y, x_K and the tie-break out: car and tie-break were chosen so "
    "that the four peaks come closest, so agreement of these peaks confirms nothing.",
    draw,
)
