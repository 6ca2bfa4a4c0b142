"""The flow curve and its inverse."""

from __future__ import annotations

import numpy as np
import pytest

from pzd.damper import flow
from pzd.damper.compiled.kernels import row_of
from pzd.damper.flow import flow_force, flow_speed, smooth_speed
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


SEARCHES = {
    "_searched_thinning": ("smooth_rise", {"shear_thinning": {"n": 0.45}}),
    "_searched_speed": ("smooth_slope", {"orifice_quadratic": {"q": 300.0}}),
}


@pytest.mark.parametrize("search", SEARCHES)
@pytest.mark.parametrize("friction", [0.01, 700.0])
def test_a_search_for_the_speed_ends_where_newtons_method_has_converged(search, friction, monkeypatch) -> None:
    """Quadratic convergence from a guess a tenth off takes a handful of slopes; bisection to the end would take 50."""
    slope, effect = SEARCHES[search]
    damper = Damper(base=(BaseRow(voltage_V=None, T0_N=friction, C_Ns_per_m=990.0, k_N_per_m=3e7),))
    for name, values in {**effect, "rounded_yield": {"w_s": 0.0085}}.items():
        damper = damper.with_effect(name, values)
    row, counted, taken = row_of(nodes_of(damper, None).rows[0]), getattr(flow, slope), [0]

    def one_more(*given: object) -> float:
        taken[0] += 1
        return counted(*given)

    monkeypatch.setattr(flow, slope, one_more)
    for speed in np.geomspace(1e-3, 1.0, 40):
        for guess in (0.9 * speed, speed, 1.1 * speed):
            taken[0] = 0
            force = flow_force(speed, row, 1.0)
            assert getattr(flow, search).__wrapped__(force, row, 1.0, guess) == pytest.approx(speed, rel=1e-11)
            assert taken[0] <= 12


@pytest.mark.parametrize("guess", [0.0, 1e-9, 0.1])
def test_below_the_friction_no_speed_is_found_and_none_is_not_a_number(guess) -> None:
    """A stage of a piece may lie beyond the edge of its regime, where a sharp friction leaves nothing to the flow."""
    damper = Damper(base=(BaseRow(voltage_V=None, T0_N=200.0, C_Ns_per_m=690.0, k_N_per_m=3e7),))
    damper = damper.with_effect("shear_thinning", {"n": 0.27}).with_effect("orifice_quadratic", {"q": 140.0})
    row = row_of(nodes_of(damper, None).rows[0])
    for force in (1e-9, 100.0, 199.0, 200.0 * (1.0 - 1e-15), 200.0):
        assert 0.0 <= smooth_speed(force, row, 1.0, guess) <= 1e-12
