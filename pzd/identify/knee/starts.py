"""Where the fit of the knee law begins: the curve by linear least squares, the knees on a grid, no oil spring."""

from __future__ import annotations

from itertools import product

import numpy as np

from pzd.identify.knee.curve import COMPRESSION, REBOUND, KneeCurve
from pzd.identify.knee.data import Tests
from pzd.record import Array

KNEES = (0.06, 0.12, 0.2, 0.3, 0.45, 0.65)
"""Knee speeds of the grid, as shares of the fastest speed."""
SAMPLES = 6000
"""The grid is evaluated on at most so many samples."""
TURNING = 0.02
"""Below this share of the fastest speed the oil spring winds up, and the force is not that of the curve."""
LEAST_SLOPE = 0.02
"""Least slope of a start, as a share of peak force over peak speed."""
MOST_SLOPE = 50.0
"""Largest slope of a start, likewise."""


def start_of(tests: Tests, stiffness: float) -> tuple[KneeCurve, Array]:
    """The best curve of the grid, and (2,) the gas force and gas spring beside it.

    Equation: F = F_0 + k_g x + T0 sign(v) + sum over the directions of C min(|v|, w_k) + B max(|v| - w_k, 0)

    Parameters
    ----------
    tests : that are fitted
    stiffness : of the oil spring, which this does not look for [N/m]
    """
    v, fastest = tests.speed, tests.fastest
    kept = np.flatnonzero(np.abs(v) > TURNING * fastest)
    kept = kept[:: max(1, kept.size // SAMPLES)]
    v, measured, beside = v[kept], tests.measured[kept], tests.of_gas[kept]
    found: list[tuple[float, KneeCurve, Array]] = []
    for knees in product((share * fastest for share in KNEES), repeat=2):
        terms = np.column_stack([beside, np.sign(v), *(t for way in (0, 1) for t in _terms(v, way, knees[way]))])
        size = np.linalg.norm(terms, axis=0)
        size[size == 0.0] = 1.0
        values = np.linalg.lstsq(terms / size, measured, rcond=1e-9)[0] / size
        left = measured - terms @ values
        found.append((float(left @ left), _curve(values[2:], knees, stiffness, tests), values[:2]))
    _, curve, gas = min(found, key=lambda each: each[0])
    return curve, gas


def _terms(v: Array, way: int, knee: float) -> tuple[Array, Array]:
    """(N,) force of a slope of one up to the knee of one direction, and of one beyond it."""
    sign = (1.0, -1.0)[way]
    w = np.maximum(sign * v, 0.0)
    return sign * np.minimum(w, knee), sign * np.maximum(w - knee, 0.0)


def _curve(values: Array, knees: tuple[float, ...], stiffness: float, tests: Tests) -> KneeCurve:
    """The curve of a linear fit, its values brought to what a damper may have."""
    unit = tests.peak / tests.fastest
    slopes = np.clip(values[1:], LEAST_SLOPE * unit, MOST_SLOPE * unit).tolist()
    return KneeCurve(
        float(np.clip(values[0], 1e-3 * tests.peak, 0.5 * tests.peak)),
        (slopes[0], slopes[2]),
        stiffness,
        (knees[REBOUND], knees[COMPRESSION]),
        (slopes[1], slopes[3]),
    )
