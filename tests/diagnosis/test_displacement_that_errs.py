"""An error of the displacement that repeats with the cycle goes through a stiff oil spring, and is no effect."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.random import Generator
from synthetic import all_but, diagnosed, sine

from pzd.damper.model import BaseRow, Damper

Effects = dict[str, dict[str, float | tuple[float, ...]]]
STIFFNESS = 1e6
"""[N/m]"""
HARDER: Effects = {"asymmetry": {"alpha": 0.1}}


@pytest.mark.parametrize("effects", [{}, HARDER], ids=["plain", "asymmetry"])
def test_a_bent_rod_makes_no_effect_beside_what_is_there(effects: Effects, rng: Generator) -> None:
    """6 to 10 um at two to five times the frequency, up to 10 N of the force, once gave a rounded yield at 97 %."""
    amplitude, frequency = rng.uniform(0.01, 0.03), rng.uniform(0.5, 1.5)
    speed = 2.0 * np.pi * frequency * amplitude
    row = BaseRow(T0_N=250.0, C_Ns_per_m=250.0 / speed, k_N_per_m=STIFFNESS)
    size, order, phase = rng.uniform(6e-6, 1e-5), rng.integers(2, 6), rng.uniform(0.0, 2.0 * np.pi)
    records = []
    for f, x in ((1.0, 1.0), (0.3, 1.0), (2.0, 0.5)):
        made = sine(Damper(base=(row,), effects=effects), 0.0, f * frequency, x * amplitude, rng, noise=2e-3, cycles=6)
        error = size * np.sin(2.0 * np.pi * order * f * frequency * made.time + phase)
        records.append(replace(made, displacement=made.displacement + error, voltage=None))
    others = all_but("asymmetry", "rounded_yield", "stribeck_friction", "lash")
    assert diagnosed(records, forbid=others).diagnosis.effects == tuple(effects)
