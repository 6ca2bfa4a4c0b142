"""Characteristics of tests against closed forms: force over speed, gas force, friction, response to a step."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fresh_truths import OVERSAMPLING, RATE, TABLE_2, sine_test

from pzd.artefacts.identified import Characteristics, PeakVelocityRow
from pzd.damper.compose import respond
from pzd.damper.element import element_force
from pzd.damper.model import BaseRow, Damper
from pzd.damper.motion import Motion
from pzd.identification.bingham_fit import Bingham
from pzd.identification.characteristics import characteristics
from pzd.quantities import Control
from pzd.record import Array, Record, conditions
from pzd.report import tables
from pzd.report.columns import TERMINAL
from pzd.schema.errors import DataError

SPEEDS = (0.131, 0.262, 0.524, 1.047)
"""Of a usual series of tests at constant velocity [m/s]."""


def of(*records: Record) -> Characteristics:
    """What the records show, as identify summarises it."""
    return characteristics(*conditions(records))


def driven(course: Callable[[Array], Array], seconds: float, truth: Bingham, name: str = "r") -> Record:
    """A motion through the exact element at many times the sampling rate, then thinned to it."""
    fine = np.arange(round(seconds * RATE) * OVERSAMPLING + 1) / (RATE * OVERSAMPLING)
    force = element_force(course(fine), 1.0 / (RATE * OVERSAMPLING), *truth)[::OVERSAMPLING]
    time = fine[::OVERSAMPLING]
    x = course(time)
    v = np.gradient(x, time)
    return Record(name, None, time, x, v, np.gradient(v, time), force)


def to_and_fro(speeds: Sequence[float], stroke: float = 0.1, rest: float = 0.2, times: int = 1) -> tuple[Array, Array]:
    """Corners (time, displacement) of strokes out and back at each speed in turn, with rests at the ends."""
    time, x = [0.0], [-0.5 * stroke]
    for speed in list(speeds) * times:
        for end in (0.5 * stroke, -0.5 * stroke):
            time += [time[-1] + rest, time[-1] + rest + stroke / speed]
            x += [x[-1], end]
    return np.array([*time, time[-1] + rest]), np.array([*x, x[-1]])


def at_constant_speed(speeds: Sequence[float], truth: Bingham, times: int = 1) -> Record:
    corners = to_and_fro(speeds, times=times)
    return driven(lambda t: np.interp(t, *corners), float(corners[0][-1]), truth)


def forces(row: PeakVelocityRow) -> tuple[float, float]:
    assert row.rebound_force_N is not None
    assert row.compression_force_N is not None
    return row.rebound_force_N, row.compression_force_N


@pytest.mark.parametrize("times", [1, 3], ids=["once", "repeated"])
def test_at_constant_speed_a_bingham_damper_gives_friction_and_damping_less_what_the_oil_spring_takes(
    times: int,
) -> None:
    """From a rest under -T0 the spring goes 2 T0 / k before the oil flows, and then lags by C / k up to mid-stroke."""
    truth = TABLE_2[0.0]
    rows = of(at_constant_speed(SPEEDS, truth, times)).peak_velocity
    assert [row.kind for row in rows] == ["constant velocity"] * 4
    for row, speed in zip(rows, SPEEDS, strict=True):
        flowing = (0.05 - 2.0 * truth.friction / truth.stiffness) / speed
        wound_up = 1.0 - np.exp(-flowing * truth.stiffness / truth.damping)
        expected = truth.friction + truth.damping * speed * wound_up
        assert row.rebound_velocity_m_per_s == pytest.approx(speed, rel=1e-6)
        assert row.compression_velocity_m_per_s == pytest.approx(-speed, rel=1e-6)
        assert forces(row) == pytest.approx((expected, -expected), rel=5e-3)


@pytest.mark.parametrize("voltage", [0.0, 150.0])
@pytest.mark.parametrize(("frequency", "amplitude"), [(0.5, 0.04), (1.0, 0.04), (2.0, 0.03)])
def test_the_peak_of_a_sine_is_friction_and_damping_less_what_the_oil_spring_takes(
    voltage: float, frequency: float, amplitude: float
) -> None:
    """F - T0 is C v behind a first-order lag of C / k: in phase with the speed it is C v / (1 + (w C / k)^2)."""
    truth = TABLE_2[voltage]
    (row,) = of(sine_test(truth, frequency, amplitude)).peak_velocity
    omega = 2.0 * np.pi * frequency
    lag = omega * truth.damping / truth.stiffness
    expected = truth.friction + truth.damping * omega * amplitude / (1.0 + lag**2)
    assert row.kind == "sine"
    assert row.rebound_velocity_m_per_s == pytest.approx(omega * amplitude, rel=1e-4)
    assert forces(row) == pytest.approx((expected, -expected), rel=2e-3)


@pytest.mark.parametrize("phase", [0.0, 0.7, np.pi / 2, 2.5, np.pi, 4.0, 5.5])
def test_one_cycle_in_any_phase_shows_what_many_show(phase: float) -> None:
    many = sine_test(TABLE_2[0.0], 2.0, 0.03, cycles=3.0, phase=phase)
    last = many.time >= many.time[-1] - 0.5 - 1e-9
    channels = ("time", "displacement", "velocity", "acceleration", "force")
    one = replace(many, **{name: getattr(many, name)[last] for name in channels})
    (single,), (repeated,) = of(one).peak_velocity, of(many).peak_velocity
    assert single.rebound_velocity_m_per_s == pytest.approx(repeated.rebound_velocity_m_per_s, rel=2e-3)
    assert forces(single) == pytest.approx(forces(repeated), rel=3e-3)


def test_characteristics_do_not_depend_on_time_and_zero_of_a_test() -> None:
    record = sine_test(TABLE_2[0.0], 2.0, 0.03)
    shifted = replace(record, time=record.time + 1234.5, displacement=record.displacement + 0.31)
    (here,), (there,) = of(record).peak_velocity, of(shifted).peak_velocity
    assert there.middle_m == pytest.approx(here.middle_m + 0.31, abs=1e-6)
    assert forces(there) == pytest.approx(forces(here), rel=1e-5)


def test_a_damper_turned_round_swaps_rebound_and_compression() -> None:
    straight = sine_test(TABLE_2[0.0], 2.0, 0.03)
    record = replace(straight, force=straight.force + 80.0 + 300.0 * np.maximum(straight.velocity, 0.0))
    mirrored = replace(record, displacement=-record.displacement, velocity=-record.velocity, force=-record.force)
    (one,), (other,) = of(record).peak_velocity, of(mirrored).peak_velocity
    assert forces(other) == pytest.approx([-force for force in reversed(forces(one))], rel=1e-6)
    (gas,), (turned,) = of(record).gas_and_friction, of(mirrored).gas_and_friction
    assert turned.friction_N == pytest.approx(gas.friction_N, rel=1e-6)


@pytest.mark.parametrize("every", [2, 5])
def test_characteristics_do_not_depend_on_the_sampling_rate(every: int) -> None:
    for record in (sine_test(TABLE_2[0.0], 2.0, 0.03), at_constant_speed((0.131, 0.524), TABLE_2[0.0])):
        channels = ("time", "displacement", "velocity", "acceleration", "force")
        coarse = replace(record, **{name: getattr(record, name)[::every] for name in channels})
        for fine, thin in zip(of(record).peak_velocity, of(coarse).peak_velocity, strict=True):
            assert thin.rebound_velocity_m_per_s == pytest.approx(fine.rebound_velocity_m_per_s, rel=2e-3)
            assert forces(thin) == pytest.approx(forces(fine), rel=3e-3)


def test_noise_of_the_load_cell_averages_out(rng: np.random.Generator) -> None:
    for clean in (sine_test(TABLE_2[0.0], 2.0, 0.03), at_constant_speed(SPEEDS, TABLE_2[0.0])):
        noise = 15.0 * rng.standard_normal(clean.time.size)
        for row, truth in zip(
            of(replace(clean, force=clean.force + noise)).peak_velocity, of(clean).peak_velocity, strict=True
        ):
            assert forces(row) == pytest.approx(forces(truth), abs=15.0)


def only_as_it_stands(found: Characteristics) -> bool:
    """Whether the one record shows no test of the trade."""
    return len(found.as_it_stands) == 1 and found == Characteristics(as_it_stands=found.as_it_stands)


def test_a_road_and_a_sweep_are_no_such_tests(rng: np.random.Generator) -> None:
    white = rng.standard_normal(20000)
    road = np.cumsum(np.convolve(white, np.hanning(400) / 200.0, mode="same")) * 5e-5
    time = np.arange(20000) / RATE
    sweep = 0.02 * np.sin(2.0 * np.pi * (0.5 * time + 0.1 * time**2))
    base = sine_test(TABLE_2[0.0], 2.0, 0.03)
    for x in (road, sweep):
        v = np.gradient(x, time)
        record = replace(
            base, time=time, displacement=x, velocity=v, acceleration=np.gradient(v, time), force=900.0 * v
        )
        assert only_as_it_stands(of(record))


def test_one_stroke_of_constant_speed_in_another_motion_makes_no_test(rng: np.random.Generator) -> None:
    ends, turns = np.tile([-0.05, 0.05], 4)[:7], np.append(0.0, np.cumsum(rng.uniform(0.3, 0.9, 6)))

    def course(t: Array) -> Array:
        stroke = np.clip(np.searchsorted(turns, t, side="right") - 1, 0, 5)
        share = np.clip((t - turns[stroke]) / (turns[stroke + 1] - turns[stroke]), 0.0, 1.0)
        share = np.where(stroke == 2, share, 0.5 * (1.0 - np.cos(np.pi * share)))
        return ends[stroke] + share * (ends[stroke + 1] - ends[stroke])

    assert only_as_it_stands(of(driven(course, float(turns[-1]), TABLE_2[0.0])))


def knock(name: str) -> Record:
    """A blow of 50 ms that drives the rod out at up to 0.4 m/s, and a creep back."""
    time = np.arange(500) / 1000.0
    v = 0.4 * np.sin(2.0 * np.pi * time / 0.1) ** 2 * (time < 0.05) - 0.001 * (time > 0.4)
    x = np.cumsum(v) / 1000.0
    force = np.where(time < 0.05, 2000.0 * v + 50.0, -80.0)
    return Record(name, None, time, x, v, np.gradient(v, time), force)


def test_a_knock_has_a_row_of_its_extremes_alone() -> None:
    record = knock("knock")
    found = of(record, at_constant_speed((0.131,), TABLE_2[0.0]))
    assert {row.record for row in found.peak_velocity} == {"r"}
    (row,) = found.as_it_stands
    assert row.record == "knock"
    assert (row.rebound_force_N, row.compression_force_N) == (record.force.max(), -80.0)
    assert (row.rebound_velocity_m_per_s, row.compression_velocity_m_per_s) == (record.velocity.max(), -0.001)
    assert row.stroke_m == np.ptp(record.displacement)
    assert row.duration_s == pytest.approx(0.499)


def test_several_tests_without_a_pause_have_a_row_each() -> None:
    truth, speeds = TABLE_2[0.0], []
    parts = [(1.0, 6.0), (2.0, 3.0)]

    def course(t: Array) -> Array:
        return np.where(t < 6.0, 0.03 * np.sin(2.0 * np.pi * t), 0.03 * np.sin(4.0 * np.pi * (t - 6.0)))

    rows = of(driven(course, sum(seconds for _, seconds in parts), truth)).peak_velocity
    speeds = [row.rebound_velocity_m_per_s for row in rows]
    assert speeds == pytest.approx([0.03 * 2.0 * np.pi * f for f, _ in parts], rel=2e-3)


# ---------------------------------------------------------------- gas force and friction


def test_a_slow_test_shows_gas_force_and_friction_as_they_are() -> None:
    truth = Bingham(120.0, 2000.0, 4e5)
    record = at_constant_speed((0.005,), truth)
    (row,) = of(replace(record, force=record.force + 85.0)).gas_and_friction
    assert row.method == "slow test"
    assert row.gas_force_N == pytest.approx(85.0, rel=1e-3)
    assert row.friction_N == pytest.approx(120.0 + 2000.0 * 0.005, rel=1e-3)
    (turned,) = of(replace(record, displacement=-record.displacement, force=-record.force - 85.0)).gas_and_friction
    assert turned.gas_force_N == pytest.approx(-85.0, rel=1e-3)


def test_a_slow_test_that_only_strains_the_oil_spring_shows_neither() -> None:
    """It gave "gas 150 N, friction 0": what the spring stood at as the test began, of a damper of 300 N."""
    truth = Bingham(300.0, 2000.0, 1e5)
    slow = replace(sine_test(truth, 0.02, 0.001), name="slow")
    slow = replace(slow, force=slow.force + 150.0)
    assert of(slow).gas_and_friction == ()
    (row,) = of(slow, replace(sine_test(truth, 0.02, 0.03), name="slipping")).gas_and_friction
    assert row.gas_force_N == pytest.approx(0.0, abs=2.0)
    assert row.friction_N == pytest.approx(300.0, rel=0.03)


def test_faster_tests_lead_to_rest_along_a_line() -> None:
    truth = TABLE_2[0.0]
    record = at_constant_speed(SPEEDS, truth)
    (row,) = of(replace(record, force=record.force + 85.0)).gas_and_friction
    assert row.method == "extrapolated to rest"
    assert row.velocity_m_per_s == pytest.approx(SPEEDS[0], rel=1e-6)
    assert row.gas_force_N is None
    assert row.friction_N == pytest.approx(truth.friction, rel=5e-3)


@pytest.mark.parametrize("bent", [False, True])
def test_a_rebound_unlike_compression_is_no_gas_force(bent: bool) -> None:
    """Three times the damping in rebound, straight or digressive: two speeds led to a gas of 780 N; there is none."""
    record = at_constant_speed(SPEEDS, Bingham(1.0, 1.0, 4e5))
    v = record.velocity
    way = np.where(v > 0.0, 3.0, 1.0) * v
    record = replace(record, force=2000.0 * np.tanh(way / 0.05) if bent else 1000.0 * way)
    (row,) = of(record).gas_and_friction
    assert row.gas_force_N is None
    (line,) = next(table for table in tables.characteristics(of(record), Control()) if "Static" in table.title).cells(
        TERMINAL
    )[1:]
    assert "cannot be told from asymmetry" in line


def test_faster_tests_of_a_force_that_bends_lead_to_no_friction() -> None:
    """Over the knee of a race damper the line through two speeds led to 270 N of a seal of 35 N."""
    record = at_constant_speed(SPEEDS, Bingham(1.0, 1.0, 4e5))
    v = record.velocity
    record = replace(record, force=35.0 * np.sign(v) + 600.0 * np.tanh(v / (1.5 * SPEEDS[0])))
    (row,) = of(record).gas_and_friction
    assert row.friction_N is None


def test_faster_tests_that_lead_below_no_friction_show_none() -> None:
    record = at_constant_speed(SPEEDS, Bingham(1.0, 1.0, 4e5))
    (row,) = of(replace(record, force=1e5 * record.velocity * np.abs(record.velocity))).gas_and_friction
    assert row.friction_N is None


def test_a_gas_spring_is_read_at_the_middle_of_the_stroke() -> None:
    record = sine_test(TABLE_2[0.0], 0.05, 0.03)
    record = replace(record, displacement=record.displacement + 0.2)
    record = replace(record, force=record.force + 85.0 + 1500.0 * (record.displacement - 0.2))
    (row,) = of(record).gas_and_friction
    assert row.method == "slow test"
    assert row.middle_m == pytest.approx(0.2, abs=1e-5)
    assert row.gas_force_N == pytest.approx(85.0, rel=0.03)  # the two peaks lie off the middle, by a millimetre


# ---------------------------------------------------------------- the continuous-velocity plot


def test_the_cycle_of_a_rigid_damper_lies_on_its_law() -> None:
    truth = Bingham(301.0, 2720.0, 1e11)
    rows = of(sine_test(truth, 2.0, 0.03)).continuous_velocity
    v = np.array([row.velocity_m_per_s for row in rows])
    force = np.array([row.force_N for row in rows])
    fast = np.abs(v) > 0.05
    assert np.count_nonzero(fast) > 80
    expected = truth.friction * np.sign(v) + truth.damping * v
    np.testing.assert_allclose(force[fast], expected[fast], atol=2e-3 * np.abs(expected).max())
    assert v[: len(v) // 2].min() > -0.03  # rebound first
    assert v[len(v) // 2 :].max() < 0.03


def test_cycles_that_have_not_settled_are_left_out() -> None:
    calm = sine_test(TABLE_2[0.0], 2.0, 0.03, cycles=12)
    begun = replace(calm, force=calm.force + 900.0 * np.exp(-calm.time / 0.15))
    rows, late = (np.array([row.force_N for row in of(r).continuous_velocity]) for r in (begun, calm))
    np.testing.assert_allclose(rows, late, atol=0.01 * np.abs(late).max())


# ---------------------------------------------------------------- the step of the control signal

TAU = 0.0039
"""Lag of the valve [s]: 90 % in the 9 ms that Makowski and Knap state."""


def stepped(course: Callable[[Array], Array], seconds: float, noise: Array | None = None) -> Record:
    """A voltage that steps between 0 and 150 V every second, from the middle of a stroke on; friction follows a lag."""
    damper = Damper(
        base=tuple(
            BaseRow(voltage_V=u, temperature_degC=None, T0_N=t0, C_Ns_per_m=1000.0, k_N_per_m=1e9)
            for u, t0 in ((0.0, 300.0), (150.0, 1300.0))
        ),
        effects={"valve_lag": {"tau": TAU}},
    )
    time = np.arange(round(seconds * 2000)) / 2000.0
    x = course(time)
    v = np.gradient(x, time)
    a = np.gradient(v, time)
    voltage = np.where(np.floor(time) % 2 == 1, 150.0, 0.0)
    force = respond(damper, Motion(time, x, v, a, voltage))
    return Record("step", None, time, x, v, a, force if noise is None else force + noise[: time.size], voltage)


def triangle(time: Array) -> Array:
    """0.1 m/s to and fro, once a second, each whole second in the middle of a stroke."""
    return 0.1 * (np.abs((time + 0.75) % 1.0 - 0.5) - 0.25)


def test_a_first_order_lag_takes_its_own_times_to_63_and_90_percent() -> None:
    rows = of(stepped(triangle, 6.0)).steps
    assert [(row.from_voltage_V, row.to_voltage_V) for row in rows] == [(0.0, 150.0), (150.0, 0.0)] * 2 + [(0.0, 150.0)]
    for row in rows:
        assert row.status == "ok"
        assert abs(row.velocity_m_per_s or 0.0) == pytest.approx(0.1, rel=1e-6)
        assert abs((row.to_force_N or 0.0) - (row.from_force_N or 0.0)) == pytest.approx(1000.0, rel=1e-3)
        assert row.to_63_percent_s == pytest.approx(-TAU * np.log(0.37), abs=3e-4)
        assert row.to_90_percent_s == pytest.approx(0.009, abs=4e-4)


def test_noise_does_not_bring_the_answer_forward(rng: np.random.Generator) -> None:
    rows = of(stepped(triangle, 21.0, 15.0 * rng.standard_normal(42000))).steps
    assert {row.status for row in rows} == {"ok"}
    assert np.mean([row.to_90_percent_s or 0.0 for row in rows]) == pytest.approx(0.009, abs=6e-4)


def test_a_step_while_the_speed_changes_has_no_times() -> None:
    rows = of(stepped(lambda t: 0.03 * np.sin(2.0 * np.pi * t), 4.0)).steps
    assert {row.status for row in rows} == {"the speed was not constant"}
    assert {row.to_90_percent_s for row in rows} == {None}


def test_a_ramp_of_the_voltage_is_no_step() -> None:
    record = stepped(triangle, 4.0)
    found = of(replace(record, voltage=150.0 * record.time / 4.0))
    assert found.steps == ()
    assert [(row.record, row.voltage_V) for row in found.as_it_stands] == [("step", None)]


# ---------------------------------------------------------------- the files


def test_step_responses_are_written_and_read_back_under_the_name_of_the_control(tmp_path: Path) -> None:
    current = Control("current", "A")
    found = of(sine_test(TABLE_2[0.0], 2.0, 0.03, voltage=0.0), stepped(triangle, 4.0))
    found.write(tmp_path, current)
    assert all(rows for rows in (found.peak_velocity, found.continuous_velocity, found.gas_and_friction, found.steps))
    assert Characteristics.read(tmp_path, current) == found
    assert "current_A" in (tmp_path / "pvp.csv").read_text(encoding="utf-8").splitlines()[0]


def test_a_rebound_that_goes_backwards_is_refused_with_its_line(tmp_path: Path) -> None:
    found = of(sine_test(TABLE_2[0.0], 2.0, 0.03))
    speed = found.peak_velocity[0].rebound_velocity_m_per_s
    found.write(tmp_path, Control())
    path = tmp_path / "pvp.csv"
    path.write_text(path.read_text(encoding="utf-8").replace(repr(speed), f"-{speed!r}"), encoding="utf-8")
    with pytest.raises(DataError, match=r"pvp\.csv:2: rebound_velocity_m_per_s"):
        Characteristics.read(tmp_path, Control())
