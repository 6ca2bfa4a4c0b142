"""A displacement smoothed as far as its own noise asks for."""

from __future__ import annotations

import numpy as np

from pzd.record import Array

_CORNERS = 60
_BINS = 2000


def low_pass(values: Array, highest: float) -> Array:
    """Smoothing spline of the sixth order on a regular grid, its corner chosen by its own cross-validation.

    Equation: gain = 1 / (1 + (2 sin(w/2) / w_c)^6), w_c minimising sum((1 - g)^2 P) / sum(1 - g)^2
              Source: Craven and Wahba 1979, in the frequency domain

    Parameters
    ----------
    values : (n,) at a regular step
    highest : largest corner [rad/sample]

    Returns
    -------
    (n,) smoothed; the ends are continued by point reflection
    """
    line = np.linspace(values[0], values[-1], values.size)
    flat = values - line
    spectrum = np.fft.rfft(np.concatenate((flat, -flat[-2:0:-1])))
    s = 2.0 * np.sin(np.pi * np.arange(spectrum.size) / (2 * (values.size - 1)))
    corner = _corner(s, np.abs(spectrum) ** 2, highest)
    smooth: Array = np.fft.irfft(spectrum / (1.0 + (s / corner) ** 6), 2 * (values.size - 1))[: values.size]
    return smooth + line


def _corner(s: Array, power: Array, highest: float) -> float:
    """The corner [rad/sample] with the least generalised cross-validation."""
    edges = np.unique(np.geomspace(1, s.size, _BINS).astype(np.int64))
    edges = edges[edges < s.size]
    binned, counts = np.add.reduceat(power, edges), np.diff(np.append(edges, s.size))
    middle = np.add.reduceat(s, edges) / counts
    corners = np.geomspace(min(np.pi / s.size, highest), highest, _CORNERS)
    taken = 1.0 / (1.0 + (corners[:, None] / middle[None, :]) ** 6)
    scores = (taken**2 @ binned) / (taken @ counts) ** 2
    return float(corners[int(np.argmin(scores))])
