"""Policies that hold the best value: it is found, it is stated, and no other does better."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from simulate_dampers import damper_after_table_2, table_of

from pzd.artefacts import Diagnosed, Rides
from pzd.simulate.config import SimulateConfig
from pzd.simulate.ride.model import grid_of
from pzd.simulate.stage import simulate
from pzd.simulate.study.tuning import best_value, damping_range

SHORT = {"duration_s": 4.0, "settle_s": 2.0, "roads": [{"kind": "sine", "frequency_Hz": 1.3, "label": "road"}]}


def rides(**given: object) -> Rides:
    config = SimulateConfig.model_validate_json(json.dumps({**SHORT, **given}))
    damper = damper_after_table_2()
    return simulate(config, Diagnosed.undiagnosed(damper), table_of(damper), 1, Path())


@pytest.mark.parametrize("best", [0.0, 3.3, 7.9, 10.0])
def test_the_least_of_a_valley_is_found_wherever_it_lies(best: float) -> None:
    assert best_value(lambda x: (x - best) ** 2, 0.0, 10.0) == pytest.approx(best, abs=0.2)


def test_of_two_valleys_the_deeper_one_is_found() -> None:
    assert best_value(lambda x: min((x - 1.0) ** 2 + 0.5, (x - 8.0) ** 2), 0.0, 10.0) == pytest.approx(8.0, abs=0.2)


def test_a_range_of_one_value_is_that_value() -> None:
    assert best_value(lambda x: x, 4.0, 4.0) == 4.0


@pytest.mark.parametrize("fidelity", ["table", "dynamic"])
def test_no_fixed_voltage_does_better_than_the_best(fidelity: str) -> None:
    """Near the resonance of the body a harder damper than that at 0 V is more comfortable."""
    best = rides(policies=["best_fixed_voltage"], fidelities=[fidelity])
    assert 0.0 <= best.ridden[0].voltage_V <= 150.0
    for voltage in (0.0, 20.0, 60.0, 90.0, 130.0, 150.0):
        other = rides(policies=["passive"], fidelities=[fidelity], passive_voltage_V=voltage)
        assert best.weighted[0].a_w_m_per_s2 <= other.weighted[0].a_w_m_per_s2 * 1.002
    again = rides(policies=["passive"], fidelities=[fidelity], passive_voltage_V=best.ridden[0].voltage_V)
    assert again.weighted[0].a_w_m_per_s2 == best.weighted[0].a_w_m_per_s2


def test_no_constant_c_does_better_than_the_best() -> None:
    best = rides(policies=["best_constant_c"], fidelities=["ideal"], c_min_Ns_per_m=750, c_max_Ns_per_m=45000)
    for damping in (750.0, 1500.0, 3000.0, 6000.0, 12000.0, 45000.0):
        other = rides(policies=["constant"], fidelities=["ideal"], constant_damping_Ns_per_m=damping)
        assert best.weighted[0].a_w_m_per_s2 <= other.weighted[0].a_w_m_per_s2 * 1.002
    assert best.ridden[0].voltage_V is None


def test_without_bounds_in_the_config_c_lies_between_the_softest_and_the_hardest_of_the_table() -> None:
    """Softest: 301 N + 2720 N s/m at the tested 0.4 m/s; hardest: 1325 N + 2560 N s/m at a tenth of it."""
    grid = grid_of(table_of(damper_after_table_2()), None)
    assert damping_range(grid, None) == pytest.approx((301.0 / 0.4 + 2720.0, 1325.0 / 0.04 + 2560.0))
    assert damping_range(grid, (750.0, 45000.0)) == (750.0, 45000.0)
