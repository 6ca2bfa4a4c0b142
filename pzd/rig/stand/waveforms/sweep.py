"""A swept sine whose frequency swings smoothly from low to high and back within one period.

Equation: x = A(t) sin(phi(t)), phi = 2 pi (f_m t - (f_d / 2 pi) P sin(2 pi t / P)),
          f = f_m - f_d cos(2 pi t / P), A = A_m + A_d cos(2 pi t / P)
Source: frequency modulation; with a whole number of turns in P the motion repeats with all
its derivatives, which a sweep up to a stop does not.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import ClassVar, Literal

import numpy as np
from pydantic import Field, model_validator

from pzd.record import Array
from pzd.rig.stand.waveforms import Course, Waveform


class Sweep(Waveform):
    """A swept sine, up and down again."""

    usual_cycles: ClassVar[int] = 2

    kind: Literal["sweep"] = "sweep"
    """A swept sine."""
    low_Hz: float = Field(gt=0.0)
    """Lowest frequency, at which the sweep begins and ends."""
    high_Hz: float = Field(gt=0.0)
    """Highest frequency, in the middle of the period."""
    amplitude_m: float = Field(gt=0.0)
    """Amplitude at the lowest frequency."""
    amplitude_at_high_m: float | None = Field(default=None, gt=0.0)
    """Amplitude at the highest frequency; by default the same."""
    period_s: float = Field(default=10.0, gt=0.0)
    """Length of one sweep up and down; stretched a little so that it holds a whole number of turns."""

    @model_validator(mode="after")
    def _rising(self) -> Sweep:
        if self.high_Hz < self.low_Hz:
            raise ValueError("high_Hz must be at least low_Hz")
        return self

    def own_name(self) -> str:
        """Return the name made of its parameters: `sweep-0.5-8Hz-0.01m`."""
        return f"sweep-{self.low_Hz:g}-{self.high_Hz:g}Hz-{self.amplitude_m:g}m"

    def cycle(self, folder: Path) -> float:
        """Return the period that holds a whole number of turns."""
        mean = 0.5 * (self.low_Hz + self.high_Hz)
        return max(round(mean * self.period_s), 1) / mean

    @property
    def lowest_frequency(self) -> float:
        """Lowest frequency of the sweep [Hz]."""
        return self.low_Hz

    def course(self, draw: np.random.Generator, folder: Path) -> Course:
        """Return the sweep."""
        rate = 2.0 * math.pi / self.cycle(folder)
        mean, swing = math.pi * (self.low_Hz + self.high_Hz), math.pi * (self.high_Hz - self.low_Hz)
        top = self.amplitude_m if self.amplitude_at_high_m is None else self.amplitude_at_high_m
        middle, half = 0.5 * (self.amplitude_m + top), 0.5 * (self.amplitude_m - top)

        def motion(time: Array) -> tuple[Array, Array, Array]:
            cos, sin = np.cos(rate * time), np.sin(rate * time)
            phase, speed, change = mean * time - swing / rate * sin, mean - swing * cos, swing * rate * sin
            size, growth, bend = middle + half * cos, -half * rate * sin, -half * rate**2 * cos
            s, c = np.sin(phase), np.cos(phase)
            x, v = size * s, growth * s + size * speed * c
            return x, v, (bend - size * speed**2) * s + (2.0 * growth * speed + size * change) * c

        return motion


WAVEFORM = Sweep
