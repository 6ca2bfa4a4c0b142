"""Several sines at a time: x = sum A_i sin(2 pi f_i t), which repeat only where they have a common period."""

from __future__ import annotations

from pathlib import Path
from typing import Literal, Self

import numpy as np
from pydantic import Field, model_validator

from pzd.record import Array
from pzd.rig.stand.waveforms import Course, Waveform
from pzd.signals.harmonics import FourierSum


class Tones(Waveform):
    """Several sines at a time, as a double-sine test runs a ride frequency under a wheel-hop frequency."""

    kind: Literal["tones"] = "tones"
    """Several sines at a time."""
    frequencies_Hz: tuple[float, ...] = Field(min_length=2)
    """Frequencies, each above 0 and no two alike."""
    amplitudes_m: tuple[float, ...] = Field(min_length=2)
    """Amplitude of each, above 0."""

    @model_validator(mode="after")
    def _of_each_tone(self) -> Self:
        if len(self.amplitudes_m) != len(self.frequencies_Hz):
            raise ValueError(
                f"each tone has a frequency and an amplitude (got {len(self.frequencies_Hz)} and "
                f"{len(self.amplitudes_m)})"
            )
        if min(*self.frequencies_Hz, *self.amplitudes_m) <= 0.0:
            raise ValueError("frequencies and amplitudes are above 0")
        if len(set(self.frequencies_Hz)) < len(self.frequencies_Hz):
            raise ValueError("no two tones have one frequency; give it once, with the sum of the amplitudes")
        return self

    def own_name(self) -> str:
        """Return the name made of its parameters: `tones-1-2.7Hz-0.02m`, the amplitude that of the first."""
        return f"tones-{'-'.join(f'{f:g}' for f in self.frequencies_Hz)}Hz-{self.amplitudes_m[0]:g}m"

    @property
    def lowest_frequency(self) -> float:
        """Frequency of the lowest tone [Hz]."""
        return min(self.frequencies_Hz)

    def course(self, draw: np.random.Generator, folder: Path) -> Course:
        """Return the sum of the sines, each exactly."""
        tones = [
            FourierSum(1.0 / frequency, np.array([0.0, -1j * amplitude]))
            for frequency, amplitude in zip(self.frequencies_Hz, self.amplitudes_m, strict=True)
        ]

        def motion(time: Array) -> tuple[Array, Array, Array]:
            x, v, a = (np.sum(of_tones, axis=0) for of_tones in zip(*(tone(time) for tone in tones), strict=True))
            return x, v, a

        return motion


WAVEFORM = Tones
