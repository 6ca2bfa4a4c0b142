"""Motions of 12 s with and without a step of amplitude or frequency, for the tests that part one from the other."""

from __future__ import annotations

import numpy as np

from pzd.record import Array

TIME = np.arange(12_000) * 1e-3


def sine(amplitude: float, hertz: float) -> Array:
    return np.asarray(amplitude * np.sin(2.0 * np.pi * hertz * TIME))


STEPS = {
    "two speeds": np.where(TIME < 6.0, sine(0.01, 1.0), sine(0.01, 2.0)),
    "two amplitudes": np.where(TIME < 6.0, sine(0.005, 1.5), sine(0.015, 1.5)),
    "half a millimetre more": np.where(TIME < 6.0, sine(0.004, 2.0), sine(0.0045, 2.0)),
}
NO_STEPS = {
    "a sine": sine(0.01, 1.7),
    "a sweep": 0.01 * np.sin(2.0 * np.pi * (0.5 * TIME + 0.1 * TIME**2)),
    "a beat": sine(0.005, 1.38) + sine(0.005, 1.42),
    "a quick beat": sine(0.01, 1.0) + sine(0.003, 1.23),
    "a growing sine": (0.5 + TIME / 12.0) * sine(0.01, 1.5),
    "two tones": sine(0.01, 1.0) + sine(0.002, 10.03),
    "one bump more": sine(0.01, 1.0) + 0.003 * np.exp(-(((TIME - 6.0) / 0.3) ** 2)),
}
