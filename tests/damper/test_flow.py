"""The flow curve and its inverse."""

from __future__ import annotations

import numpy as np
import pytest

from pzd.damper.compiled.kernels import row_of
from pzd.damper.flow import flow_force, flow_speed
from pzd.damper.model import BaseRow, Damper
from pzd.damper.parameter_rows import nodes_of


@pytest.mark.parametrize("friction", [1e-7, 200.0])
@pytest.mark.parametrize("guess", [0.0, 1e-12, 1e-3, 1.0])
def test_the_speed_of_a_thinning_fluid_is_found_however_small_it_is(friction, guess) -> None:
    """T0 tanh(w / w_s) + C w_r (w / w_r)^n, whose slope at w = 0 is infinite; speeds down to 1e-24 m/s."""
    damper = Damper(base=(BaseRow(voltage_V=None, T0_N=friction, C_Ns_per_m=690.0, k_N_per_m=3e7),))
    damper = damper.with_effect("shear_thinning", {"n": 0.27}).with_effect("rounded_yield", {"w_s": 0.0145})
    row = row_of(nodes_of(damper, None).rows[0])
    for speed in np.geomspace(1e-24, 2.0, 60):
        force = flow_force(speed, row, 1.0)
        assert flow_speed(force, row, 1.0, guess) == pytest.approx(speed, rel=1e-11)
