"""Waveforms of the stand, one file each: a block of the config that gives a motion; and how a test starts from rest.

A file declares its block as `WAVEFORM`.
"""

from __future__ import annotations

import importlib
import math
import pkgutil
from abc import abstractmethod
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import ClassVar, Self

import numpy as np
from pydantic import Field, model_validator

from pzd.record import Array
from pzd.schema.model import OneOfAKind

Course = Callable[[Array], tuple[Array, Array, Array]]
"""Exact displacement [m], velocity [m/s] and acceleration [m/s2] at any times (n,) [s]."""


class Waveform(OneOfAKind):
    """The motion of the actuator in one test; each kind is one file here, with a `kind` of its own."""

    usual_cycles: ClassVar[int] = 10
    """Cycles of a test that says nothing of its length."""

    @property
    def lowest_frequency(self) -> float:
        """Lowest frequency of the motion [Hz]; infinite where it has no frequencies."""
        return math.inf

    def cycle(self, folder: Path) -> float:
        """Return the time after which the motion repeats, or ends where it does not repeat [s]."""
        return 1.0 / self.lowest_frequency

    @property
    def settling_time(self) -> float:
        """Two cycles of the lowest frequency, or a second: then the transient of the start has died out [s]."""
        return max(2.0 / self.lowest_frequency, 1.0)

    @abstractmethod
    def course(self, draw: np.random.Generator, folder: Path) -> Course:
        """Return the motion as a continuous function of time, from before 0 on.

        Parameters
        ----------
        draw : generator of random phases
        folder : of the config, for motions that are read
        """


def started(course: Course, lead: float) -> Course:
    """Return the motion started smoothly from rest, and unchanged from the middle of the lead-in on.

    Equation: x s(r), s = 10 r^3 - 15 r^4 + 6 r^5, r = 2 (t + lead) / lead between 0 and 1
              Source: the lowest polynomial that is level with level slope at both ends

    Parameters
    ----------
    course : a motion that goes on before 0
    lead : length of the lead-in [s], which begins at rest at -lead
    """

    def motion(time: Array) -> tuple[Array, Array, Array]:
        x, v, a = course(time)
        rising = time < -0.5 * lead
        rate = 2.0 / lead
        r = np.maximum(rate * (time[rising] + lead), 0.0)
        s = r**3 * (10.0 - 15.0 * r + 6.0 * r**2)
        ds = rate * 30.0 * r**2 * (1.0 - r) ** 2
        dds = rate**2 * 60.0 * r * (1.0 - r) * (1.0 - 2.0 * r)
        x0, v0, a0 = x[rising], v[rising], a[rising]
        x[rising], v[rising], a[rising] = s * x0, ds * x0 + s * v0, dds * x0 + 2.0 * ds * v0 + s * a0
        return x, v, a

    return motion


class Periodic(Waveform):
    """A motion of one frequency and one amplitude."""

    frequency_Hz: float = Field(gt=0.0)
    """Frequency."""
    amplitude_m: float = Field(gt=0.0)
    """Amplitude, half the stroke."""

    def own_name(self) -> str:
        """Return the name made of its parameters: `sine-2Hz-0.03m`."""
        return f"{self.kind}-{self.frequency_Hz:g}Hz-{self.amplitude_m:g}m"

    @property
    def lowest_frequency(self) -> float:
        """Its frequency [Hz]."""
        return self.frequency_Hz


class Lines(Waveform):
    """A motion of lines at the multiples of 1 / period inside a band."""

    usual_cycles: ClassVar[int] = 2

    low_Hz: float = Field(default=0.5, gt=0.0)
    """Lowest frequency."""
    high_Hz: float = Field(default=10.0, gt=0.0)
    """Highest frequency."""
    period_s: float = Field(default=10.0, gt=0.0)
    """After which the motion repeats."""

    @model_validator(mode="after")
    def _has_lines(self) -> Self:
        if int(self.high_Hz * self.period_s) < np.ceil(self.low_Hz * self.period_s):
            raise ValueError("no multiple of 1 / period_s lies between low_Hz and high_Hz")
        return self

    def cycle(self, folder: Path) -> float:
        """Return the period."""
        return self.period_s

    @property
    def lowest_frequency(self) -> float:
        """Lowest frequency of the band [Hz]."""
        return self.low_Hz


@cache
def waveforms() -> dict[str, type[Waveform]]:
    """Return the block of every kind of waveform, by its `kind`."""
    found = [importlib.import_module(f"{__name__}.{info.name}").WAVEFORM for info in pkgutil.iter_modules(__path__)]
    return {waveform.model_fields["kind"].default: waveform for waveform in found}
