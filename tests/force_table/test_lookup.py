"""Interpolation in a force table: exact for a linear law, monotone, one-sided at zero speed."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pzd.artefacts import ForceRow, Table, TableNotes
from pzd.force_table.lookup import Lookup
from pzd.schema.errors import DataError

SPEEDS = [0.0, 0.05, 0.2, 0.4]


def table_of(
    law: Callable[..., float | None],
    voltages: tuple[float | None, ...] = (0.0, 50.0, 150.0),
    temperatures: tuple[float | None, ...] = (None,),
    outside: Any = "model",
    reach: float = 0.4,
) -> Table:
    velocities = [-v for v in SPEEDS[::-1]] + SPEEDS
    rows = [
        ForceRow(
            temperature_degC=T,
            voltage_V=U,
            velocity_m_per_s=v,
            force_N=law(T, U, v),
            inside=1 if abs(v) <= reach else 0,
        )
        for T in temperatures
        for U in voltages
        for v in velocities
    ]
    return Table(tuple(rows), (), TableNotes(outside=outside, reached_m_per_s=reach, lost=(), not_monotone=()))


def bingham(T: float | None, U: float, v: float) -> float:
    return float(np.copysign(300.0 + 5.0 * U, v) + (3000.0 + 2.0 * U) * v)


def test_bilinear_reading_is_exact_for_a_bingham_law(rng: np.random.Generator) -> None:
    lookup = Lookup.of(table_of(bingham))
    U, v = rng.uniform(0, 150, 200), rng.uniform(-0.4, 0.4, 200)
    wanted = [bingham(None, a, b) for a, b in zip(U, v, strict=True)]
    np.testing.assert_allclose(lookup.force(U, v), wanted, rtol=1e-12)


def test_zero_speed_has_two_sides_and_nothing_between() -> None:
    lookup = Lookup.of(table_of(bingham))
    assert lookup.force(50.0, 0.0) == 550.0
    assert lookup.force(50.0, -0.0) == -550.0
    assert lookup.force(50.0, 1e-12) == pytest.approx(550.0)
    assert lookup.force(50.0, -1e-12) == pytest.approx(-550.0)


def test_force_is_constant_beyond_the_outermost_voltages() -> None:
    lookup = Lookup.of(table_of(bingham))
    assert lookup.force(-20.0, 0.2) == lookup.force(0.0, 0.2)
    assert lookup.force(400.0, 0.2) == lookup.force(150.0, 0.2)


def test_beyond_the_last_speed_the_table_follows_the_model_is_constant_or_is_empty_as_configured() -> None:
    assert Lookup.of(table_of(bingham)).force(50.0, 0.9) == pytest.approx(bingham(None, 50.0, 0.9), rel=1e-12)
    assert Lookup.of(table_of(bingham, outside="clamp")).force(50.0, 0.9) == bingham(None, 50.0, 0.4)

    def ends(T: float | None, U: float, v: float) -> float | None:
        return bingham(T, U, v) if abs(v) <= 0.2 else None

    empty = Lookup.of(table_of(ends, outside="error", reach=0.2))
    assert np.isnan(empty.force(50.0, 0.21))
    assert empty.force(50.0, 0.2) == pytest.approx(bingham(None, 50.0, 0.2))
    assert np.isnan(empty.voltage_for(1000.0, -0.21))
    assert empty.range(0.3) == (np.inf, -np.inf)


def test_force_is_linear_between_temperatures_and_constant_beyond() -> None:
    lookup = table_of(lambda T, U, v: bingham(T, U, v) * (1.0 - 0.01 * T), temperatures=(20.0, 40.0))
    middle = Lookup.of(lookup, 25.0).force(50.0, 0.2)
    assert middle == pytest.approx(bingham(None, 50.0, 0.2) * 0.75)
    assert Lookup.of(lookup, 90.0).force(50.0, 0.2) == pytest.approx(bingham(None, 50.0, 0.2) * 0.6)
    assert Lookup.of(lookup).force(50.0, 0.2) == pytest.approx(bingham(None, 50.0, 0.2) * 0.8)


def test_inside_follows_the_reached_speeds_of_each_voltage() -> None:
    table = table_of(bingham)
    rows = [
        row.model_copy(update={"inside": int(abs(row.velocity_m_per_s) <= (0.4 if row.voltage_V == 0.0 else 0.2))})
        for row in table.force
    ]
    lookup = Lookup.of(Table(tuple(rows), (), table.notes))
    assert lookup.envelope[0] == pytest.approx(0.4, abs=0.1)
    assert lookup.envelope[1:] == pytest.approx(0.2, abs=0.1)


columns = st.lists(st.floats(10.0, 5000.0), min_size=2, max_size=6)
shapes = st.tuples(columns, st.floats(0.0, 5000.0), st.floats(-0.6, 0.6), st.floats(0.0, 1.0))


@given(shapes)
def test_a_force_within_the_range_comes_back_from_its_voltage(shape: tuple[list[float], float, float, float]) -> None:
    frictions, damping, velocity, share = shape
    voltages = tuple(np.arange(float(len(frictions))) * 10.0)

    def law(T: float | None, U: float, v: float) -> float:
        return float(np.copysign(frictions[int(U / 10.0)], v) + damping * v)

    lookup = Lookup.of(table_of(law, voltages=voltages))
    low, high = lookup.range(velocity)
    wanted = float(low + share * (high - low))
    wanted = min(max(wanted, float(low)), float(high))
    assert lookup.force(lookup.voltage_for(wanted, velocity), velocity) == pytest.approx(wanted, rel=1e-9)
    assert np.isnan(lookup.voltage_for(high + 1.0, velocity))
    assert np.isnan(lookup.voltage_for(low - 1.0, velocity))
    assert lookup.force(lookup.nearest_voltage_for(high + 1.0, velocity), velocity) == pytest.approx(float(high))


@given(columns, st.floats(0.0, 50.0), st.floats(-0.4, 0.4))
def test_force_never_leaves_the_forces_of_the_neighbouring_nodes(
    frictions: list[float], voltage: float, velocity: float
) -> None:
    voltages = tuple(np.arange(float(len(frictions))) * 10.0)

    def law(T: float | None, U: float, v: float) -> float:
        return float(np.copysign(frictions[int(U / 10.0)], v) + 1e3 * v)

    lookup = Lookup.of(table_of(law, voltages=voltages))
    i = min(int(voltage / 10.0), len(frictions) - 1)
    near = [law(None, voltages[j], velocity) for j in (i, min(i + 1, len(frictions) - 1))]
    margin = 1e-9 * max(map(abs, near))
    assert min(near) - margin <= lookup.force(voltage, velocity) <= max(near) + margin


def test_of_several_voltages_that_give_a_force_the_lowest_is_taken() -> None:
    hill = {0.0: 100.0, 50.0: 500.0, 150.0: 200.0}
    lookup = Lookup.of(table_of(lambda _, U, v: float(np.copysign(hill[U], v))))
    assert lookup.voltage_for(300.0, 0.1) == pytest.approx(25.0)
    assert lookup.range(0.1) == (100.0, 500.0)


def test_a_table_without_control_signal_has_one_column() -> None:
    lookup = Lookup.of(table_of(lambda T, _, v: bingham(T, 0.0, v), voltages=(None,)))
    assert lookup.force(70.0, 0.2) == pytest.approx(bingham(None, 0.0, 0.2))
    assert lookup.range(0.2) == (lookup.force(0.0, 0.2), lookup.force(0.0, 0.2))


@pytest.mark.parametrize(
    "spoil",
    [
        lambda rows: rows[1:],
        lambda rows: rows[::-1],
        lambda rows: (rows[0].model_copy(update={"velocity_m_per_s": -0.5}), *rows[1:]),
        lambda _: (),
    ],
)
def test_a_table_edited_out_of_shape_is_refused(spoil: Callable[[tuple[ForceRow, ...]], tuple[ForceRow, ...]]) -> None:
    table = table_of(bingham)
    with pytest.raises(DataError, match=r"force\.csv"):
        Lookup.of(Table(tuple(spoil(table.force)), (), table.notes))
