"""Warm-up: every cycle of a long test over time and temperature, against forces that fade by a known law."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fresh_truths import TABLE_2, sine_test

from pzd.artefacts.identified import Characteristics, WarmUpRow, courses
from pzd.identification.characteristics import characteristics
from pzd.quantities import Control
from pzd.record import Record, conditions
from pzd.report import tables

FADES_PER_K = 0.01
GAS = 85.0


def warming(cycles: float, kelvin: float, frequency: float = 2.0) -> Record:
    """A sine test whose temperature rises from 22 degC linearly while the damper's force fades; the gas force stays."""
    record = sine_test(TABLE_2[0.0], frequency, 0.03, cycles=cycles, name="warm")
    warmth = kelvin * (record.time - record.time[0]) / (record.time[-1] - record.time[0])
    force = record.force * np.exp(-FADES_PER_K * warmth) + GAS
    return replace(record, force=force, temperature=22.0 + warmth)


def of(*records: Record) -> Characteristics:
    return characteristics(*conditions(records))


def test_the_force_of_every_cycle_follows_its_own_temperature() -> None:
    record = warming(40, 20.0)
    rows = of(record).warm_up
    assert 38 <= len(rows) <= 40
    assert [row.cycle for row in rows] == list(range(1, len(rows) + 1))
    cold = sine_test(TABLE_2[0.0], 2.0, 0.03, cycles=40)
    peak = of(cold).peak_velocity[0].rebound_force_N
    assert peak is not None
    for row in rows:
        faded = peak * np.exp(-FADES_PER_K * ((row.temperature_degC or 0.0) - 22.0))
        assert row.velocity_m_per_s == pytest.approx(0.03 * 4.0 * np.pi, rel=2e-3)
        assert row.rebound_force_N == pytest.approx(GAS + faded, rel=5e-3)
        assert row.compression_force_N == pytest.approx(GAS - faded, rel=5e-3)
        assert row.temperature_degC == pytest.approx(22.0 + row.time_s, rel=1e-3)  # 20 K in 20 s


def test_a_test_of_force_over_speed_is_none_until_it_is_long_or_warms() -> None:
    assert of(warming(10, 0.0)).warm_up == ()
    assert of(warming(10, 1.5)).warm_up == ()
    assert len(of(warming(10, 5.0)).warm_up) >= 9
    assert len(of(warming(40, 0.0)).warm_up) >= 38
    assert of(warming(4, 5.0)).warm_up == ()
    unknown = replace(warming(40, 0.0), temperature=None)
    assert {row.temperature_degC for row in of(unknown).warm_up} == {None}


def test_a_sweep_is_no_warm_up_however_long() -> None:
    base = warming(40, 20.0)
    x = 0.03 * np.sin(2.0 * np.pi * (0.5 * base.time + 0.1 * base.time**2))
    v = np.gradient(x, base.time)
    assert of(replace(base, displacement=x, velocity=v, force=2000.0 * v)).warm_up == ()


def test_the_warm_up_does_not_depend_on_the_phase_at_which_a_record_begins() -> None:
    whole = warming(40, 20.0)
    late = whole.time >= 0.31
    channels = ("time", "displacement", "velocity", "acceleration", "force", "temperature")
    cut = replace(whole, **{name: getattr(whole, name)[late] for name in channels})
    (one,), (other,) = courses(of(whole).warm_up), courses(of(cut).warm_up)
    assert other.last.rebound_force_N == pytest.approx(one.last.rebound_force_N, rel=5e-3)
    assert other.last.temperature_degC == pytest.approx(one.last.temperature_degC, abs=0.5)


def test_noise_of_the_load_cell_averages_out_in_the_course(rng: np.random.Generator) -> None:
    clean = warming(40, 20.0)
    noisy = replace(clean, force=clean.force + 15.0 * rng.standard_normal(clean.force.size))
    (truth,), (found,) = courses(of(clean).warm_up), courses(of(noisy).warm_up)
    assert found.cycles == truth.cycles
    assert found.first.rebound_force_N == pytest.approx(truth.first.rebound_force_N, abs=10.0)
    assert found.last.compression_force_N == pytest.approx(truth.last.compression_force_N, abs=10.0)


def row(cycle: int, force: float, record: str = "r", warmth: float | None = None) -> WarmUpRow:
    return WarmUpRow(
        record=record,
        setting=None,
        voltage_V=None,
        cycle=cycle,
        time_s=float(cycle),
        temperature_degC=warmth,
        velocity_m_per_s=0.1,
        rebound_force_N=force,
        compression_force_N=-force,
    )


def test_each_test_has_a_warm_up_from_the_mean_of_its_first_three_cycles_to_its_last_three() -> None:
    rows = [*(row(n, 100.0 * n) for n in range(1, 8)), row(1, 7.0), row(2, 9.0), row(3, 8.0, record="s")]
    assert [
        (one.cycles, one.first.rebound_force_N, one.last.rebound_force_N, one.last.record) for one in courses(rows)
    ] == [(7, 200.0, 600.0, "r"), (2, 8.0, 8.0, "r"), (1, 8.0, 8.0, "s")]
    assert courses([]) == ()


def test_warm_up_rows_are_written_and_read_back_and_an_earlier_run_has_none(tmp_path: Path) -> None:
    found, current = of(warming(10, 5.0)), Control("current", "A")
    found.write(tmp_path, current)
    assert "current_A" in (tmp_path / "warm_up.csv").read_text(encoding="utf-8").splitlines()[0]
    assert Characteristics.read(tmp_path, current) == found
    (tmp_path / "warm_up.csv").unlink()
    assert Characteristics.read(tmp_path, current) == replace(found, warm_up=())


def test_the_terminal_shows_the_warm_up() -> None:
    found = Characteristics(warm_up=tuple(row(n, 100.0 * n, warmth=20.0 + n) for n in range(1, 8)))
    (table,) = [one for one in tables.characteristics(found, Control()) if one.rows]
    assert table.title.startswith("Warm-up")
    assert table.lines() == [
        "speed [m/s]  cycles  temperature [degC]  rebound [N]  compression [N]  record",
        "0.1          7       22 to 26            200 to 600   -200 to -600     r",
    ]
