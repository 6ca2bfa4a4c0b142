"""Nodes of records with moving voltage, the state being the place of the piston."""

from __future__ import annotations

import numpy as np
import pytest
from fresh_truths import TABLE_2, moving_test, sine_test, with_noise

from pzd.artefacts import ParameterRow, Rig
from pzd.identification.bingham_fit import Bingham
from pzd.identification.config import IdentifyConfig
from pzd.identification.moving_voltage import dwell_levels, node_weights, voltage_nodes
from pzd.identification.stage import identify
from pzd.record import Array, Record
from pzd.schema.errors import ConfigError


def rows_for(*records: Record, nodes: tuple[float, ...] | None = None) -> tuple[ParameterRow, ...]:
    return identify(IdentifyConfig(nodes=nodes), Rig(records, ()), seed=1).rows


def steps(time: Array) -> Array:
    return 75.0 + 75.0 * np.tanh(30.0 * np.sin(2.0 * np.pi * 0.7 * time))


def ramp(time: Array) -> Array:
    return 150.0 * np.abs(np.mod(time / 4.0, 2.0) - 1.0)


def values(row: ParameterRow) -> Bingham:
    return Bingham(row.T0_N, row.C_Ns_per_m, row.k_N_per_m)


@pytest.mark.parametrize("voltage", [steps, ramp])
def test_moving_records_alone_give_both_ends(voltage) -> None:
    rows = rows_for(moving_test(voltage, seconds=6.0))
    assert [row.voltage_V for row in rows] == pytest.approx([0.0, 150.0], abs=0.1)
    for row, truth in zip(rows, TABLE_2.values(), strict=True):
        assert row.status == "ok"
        np.testing.assert_allclose(values(row), truth, rtol=1e-3)


def test_under_noise_the_intervals_hold_the_truth(rng: np.random.Generator) -> None:
    held = 0
    for _ in range(4):
        rows = rows_for(with_noise(moving_test(steps, seconds=6.0), rng, correlation=0.5))
        for row, truth in zip(rows, TABLE_2.values(), strict=True):
            held += row.T0_N_low95 <= truth.friction <= row.T0_N_high95
            held += row.C_Ns_per_m_low95 <= truth.damping <= row.C_Ns_per_m_high95
            held += row.k_N_per_m_low95 <= truth.stiffness <= row.k_N_per_m_high95
    assert held >= 19


def test_constant_records_alone_decide_on_the_nodes_that_they_determine() -> None:
    constant = [sine_test(p, 2.0, 0.03, voltage=u, name=f"c{u:.0f}") for u, p in TABLE_2.items()]
    alone = rows_for(*constant)
    assert rows_for(*constant, moving_test(ramp)) == alone
    assert [row.voltage_V for row in alone] == [0.0, 150.0]


def test_a_single_constant_voltage_is_fixed_and_the_dwell_levels_are_fitted() -> None:
    constant = sine_test(TABLE_2[0.0], 2.0, 0.03, voltage=0.0, name="c")
    held, fitted = rows_for(constant, moving_test(steps))
    assert held == rows_for(constant)[0]
    assert fitted.voltage_V == pytest.approx(150.0, abs=0.1)
    np.testing.assert_allclose(values(fitted), TABLE_2[150.0], rtol=1e-3)


def test_rows_rise_with_the_voltage_whichever_was_fitted_first() -> None:
    constant = sine_test(TABLE_2[150.0], 2.0, 0.03, cycles=4, voltage=150.0, name="c")
    rows = rows_for(constant, moving_test(steps, seconds=4.0))
    assert [row.voltage_V for row in rows] == pytest.approx([0.0, 150.0], abs=0.1)


@pytest.mark.ci
@pytest.mark.parametrize("amplitude", [0.001, 0.002])
def test_a_node_that_its_constant_record_does_not_determine_is_fitted_to_moving_records_too(amplitude: float) -> None:
    slow = sine_test(TABLE_2[0.0], 0.05, amplitude, cycles=2, rate=250, voltage=0.0, name="slow")
    (alone,) = rows_for(slow)
    assert alone.C_Ns_per_m is None or (alone.C_Ns_per_m_low95, alone.status[:4]) == (0.0, "weak")
    rows = rows_for(slow, moving_test(steps))
    assert [row.voltage_V for row in rows] == pytest.approx([0.0, 150.0], abs=0.1)
    np.testing.assert_allclose(values(rows[0]), TABLE_2[0.0], rtol=2e-3)
    assert rows[0].status == "ok"


def test_the_config_may_choose_the_nodes() -> None:
    rows = rows_for(moving_test(ramp, seconds=8.0), nodes=(0.0, 75.0, 150.0))
    assert [row.voltage_V for row in rows] == [0.0, 75.0, 150.0]
    middle = np.mean([TABLE_2[0.0], TABLE_2[150.0]], axis=0)
    np.testing.assert_allclose(values(rows[1]), middle, rtol=1e-2)


def test_a_node_that_no_record_reaches_is_undetermined() -> None:
    rows = rows_for(moving_test(steps, seconds=2.0), nodes=(0.0, 150.0, 400.0))
    assert rows[-1].status.startswith("undetermined: T0, C, k")
    assert rows[-1].T0_N is None


def test_nodes_too_close_together_are_refused() -> None:
    with pytest.raises(ConfigError, match=r"identify\.nodes: two nodes are closer than 3"):
        rows_for(moving_test(steps), nodes=(0.0, 1.0, 150.0))


def test_dwell_levels_are_those_of_a_staircase_and_the_ends_of_a_ramp() -> None:
    time = np.arange(20000) / 1000.0
    staircase = np.select([time < 5.0, time < 9.0, time < 15.0], [20.0, 60.0, 140.0], 100.0)
    assert sorted(dwell_levels(staircase, 3.0)) == [20.0, 60.0, 100.0, 140.0]
    low, high = sorted(dwell_levels(ramp(time), 3.0))
    assert (low, high) == pytest.approx((0.0, 150.0), abs=0.1)


def test_two_constant_voltages_are_the_nodes_whatever_moves() -> None:
    np.testing.assert_array_equal(voltage_nodes([moving_test(ramp)], [145.0, 10.0], None, 150.0), [10.0, 145.0])


def test_the_nodes_reach_as_far_as_the_voltage_moves() -> None:
    """A staircase to 100 V beside ramps to 150 V: the table ended at 100 V, and the damper was 5 % off above."""
    staircase = moving_test(lambda time: 50.0 * np.floor(np.mod(time, 3.0)))
    found = voltage_nodes([moving_test(ramp), staircase], [], None, 150.0)
    assert found == pytest.approx([0.0, 50.0, 100.0, 150.0], abs=1.0)
    beside = voltage_nodes([moving_test(ramp)], [0.0, 75.0], None, 150.0)
    assert beside == pytest.approx([0.0, 75.0, 150.0], abs=1.0)


def test_node_weights_sum_to_one_and_are_constant_beyond_the_ends() -> None:
    shares = node_weights(np.array([0.0, 50.0, 150.0]), np.array([-10.0, 25.0, 100.0, 200.0]))
    np.testing.assert_allclose(shares, [[1, 0, 0], [0.5, 0.5, 0], [0, 0.5, 0.5], [0, 0, 1]])
