"""What a ride comes to: its history, and the numbers taken from every step behind `settle`."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pzd.artefacts import AXLE_COLUMNS, AXLES, RIDE_COLUMNS, Ride, SummaryRow
from pzd.comfort.measures import rms
from pzd.record import Array
from pzd.signals.recursion import all_pole

JERK_CORNER = 80.0
"""Corner of the low-pass behind which the jerk is taken [Hz]: the raw jerk of a law that switches has no r.m.s."""
_POLES = (math.pi / 8, 3 * math.pi / 8)
"""Angles of the pairs of poles of the fourth order off the negative real axis (Butterworth 1930)."""


@dataclass(frozen=True, eq=False)
class Outcome:
    """One ride, computed."""

    history: Array
    """(n, 16) rows thinned to the rate of output, columns as in the artefact `Ride`."""
    comfort: Array
    """(m,) acceleration at K at every step [m/s2]."""
    step: float
    """Length of a step [s]."""
    peak_deflection: float
    """Largest deflection of either suspension behind `settle` [m]."""
    wheel_load: float
    """R.m.s. of the dynamic wheel load behind `settle`, the larger of both axles [N]."""
    outside: float
    """Share of the ride in which a damper moves faster than the rig did."""
    dissipated: float
    """[J]"""
    energy_error: float
    """See `balance_error`."""


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


def summary_row(case: str, road: str, policy: str, fidelity: str, outcome: Outcome, settle: float) -> SummaryRow:
    """The ride in one line; peaks and r.m.s. are taken after `settle` [s]."""
    first = round(settle / outcome.step)
    comfort = outcome.comfort[first:]
    return SummaryRow(
        case=case,
        road=road,
        policy=policy,
        fidelity=fidelity,
        point="K",
        peak_abs_aK_m_per_s2=float(np.max(np.abs(comfort))),
        rms_aK_m_per_s2=rms(comfort),
        rms_jerk_m_per_s3=rms(low_passed_jerk(outcome.comfort, outcome.step)[first:]),
        peak_deflection_m=outcome.peak_deflection,
        rms_wheel_load_N=outcome.wheel_load,
        dissipated_J=outcome.dissipated,
        energy_error=outcome.energy_error,
        outside_table=outcome.outside,
    )


def ride_of(case: str, outcome: Outcome, without: tuple[str, ...]) -> Ride:
    """The history as the artefact holds it; columns that mean nothing in this ride are left out."""
    names = RIDE_COLUMNS + tuple(name.format(axle) for axle in AXLES for name in AXLE_COLUMNS)
    left_out = {name.format(axle) for name in without for axle in AXLES}
    columns = {n: np.ascontiguousarray(c) for n, c in zip(names, outcome.history.T, strict=True) if n not in left_out}
    return Ride(case, columns)
