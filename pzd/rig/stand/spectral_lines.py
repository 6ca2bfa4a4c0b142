"""What motions made of spectral lines have in common: a band, and the period after which they repeat."""

from __future__ import annotations

from pathlib import Path
from typing import ClassVar, Self

import numpy as np
from pydantic import Field, model_validator

from pzd.rig.stand.waveform import Waveform, two_turns


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
        """The period."""
        return self.period_s

    @property
    def settling(self) -> float:
        """Two turns at the lowest frequency, or a second."""
        return two_turns(self.low_Hz)
