"""An effect too faint to show in the gap as a whole: what is said of it is what the tests show."""

from __future__ import annotations

import re

import numpy as np
from campaign import damper_of, sine
from whole_diagnosis import diagnosed


def test_a_name_never_rests_on_a_gap_of_nothing(rng: np.random.Generator) -> None:
    """Two cycles know too little of noise to show any gap; the orifice is found in its own direction all the same."""
    damper = damper_of((0.0,), orifice_quadratic={"q": 8000.0})
    record = sine(damper, 0.0, 1.0, 0.015, rng, noise=0.007, colour=0.0, cycles=2, rate=500.0)
    told = diagnosed((record,)).diagnosis
    assert told.effects == ("orifice_quadratic",)
    assert "falls from 0 %" not in told.reason
    moved = re.search(r"moves the force by ([0-9.]+) % of peak", told.reason)
    assert moved is not None
    assert 0.25 <= float(moved[1]) < 5.0
