"""The stage table: the force of the published dampers, its inverse, its operating envelope and its notes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from pzd.artefacts import Diagnosed, Rig, Table
from pzd.damper.model import BaseRow, Damper
from pzd.force_table.config import TableConfig
from pzd.force_table.lookup import Lookup
from pzd.force_table.stage import force_table
from pzd.paper.published import published
from pzd.quantities import Control
from pzd.record import Record

# T0 [N], C [N s/m], k [N/m] by voltage [V], as Tables 1 to 3 print them.
TABLES = {
    1: {0.0: (820, 9200, 581e3), 100.0: (1985, 16400, 778e3), 150.0: (3410, 13700, 1.11e6)},
    2: {0.0: (301, 2720, 199e3), 50.0: (356, 3300, 358e3), 100.0: (796, 3040, 375e3), 150.0: (1325, 2560, 423e3)},
    3: {0.0: (169, 3300, 214e3), 50.0: (190.6, 2590, 261e3), 100.0: (1363, 2660, 346e3), 150.0: (1078, 3380, 385e3)},
}
DEGREES = {1: 22.0, 2: 22.0, 3: 43.0}


def damper_of(tables: Sequence[int], **effects: dict[str, float]) -> Damper:
    rows = [
        BaseRow(voltage_V=U, temperature_degC=DEGREES[t], T0_N=float(T0), C_Ns_per_m=float(C), k_N_per_m=float(k))
        for t in tables
        for U, (T0, C, k) in TABLES[t].items()
    ]
    return Damper(base=tuple(rows), effects=dict(effects), reference_temperature_degC=22.0)


def sine(voltage: float | None, temperature: float | None, amplitude: float = 0.03, frequency: float = 2.0) -> Record:
    t = np.arange(0.0, 2.0, 1e-3)
    w = 2 * np.pi * frequency
    x, v, a = amplitude * np.sin(w * t), amplitude * w * np.cos(w * t), -amplitude * w**2 * np.sin(w * t)

    def level(value: float | None) -> np.ndarray[Any, np.dtype[np.float64]] | None:
        return None if value is None else np.full(t.size, value)

    return Record(f"r{voltage}-{temperature}", None, t, x, v, a, 1e3 * v, level(voltage), level(temperature))


def table_of(damper: Damper, config: TableConfig | None = None, **motion: float) -> Table:
    records = tuple(sine(row.voltage_V, row.temperature_degC, **motion) for row in damper.base)
    return force_table(config or TableConfig(), Rig(records, ()), Diagnosed.undiagnosed(damper), Control(), None)


@pytest.mark.parametrize("number", [1, 2, 3])
def test_the_table_holds_friction_plus_damping_times_speed(number: int) -> None:
    lookup = Lookup.of(table_of(damper_of([number])))
    for voltage, (T0, C, _) in TABLES[number].items():
        for velocity in (1e-6, 0.01, 0.14, 0.38, 0.67, 1.0):
            assert lookup.force(voltage, velocity) == pytest.approx(T0 + C * velocity, rel=1e-12)
            assert lookup.force(voltage, -velocity) == pytest.approx(-T0 - C * velocity, rel=1e-12)
        assert lookup.force(voltage, 0.0) == T0
        assert lookup.force(voltage, -0.0) == -T0


def test_two_temperatures_are_in_one_table_which_is_linear_between() -> None:
    table = table_of(damper_of([2, 3]))
    force = Lookup.of(table, 32.5).force(150.0, 0.2)
    assert force == pytest.approx((1325 + 1078) / 2 + (2560 + 3380) / 2 * 0.2)


def test_table_3_falls_from_100_to_150_volts_below_040_metres_per_second() -> None:
    notes = table_of(damper_of([3])).notes.not_monotone
    crossing = (1363 - 1078) / (3380 - 2660)
    assert any(f"below {crossing:.3g} m/s: force falls from 100 to 150 V; the lowest voltage" in n for n in notes)
    crossing = (190.6 - 169) / (3300 - 2590)
    assert any(f"above {crossing:.3g} m/s: force falls from 0 to 50 V" in n for n in notes)


def test_a_damper_that_rises_with_voltage_everywhere_has_nothing_to_note() -> None:
    rows = [BaseRow(voltage_V=U, T0_N=100.0 + U, C_Ns_per_m=1e3 + U, k_N_per_m=1e5) for U in (0.0, 50.0, 100.0)]
    table = table_of(Damper(base=tuple(rows)))
    assert table.notes.not_monotone == ()
    forces = np.array([r.force_N for r in table.force]).reshape(3, -1)
    assert np.all(np.diff(np.abs(forces), axis=0) > 0.0)


def test_every_row_of_the_inverse_has_a_voltage_and_gives_its_force() -> None:
    table = table_of(damper_of([2, 3]))
    assert all(row.voltage_V is not None for row in table.inverse)
    for temperature in (22.0, 43.0):
        lookup = Lookup.of(table, temperature)
        rows = [row for row in table.inverse if row.temperature_degC == temperature]
        force = lookup.force([r.voltage_V or 0.0 for r in rows], [r.velocity_m_per_s for r in rows])
        np.testing.assert_allclose(force, [r.force_N for r in rows], rtol=1e-9, atol=1e-9)


def test_at_every_speed_the_inverse_goes_from_the_least_to_the_largest_force() -> None:
    table = table_of(damper_of([1]))
    lookup = Lookup.of(table)
    assert {row.velocity_m_per_s for row in table.inverse} == {row.velocity_m_per_s for row in table.force}
    for velocity in (-1.0, -0.0, 0.0, 1.0):
        rows = [r for r in table.inverse if str(r.velocity_m_per_s) == str(velocity)]
        low, high = lookup.range(velocity)
        assert (rows[0].force_N, rows[-1].force_N) == (low, high)
        assert np.diff([r.force_N for r in rows]) == pytest.approx((high - low) / 40.0)


def test_a_force_in_a_gap_of_the_table_is_empty_or_has_the_nearest_voltage() -> None:
    """Tested fast at 0 and 150 V and slowly between: at speed only the two ends are known."""
    damper = damper_of([1])
    records = tuple(sine(U, 22.0, amplitude) for U, amplitude in {0.0: 0.03, 100.0: 0.005, 150.0: 0.03}.items())
    made = [
        force_table(
            TableConfig(outside="error", unreachable=unreachable, voltages_V=(0.0, 100.0, 150.0)),
            Rig(records, ()),
            Diagnosed.undiagnosed(damper),
            Control(),
            None,
        )
        for unreachable in ("empty", "clamp")
    ]
    fast = 0.03 * 4.0 * np.pi
    empty, clamped = (
        [row for row in table.inverse if row.velocity_m_per_s == pytest.approx(fast, rel=1e-3)] for table in made
    )
    assert [row.voltage_V for row in empty] == [0.0, *[None] * 39, 150.0]
    assert [row.voltage_V for row in clamped] == [*[0.0] * 21, *[150.0] * 20]


def test_rows_outside_the_envelope_are_marked_and_clamped_or_empty_as_configured() -> None:
    damper = damper_of([2])
    reached = 0.03 * 4 * np.pi
    tables = {o: table_of(damper, TableConfig(outside=o)) for o in ("model", "clamp", "error")}
    for table in tables.values():
        assert table.notes.reached_m_per_s == pytest.approx(reached, rel=1e-4)
        assert all(r.inside == int(abs(r.velocity_m_per_s) <= reached) for r in table.force)
    last = {o: table.force[-1] for o, table in tables.items()}
    assert last["model"].force_N == pytest.approx(1325 + 2560 * 1.0)
    assert last["clamp"].force_N == pytest.approx(1325 + 2560 * reached, rel=1e-4)
    assert last["error"].force_N is None
    assert np.isnan(Lookup.of(tables["error"]).force(100.0, 0.5))
    assert np.isfinite(Lookup.of(tables["error"]).force(100.0, 0.37))


def test_each_voltage_has_the_reached_speeds_of_its_own_tests() -> None:
    damper = damper_of([2])
    amplitudes = {0.0: 0.03, 50.0: 0.03, 100.0: 0.01, 150.0: 0.01}
    records = tuple(sine(U, 22.0, amplitude) for U, amplitude in amplitudes.items())
    table = force_table(TableConfig(), Rig(records, ()), Diagnosed.undiagnosed(damper), Control(), None)
    fast = Lookup.of(table).envelope > 0.02 * 4 * np.pi
    np.testing.assert_array_equal(fast, [True, True, False, False])


def test_a_curved_law_is_followed_within_the_tolerance(rng: np.random.Generator) -> None:
    damper = damper_of([2], orifice_quadratic={"q": 4000.0}, stribeck_friction={"F_s": 150.0, "v_s": 0.004})
    lookup = Lookup.of(table_of(damper))
    v = np.concatenate([rng.uniform(0.0, 1.0, 300), rng.uniform(0.0, 0.02, 300)])
    exact = 301.0 + 2720.0 * v + 4000.0 * v**2 + 150.0 * np.exp(-((v / 0.004) ** 2))
    assert np.max(np.abs(lookup.force(0.0, v) - exact)) < 2e-3 * 8000.0


def test_the_notes_list_what_steady_slip_does_not_show() -> None:
    lost = table_of(
        damper_of(
            [2],
            gas_spring={"k_g": 5e3},
            fluid_inertia={"m": 2.0},
            valve_lag={"tau": 0.004},
            sensor_delay={"tau": 0.001},
            lash={"delta": 1e-4},
            asymmetry={"alpha": 0.1},
            preload_offset={"F_0": 40.0},
            stribeck_friction={"F_s": 50.0, "v_s": 0.05},
        )
    ).notes.lost
    named = {line.split(":")[0] for line in lost[1:]}
    assert named == {"gas_spring", "fluid_inertia", "valve_lag", "sensor_delay", "lash", "preload_offset"}
    assert "6.05 to 13.7 ms" in lost[0]


def test_a_rig_without_voltage_has_one_column_and_no_inverse() -> None:
    table = table_of(Damper(base=(BaseRow(T0_N=100.0, C_Ns_per_m=2e3, k_N_per_m=1e5),)))
    assert {row.voltage_V for row in table.force} == {None}
    assert {row.temperature_degC for row in table.force} == {None}
    assert table.inverse == ()
    assert Lookup.of(table).force(0.0, 0.1) == pytest.approx(300.0)


def test_the_table_is_read_back_as_it_was_written(tmp_path: Any) -> None:
    table = table_of(damper_of([3]), TableConfig(outside="error"))
    table.write(tmp_path, Control("current", "A"))
    again = Table.read(tmp_path, Control("current", "A"))
    assert (again.force, again.inverse, again.notes) == (table.force, table.inverse, table.notes)
    zero = [r.velocity_m_per_s for r in again.force if r.velocity_m_per_s == 0.0]
    assert [np.signbit(v) for v in zero] == [True, False] * (len(zero) // 2)


def test_published_rows_are_those_tested_here() -> None:
    rows = [row for row in published().values() if row.quantity in {"T0", "C", "k"}]
    assert len(rows) == 3 * sum(len(table) for table in TABLES.values())
    for row in rows:
        printed = TABLES[int(row.figure_or_table[-1])][row.voltage_V]
        assert row.number == printed[("T0", "C", "k").index(row.quantity)]
