"""A spline of degree five over evenly spaced knots, by its coefficients: four times continuously differentiable.

An integrator of order five keeps its order across knots of such a road; a cubic one would force it to shorter steps.
"""

from __future__ import annotations

from pzd.compiled import compiled, inlined
from pzd.record import Array

NEEDED = 6
"""Coefficients that act in one cell."""


@inlined
def spline_at(coefficients: Array, place: float) -> tuple[float, float, float]:
    """Value of a spline, its derivative and its second derivative; held before the first and behind the last knot.

    Equation: s = sum c_j B(p - j), B the basis spline of degree 5 over whole numbers, as a polynomial in the cell
    Source: de Boor 2001, A Practical Guide to Splines, ch. IX and X

    Parameters
    ----------
    coefficients : (n + 4,) of a spline over n knots, or more than `NEEDED`; the first acts two knots before the first
    place : counted from the first knot, in knots

    Returns
    -------
    value, and its derivatives by the place
    """
    last = coefficients.size - NEEDED
    held = place <= 0.0 or place >= last + 1.0
    place = min(max(place, 0.0), last + 1.0)
    cell = min(int(place), last)
    t = place - cell
    c0, c1, c2 = coefficients[cell], coefficients[cell + 1], coefficients[cell + 2]
    c3, c4, c5 = coefficients[cell + 3], coefficients[cell + 4], coefficients[cell + 5]
    a0 = (c0 + c4 + 26.0 * (c1 + c3) + 66.0 * c2) / 120.0
    a1 = (c4 - c0 + 10.0 * (c3 - c1)) / 24.0
    a2 = (c0 + c4 + 2.0 * (c1 + c3) - 6.0 * c2) / 12.0
    a3 = (c4 - c0 - 2.0 * (c3 - c1)) / 12.0
    a4 = (c0 + c4 - 4.0 * (c1 + c3) + 6.0 * c2) / 24.0
    a5 = (c5 - c0 + 5.0 * (c1 - c4) + 10.0 * (c3 - c2)) / 120.0
    value = a0 + t * (a1 + t * (a2 + t * (a3 + t * (a4 + t * a5))))
    if held:
        return value, 0.0, 0.0
    slope = a1 + t * (2.0 * a2 + t * (3.0 * a3 + t * (4.0 * a4 + t * 5.0 * a5)))
    return value, slope, 2.0 * a2 + t * (6.0 * a3 + t * (12.0 * a4 + t * 20.0 * a5))


@compiled
def fill_values(coefficients: Array, places: Array, values: Array) -> None:
    """Fill the values of a spline at (m,) places."""
    for n in range(places.size):
        values[n], _, _ = spline_at(coefficients, places[n])
