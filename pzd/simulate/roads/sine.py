"""Harmonic roads, given by the frequency that the car feels at its speed: a sine, and one that sweeps."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
from pydantic import Field, model_validator
from typing_extensions import override

from pzd.record import Array
from pzd.simulate.roads import END_REACH, Profile, Road, Way, through

_KNOTS_A_WAVE = 40
"""Of the shortest wave: a spline of degree five is then 1e-9 of its amplitude off."""


class Sine(Road):
    """A harmonic road, xi = A sin(2 pi f t) under axle 1."""

    kind: Literal["sine"] = "sine"
    """A harmonic road."""
    frequency_Hz: float = Field(gt=0.0)
    """Frequency of excitation that the car feels at its speed."""
    amplitude_m: float = Field(default=0.02, gt=0.0)
    """Amplitude of the road's height."""

    @override
    def own_name(self) -> str:
        return f"sine-{self.frequency_Hz:g}Hz"

    @override
    def profile(self, way: Way) -> Profile:
        return Profile(amplitude=self.amplitude_m, wavenumber=2.0 * math.pi * self.frequency_Hz / way.vehicle_speed)


class SweptSine(Road):
    """A sine A sin(phi) whose frequency f = f_1 (f_2 / f_1)^u rises, u from 0 to 1 over `sweep_s`, then falls again.

    Equation: phi = 2 pi integral f dt = 2 pi f_1 T ((f_2 / f_1)^u - 1) / ln(f_2 / f_1) on the first way up;
    A = A_1 (A_2 / A_1)^u, by default A_1 f_1 / f, so that the road rises at the same speed throughout. The first wave
    grows out of the level.
    """

    kind: Literal["swept_sine"] = "swept_sine"
    """A swept sine."""
    low_Hz: float = Field(default=0.5, gt=0.0)
    """Frequency f_1 that the car feels at the beginning, and after each sweep up and down."""
    high_Hz: float = Field(default=20.0, gt=0.0)
    """Highest frequency f_2."""
    amplitude_m: float = Field(default=0.02, gt=0.0)
    """Amplitude A_1 at the lowest frequency."""
    amplitude_at_high_m: float | None = Field(default=None, gt=0.0)
    """Amplitude A_2 at the highest frequency; by default `amplitude_m` times `low_Hz` over `high_Hz`."""
    sweep_s: float = Field(default=60.0, gt=0.0)
    """Time T from the lowest to the highest frequency."""

    @model_validator(mode="after")
    def _rises(self) -> SweptSine:
        if self.high_Hz <= self.low_Hz:
            raise ValueError(f"high_Hz must be above low_Hz (got {self.high_Hz:g} and {self.low_Hz:g} Hz)")
        return self

    @override
    def own_name(self) -> str:
        return f"swept-sine-{self.low_Hz:g}-{self.high_Hz:g}Hz"

    @override
    def profile(self, way: Way) -> Profile:
        spacing = way.vehicle_speed / (self.high_Hz * _KNOTS_A_WAVE)
        knots = math.ceil(way.distance / spacing) + END_REACH
        return through(self.height(spacing / way.vehicle_speed * np.arange(knots, dtype=np.float64)), spacing)

    def height(self, time: Array) -> Array:
        """Return the (n,) height under axle 1 [m] at (n,) times [s] from 0 on."""
        ratio = self.high_Hz / self.low_Hz
        last = self.amplitude_m / ratio if self.amplitude_at_high_m is None else self.amplitude_at_high_m
        ways, along = np.divmod(time / self.sweep_s, 1.0)
        up = ways % 2 == 0
        share = np.where(up, along, 1.0 - along)
        whole = self.low_Hz * self.sweep_s / math.log(ratio) * (ratio - 1.0)
        part = self.low_Hz * self.sweep_s / math.log(ratio) * (ratio**share - 1.0)
        turns = ways * whole + np.where(up, part, whole - part)
        grown = np.clip(self.low_Hz * time, 0.0, 1.0)
        size = self.amplitude_m * (last / self.amplitude_m) ** share * grown * grown * (3.0 - 2.0 * grown)
        return np.asarray(size * np.sin(2.0 * np.pi * turns))


ROADS = (Sine, SweptSine)
