"""Sums of harmonics with exact derivatives: what roads, triangles and random motions are made of."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pzd.record import Array, Complex

_WHOLE = 1e-7  # a period this close to a whole number of steps is one, in steps
_BLOCK = 8192  # samples that stay in the cache


@dataclass(frozen=True, eq=False)
class FourierSum:
    """A periodic function of time or distance.

    Equation: x(s) = Re sum c_n exp(2 pi i n s / P)        Source: definition
    """

    period: float
    """P, in the unit of s."""
    coefficients: Complex
    """(n,) c_0, c_1, ...; the amplitude of line n is abs(c_n)."""

    def __call__(self, place: Array) -> tuple[Array, Array, Array]:
        """The function and its first two derivatives, exactly.

        Parameters
        ----------
        place : (n,) s

        Returns
        -------
        three arrays (n,)
        """
        orders = 2j * np.pi / self.period * np.arange(self.coefficients.size)
        sums = np.stack([self.coefficients, self.coefficients * orders, self.coefficients * orders**2])
        steps = _steps_a_period(place, self.period)
        values = _direct(sums, place / self.period) if steps is None else _fast(sums, place, self.period, steps)
        return values[0], values[1], values[2]


def _steps_a_period(place: Array, period: float) -> int | None:
    """How many steps of an even grid make one period; None where the grid is uneven or the number is not whole."""
    if place.size < 3:
        return None
    step = (place[-1] - place[0]) / (place.size - 1)
    whole = round(period / step) if step > 0.0 else 0
    even = np.allclose(np.diff(place), step, rtol=1e-6, atol=0.0)
    return whole if even and whole > 0 and abs(period / step - whole) < _WHOLE else None


def _fast(sums: Complex, place: Array, period: float, steps: int) -> Array:
    """The sums on an even grid that meets itself again after one period."""
    lines = sums.shape[1]
    shifted = sums * np.exp(2j * np.pi * np.arange(lines) * (place[0] / period))
    if 2 * (lines - 1) >= steps:
        return _direct(sums, place / period)
    spectrum = np.zeros((3, steps // 2 + 1), dtype=np.complex128)
    spectrum[:, :lines] = 0.5 * steps * shifted
    spectrum[:, 0] = steps * shifted[:, 0].real
    once = np.fft.irfft(spectrum, steps, axis=1)
    return np.stack([np.resize(row, place.size) for row in once])


def _direct(sums: Complex, phase: Array) -> Array:
    """The sums at any places, by Horner's rule in exp(2 pi i phase)."""
    result = np.empty((3, phase.size))
    for start in range(0, phase.size, _BLOCK):
        turn = np.exp(2j * np.pi * phase[start : start + _BLOCK])
        total = np.zeros((3, turn.size), dtype=np.complex128)
        for line in range(sums.shape[1] - 1, -1, -1):
            total *= turn
            total += sums[:, line, None]
        result[:, start : start + _BLOCK] = total.real
    return result
