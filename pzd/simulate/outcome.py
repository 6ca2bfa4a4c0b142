"""What a ride comes to: its history, and the numbers taken from every step in its window."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from pzd.artefacts import AXLE_COLUMNS, AXLES, RIDE_COLUMNS, Ride, SummaryRow, WheelRow
from pzd.record import Array
from pzd.signals.recursion import all_pole
from pzd.signals.root_mean_square import rms
from pzd.simulate.loop import A_K, LOAD_1, LOAD_2, LOST, TRAVEL
from pzd.simulate.spilled import SpilledRows, columns_of
from pzd.simulate.window import Window

POINT = "K"
"""The point of the car at which comfort is judged."""

VOLTAGES = [len(RIDE_COLUMNS) + (axle + 1) * len(AXLE_COLUMNS) - 1 for axle in range(len(AXLES))]
"""Columns of the history with the voltage of each axle."""

JERK_CORNER = 80.0
"""Corner of the low-pass behind which the jerk is taken [Hz]: the raw jerk of a law that switches has no r.m.s."""
_POLES = (math.pi / 8, 3 * math.pi / 8)
"""Angles of the pairs of poles of the fourth order off the negative real axis (Butterworth 1930)."""


@dataclass(frozen=True, eq=False)
class Outcome:
    """One ride, computed."""

    history: Array | SpilledRows
    """(n, 16) rows thinned to the rate of output, columns as in the artefact `Ride`; in a file where the ride was taken
    piece by piece."""
    course: Array
    """(m, COURSE_COLUMNS) what is kept of every step, see `pzd.simulate.loop`."""
    step: float
    """Length of a step [s]."""
    outside: float
    """Share of the ride in which a damper moves faster than the rig did."""
    energy_error: float
    """See `balance_error`."""

    @property
    def comfort(self) -> Array:
        """(m,) acceleration at K at every step [m/s2]."""
        return self.course[:, A_K]

    @property
    def loads(self) -> Array:
        """(m, 2) what each axle takes off the road's static load at every step [N]: S + T of wheels without mass."""
        return self.course[:, LOAD_1 : LOAD_2 + 1]


def low_passed_jerk(acceleration: Array, step: float) -> Array:
    """Jerk behind a low-pass of 80 Hz (Butterworth, fourth order).

    Parameters
    ----------
    acceleration : (n,) at every step [m/s2]
    step : [s]

    Returns
    -------
    (n,) jerk [m/s3]
    """
    if 0.5 / step <= JERK_CORNER:
        return np.asarray(np.gradient(acceleration, step))
    warped = math.tan(math.pi * JERK_CORNER * step)
    smooth = acceleration - acceleration[0]
    for angle in _POLES:
        smooth = _low_passed(smooth, warped, 2.0 * math.cos(angle))
    return np.asarray(np.gradient(smooth + acceleration[0], step))


def _low_passed(values: Array, warped: float, damping: float) -> Array:
    """(n,) values behind one pair of poles, at rest before the first.

    Equation: H = W^2 / (s^2 + d W s + W^2), s = (1 - 1/z) / (1 + 1/z)      Source: bilinear transform, prewarped
    """
    square = warped * warped
    scale = 1.0 + damping * warped + square
    fed = np.convolve(values, np.array([1.0, 2.0, 1.0]) * square / scale)[: values.size]
    past = np.array([1.0, 2.0 * (square - 1.0) / scale, (1.0 - damping * warped + square) / scale])
    return all_pole(past, fed[:, np.newaxis])[:, 0]


def summary_row(case: str, road: str, policy: str, fidelity: str, outcome: Outcome, window: Window) -> SummaryRow:
    """The ride in one line."""
    within = outcome.course[window.steps]
    lost = within[:, LOST]
    return SummaryRow(
        case=case,
        road=road,
        policy=policy,
        fidelity=fidelity,
        point=POINT,
        peak_abs_aK_m_per_s2=float(np.max(np.abs(within[:, A_K]))),
        rms_aK_m_per_s2=rms(within[:, A_K]),
        rms_jerk_m_per_s3=rms(low_passed_jerk(outcome.comfort, outcome.step)[window.steps]),
        peak_deflection_m=float(np.max(within[:, TRAVEL])),
        rms_wheel_load_N=max(rms(load) for load in outcome.loads[window.steps].T),
        dissipated_J=float(lost[-1] - lost[0]),
        energy_error=outcome.energy_error,
        outside_table=outcome.outside,
    )


def wheel_rows(case: str, outcome: Outcome, window: Window, static: tuple[float, float]) -> Iterator[WheelRow]:
    """The force between wheels and road, an axle a row.

    Equation: N_i = N_i0 - (S_i + T_i), N_i0 the static load        Source: balance of the massless wheel;
    where the wheels have mass N_i is the force of the tyre, see `pzd.simulate.tyre`

    Parameters
    ----------
    case : name of the ride
    outcome : the ride
    window : in which it is judged
    static : static load of each axle [N], see `HalfCar.static_loads`
    """
    for axle, load, at_rest in zip(AXLES, outcome.loads[window.steps].T, static, strict=True):
        contact = at_rest - load
        yield WheelRow(
            case=case,
            axle=axle,
            static_load_N=at_rest,
            rms_dynamic_load_N=rms(load),
            min_contact_force_N=float(np.min(contact)),
            pulling=float(np.mean(contact <= 0.0)),
        )


def ride_of(case: str, outcome: Outcome, without: tuple[str, ...]) -> Ride:
    """The history as the artefact holds it; columns that mean nothing in this ride are left out."""
    names = RIDE_COLUMNS + tuple(name.format(axle) for axle in AXLES for name in AXLE_COLUMNS)
    left_out = {name.format(axle) for name in without for axle in AXLES}
    return Ride(case, columns_of(outcome.history, names, left_out))
