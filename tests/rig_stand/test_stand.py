"""The virtual stand as a whole: truth, fixture, warming, voltages, names, and what depends on the seed."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pzd.damper.compose import respond
from pzd.damper.element import element_force
from pzd.damper.motion import Motion
from pzd.quantities import Control
from pzd.rig.config import Fixture, RigConfig
from pzd.rig.files.channels import without_fixture
from pzd.rig.stage import synthesise
from pzd.rig.stand.config import VirtualEntry
from pzd.rig.stand.recording import StandRecord, run_campaign

SINE = {"kind": "sine", "frequency_Hz": 2.0, "amplitude_m": 0.03}
TRIANGLE = {"kind": "triangle", "frequency_Hz": 1.5, "amplitude_m": 0.02}
ROAD = {"kind": "road", "period_s": 4.0, "peak_m": 0.02}
TABLE_2 = [
    {"voltage_V": 0, "T0_N": 301, "C_Ns_per_m": 2720, "k_N_per_m": 199_000},
    {"voltage_V": 150, "T0_N": 1325, "C_Ns_per_m": 2560, "k_N_per_m": 423_000},
]
ONE = [{"T0_N": 400, "C_Ns_per_m": 2500, "k_N_per_m": 300_000}]


def stand(base: Any = ONE, effects: Any = None, reference: Any = None, **changes: Any) -> VirtualEntry:
    """An entry as a config would hold it; voltages where the damper has some."""
    damper = {"base": base, "effects": effects or {}, "reference_temperature_degC": reference}
    usual = {"damper": damper, "tests": [{"waveform": SINE, "cycles": 3}]}
    if base is TABLE_2:
        usual["voltages_V"] = [150]
    return VirtualEntry.model_validate_json(json.dumps(usual | changes))


def taken(entry: VirtualEntry, seed: int = 1) -> list[StandRecord]:
    return list(run_campaign(entry, seed))


# ---------------------------------------------------------------- the truth


@pytest.mark.parametrize("waveform", [SINE, TRIANGLE, ROAD])
@pytest.mark.parametrize("effects", [{}, {"orifice_quadratic": {"q": 2500}}])
def test_truth_is_within_1e_6_of_peak_of_a_four_times_finer_one(waveform: Any, effects: Any, seed: int) -> None:
    tests = [{"waveform": waveform, "duration_s": 1}]
    usual, finer = (taken(stand(TABLE_2, effects, tests=tests, oversampling=o), seed)[0].true_force for o in (16, 64))
    assert np.sqrt(np.mean((usual - finer) ** 2)) < 1e-6 * np.abs(finer).max()


def test_truth_under_voltage_steps_is_within_2e_5_of_peak_of_a_finer_one() -> None:
    steps = [{"kind": "steps", "voltages_V": [0, 150], "dwell_s": 0.3}]
    usual, finer = (taken(stand(TABLE_2, voltages_V=steps, oversampling=o))[0].true_force for o in (16, 64))
    assert np.sqrt(np.mean((usual - finer) ** 2)) < 2e-5 * np.abs(finer).max()


def test_truth_is_not_what_a_fit_that_joins_the_samples_by_straight_lines_computes() -> None:
    entry = stand(rate_Hz=200, tests=[{"waveform": SINE, "cycles": 5}])
    (test,) = taken(entry)
    fit = element_force(test.displacement, 1.0 / 200.0, 400.0, 2500.0, 300_000.0, test.force[0])
    error = np.sqrt(np.mean((fit - test.force) ** 2)) / np.abs(test.force).max()
    assert 1e-4 < error < 1e-2


def test_truth_without_slip_is_the_oil_spring_alone() -> None:
    (test,) = taken(stand([{"T0_N": 1e6, "C_Ns_per_m": 1e3, "k_N_per_m": 2e4}]))
    np.testing.assert_allclose(test.true_force, 2e4 * test.truth.displacement, atol=1e-5)


@pytest.mark.parametrize("waveform", [SINE, TRIANGLE, ROAD])
def test_force_is_periodic_from_the_first_sample(waveform: Any, seed: int) -> None:
    cycle = {"sine": 0.5, "triangle": 1.0 / 1.5, "road": 4.0}[waveform["kind"]]
    (test,) = taken(stand(rate_Hz=3000, tests=[{"waveform": waveform, "cycles": 2}]), seed)
    period = round(cycle * 3000)
    np.testing.assert_allclose(test.true_force[period:], test.true_force[:-period], atol=1e-4)


def test_a_test_starts_from_rest_before_its_recording_begins() -> None:
    seen: list[Motion] = []

    def law(damper: object, motion: Motion, frame: float | None) -> np.ndarray:
        seen.append(motion)
        return motion.velocity.copy()

    list(run_campaign(stand(), 1, law=law))
    assert seen[0].time[0] == pytest.approx(-1.0)
    assert (seen[0].displacement[0], seen[0].velocity[0], seen[0].acceleration[0]) == (0.0, 0.0, 0.0)


def test_a_record_spans_its_cycles_and_begins_at_time_zero() -> None:
    (test,) = taken(stand(tests=[{"waveform": SINE, "cycles": 3}]))
    assert test.time[0] == 0.0
    assert test.time[-1] == pytest.approx(1.5)
    np.testing.assert_allclose(np.diff(test.time), 1e-3)
    (test,) = taken(stand(tests=[{"waveform": SINE, "duration_s": 0.7}], rate_Hz=100))
    assert test.time.size == 71


@pytest.mark.parametrize("effects", [{}, {"lash": {"delta": 1e-3}}, {"gas_spring": {"k_g": 9000}}])
def test_the_rig_never_gets_work_out_of_a_damper_over_a_cycle(effects: Any, seed: int) -> None:
    tests = [{"waveform": waveform, "cycles": 1} for waveform in (SINE, TRIANGLE, ROAD)]
    for test in taken(stand(TABLE_2, effects, tests=tests, voltages_V=[0, 150]), seed):
        assert np.trapezoid(test.true_force, test.truth.displacement) > 1.0


# ---------------------------------------------------------------- the fixture


def test_a_frame_and_the_oil_spring_are_springs_in_series() -> None:
    (soft,) = taken(stand(fixture={"stiffness_N_per_m": 900_000}))
    series = 1.0 / (1.0 / 300_000 + 1.0 / 900_000)
    (stiff,) = taken(stand([{**ONE[0], "k_N_per_m": series}]))
    np.testing.assert_allclose(soft.true_force, stiff.true_force, atol=1e-6)


def test_a_gas_spring_in_a_frame_carries_what_two_springs_in_series_carry() -> None:
    nothing = [{"T0_N": 0, "C_Ns_per_m": 1e-3, "k_N_per_m": 1e5}]
    (test,) = taken(stand(nothing, {"gas_spring": {"k_g": 20_000}}, fixture={"stiffness_N_per_m": 200_000}))
    expected = test.truth.displacement / (1.0 / 20_000 + 1.0 / 200_000)
    np.testing.assert_allclose(test.true_force, expected, atol=0.01)


@pytest.mark.parametrize(
    "effects",
    [
        {"gas_spring": {"k_g": 20_000}, "orifice_quadratic": {"q": 2000}},
        {"end_stop": {"k_e": 1e7, "x_e": 0.02}},
        {"stribeck_friction": {"F_s": 150, "v_s": 0.05}, "lash": {"delta": 1e-3}},
    ],
)
def test_the_damper_of_its_own_extension_gives_the_force_that_the_cell_showed(effects: Any) -> None:
    entry = stand(
        TABLE_2, effects, fixture={"stiffness_N_per_m": 5e6}, rate_Hz=16_000, tests=[{"waveform": SINE, "cycles": 1}]
    )
    (test,) = taken(entry)
    extension = test.truth.displacement - test.true_force / 5e6
    velocity = np.gradient(extension, test.time)
    motion = Motion(test.time, extension, velocity, test.truth.acceleration, test.truth.voltage)
    alone = respond(entry.damper, motion, float(test.true_force[0]))
    settled = test.time > 0.2
    # A friction beside the element sees the speed behind the element's force alone, so it is a little off near v = 0.
    error = np.abs(alone - test.true_force)[settled] / np.abs(test.true_force).max()
    assert np.quantile(error, 0.98) < (4e-3 if "stribeck_friction" in effects else 1e-5)


def test_a_moving_mass_adds_its_inertia_and_a_tare_its_weight() -> None:
    plain, heavy = (taken(stand(fixture=f))[0] for f in ({}, {"mass_kg": 4.0, "tare_N": -35.0}))
    exact = 4.0 * -((4.0 * np.pi) ** 2) * plain.truth.displacement - 35.0
    np.testing.assert_allclose(heavy.true_force - plain.true_force, exact, atol=1e-6)


def test_taking_out_a_known_fixture_gives_the_damper_back() -> None:
    fixture = {"mass_kg": 4.0, "tare_N": -35.0, "stiffness_N_per_m": 2e7}
    (test,) = taken(stand(fixture=fixture, tests=[{"waveform": SINE, "cycles": 6}]))
    alone = without_fixture(Fixture(**fixture), test.time, test.displacement, test.force)
    force = element_force(alone.displacement, 1e-3, 400.0, 2500.0, 300_000.0, float(alone.force[0]))
    assert np.sqrt(np.mean((alone.force - force) ** 2)) < 2e-3 * np.abs(force).max()


# ---------------------------------------------------------------- warming

WARMING = {"kind": "warming", "start_degC": 22, "ambient_degC": 20, "heat_capacity_J_per_K": 50, "loss_W_per_K": 2}
DRIFT = {"temperature_drift": {"beta_T0": 0.02, "beta_C": 0.01}}


def test_heat_kept_and_heat_lost_are_the_work_done() -> None:
    (test,) = taken(stand(ONE, DRIFT, 22, temperatures_degC=[WARMING], tests=[{"waveform": SINE, "cycles": 6}]))
    truth = test.truth
    assert truth.temperature is not None
    assert truth.temperature[0] == pytest.approx(22.0, abs=1e-9)
    work = np.trapezoid(test.true_force, truth.displacement)
    kept = 50.0 * (truth.temperature[-1] - truth.temperature[0])
    lost = 2.0 * np.trapezoid(truth.temperature - 20.0, truth.time)
    assert kept + lost == pytest.approx(work, rel=1e-4)
    assert kept > 0.5 * work


def test_a_warm_damper_is_weaker_by_the_drift() -> None:
    effects = {**DRIFT, "temperature_drift": {"beta_T0": 0.02, "beta_C": 0.02}}
    tests = [{"waveform": SINE, "cycles": 10}]
    (test,) = taken(stand(ONE, effects, 22, temperatures_degC=[WARMING], tests=tests))
    (cold,) = taken(stand(ONE, effects, 22, temperatures_degC=[22], tests=tests))
    assert test.truth.temperature is not None
    last = test.time > 4.5
    rise = float(test.truth.temperature[last].mean()) - 22.0
    ratio = np.abs(test.true_force[last]).max() / np.abs(cold.true_force[last]).max()
    assert rise > 3.0
    assert ratio == pytest.approx(np.exp(-0.02 * rise), rel=0.03)


def test_temperature_levels_off_where_the_loss_balances_the_work() -> None:
    warming = {**WARMING, "heat_capacity_J_per_K": 5, "loss_W_per_K": 20}
    (test,) = taken(stand(temperatures_degC=[warming], tests=[{"waveform": SINE, "cycles": 10}]))
    assert test.truth.temperature is not None
    last = (test.time > 4.0) & (test.time <= 5.0)
    power = np.trapezoid(test.true_force[last], test.truth.displacement[last]) / 0.999
    assert test.truth.temperature[last].mean() == pytest.approx(20.0 + power / 20.0, rel=0.01)


# ---------------------------------------------------------------- voltages


def test_stepped_voltage_dwells_and_rises_in_time() -> None:
    steps = {"kind": "steps", "voltages_V": [0, 150, 50], "dwell_s": 0.2, "rise_s": 0.01}
    (test,) = taken(stand(TABLE_2, voltages_V=[steps]))
    assert test.truth.voltage is not None
    voltage = dict(zip(np.round(test.time, 6).tolist(), test.truth.voltage.tolist(), strict=True))
    found = [voltage[t] for t in (0.0, 0.199, 0.205, 0.211, 0.399, 0.411, 0.611, 0.811)]
    assert found == pytest.approx([0.0, 0.0, 75.0, 150.0, 150.0, 50.0, 0.0, 150.0])


def test_ramped_voltage_goes_from_start_to_end() -> None:
    (test,) = taken(stand(TABLE_2, voltages_V=[{"kind": "ramp", "start_voltage_V": 150, "end_voltage_V": 30}]))
    np.testing.assert_allclose(test.truth.voltage, np.linspace(150.0, 30.0, test.time.size), atol=1e-9)


def test_a_damper_without_valve_records_no_voltage_and_no_temperature() -> None:
    (test,) = taken(stand())
    assert test.voltage is None
    assert test.temperature is None


# ---------------------------------------------------------------- what is recorded


NOISY: dict[str, Any] = {
    "noise": {"force": {"share_of_peak": 0.01, "rho": 0.5}, "displacement": {"sd_m": 1e-5}},
    "jitter": {"gain": 0.02, "offset_of_peak": 0.005, "delay_s": 0.0005},
}


def by_name(entry: VirtualEntry, seed: int) -> dict[str, StandRecord]:
    return {test.name: test for test in run_campaign(entry, seed)}


def test_a_record_does_not_depend_on_the_other_records(seed: int) -> None:
    sine, road = {"waveform": SINE, "cycles": 2}, {"waveform": ROAD, "duration_s": 1}
    few = by_name(stand(TABLE_2, tests=[road], **NOISY), seed)
    many = by_name(stand(TABLE_2, tests=[sine, road, {"waveform": TRIANGLE}], voltages_V=[0, 150], **NOISY), seed)
    for name, test in few.items():
        np.testing.assert_array_equal(many[name].force, test.force)
        np.testing.assert_array_equal(many[name].displacement, test.displacement)


def test_one_seed_gives_one_campaign_and_another_seed_another(seed: int) -> None:
    entry = stand(tests=[{"waveform": ROAD, "duration_s": 1}], **NOISY)
    first, again, other = (taken(entry, s)[0] for s in (seed, seed, seed + 1))
    np.testing.assert_array_equal(first.force, again.force)
    assert np.corrcoef(first.truth.displacement, other.truth.displacement)[0, 1] < 0.95
    assert not np.array_equal(first.force - first.true_force, other.force - other.true_force)


def test_the_same_road_is_driven_at_every_voltage(seed: int) -> None:
    low, high = taken(stand(TABLE_2, voltages_V=[0, 150], tests=[{"waveform": ROAD, "duration_s": 1}], **NOISY), seed)
    np.testing.assert_array_equal(low.truth.displacement, high.truth.displacement)
    assert (
        abs(np.corrcoef(low.displacement - low.truth.displacement, high.displacement - high.truth.displacement)[0, 1])
        < 0.2
    )


def test_tests_differ_in_gain_offset_and_delay_as_configured(seed: int) -> None:
    entry = stand(jitter=NOISY["jitter"], tests=[{"waveform": SINE, "cycles": 1, "repeats": 150}], rate_Hz=200)
    drawn = []
    for test in run_campaign(entry, seed):
        rise = np.gradient(test.true_force, test.time)
        columns = np.stack([test.true_force, np.full(rise.size, np.abs(test.true_force).max()), -rise], axis=1)
        drawn.append(np.linalg.lstsq(columns, test.force - test.true_force, rcond=None)[0])
    np.testing.assert_allclose(np.std(drawn, axis=0), [0.02, 0.005, 0.0005], rtol=0.3)
    # Five standard errors of a mean of 150.
    np.testing.assert_array_less(np.abs(np.mean(drawn, axis=0)), 0.4 * np.array([0.02, 0.005, 0.0005]))


def test_a_delayed_force_is_the_force_of_before() -> None:
    plain, late = (taken(stand(force_delay_s=d))[0] for d in (0.0, 0.004))
    np.testing.assert_allclose(late.force[4:], plain.force[:-4], atol=1e-9)


def test_velocity_and_acceleration_of_a_record_come_from_its_noisy_displacement(seed: int) -> None:
    entry = stand(tests=[{"waveform": SINE, "cycles": 10}], noise=NOISY["noise"])
    (test,) = taken(entry, seed)
    (record,) = synthesise(RigConfig(virtual=(entry,)), seed, Control(), Path()).records
    np.testing.assert_array_equal(record.displacement, test.displacement)
    assert 0.0 < np.std(record.velocity - test.truth.velocity) < 0.05 * np.std(test.truth.velocity)


def test_another_law_puts_another_damper_into_the_stand() -> None:
    (test,) = run_campaign(stand(), 1, law=lambda damper, motion, frame: 100.0 * motion.velocity**3)
    np.testing.assert_allclose(test.true_force, 100.0 * test.truth.velocity**3)


# ---------------------------------------------------------------- names and faults


def test_names_say_setting_waveform_voltage_temperature_and_number() -> None:
    entry = stand(
        TABLE_2,
        setting="gap 0.25 mm",
        voltages_V=[0, {"kind": "steps", "voltages_V": [0, 100]}],
        temperatures_degC=[22, {"kind": "warming", "start_degC": 25}],
        tests=[{"waveform": SINE, "repeats": 2}, {"waveform": {**ROAD, "label": "village"}, "voltages_V": [50]}],
    )
    names = [planned.name for planned in entry.plan(Control("current", "A"))]
    assert len(names) == 2 * 2 * 2 + 2
    assert names[0] == "gap_0.25_mm-sine-2Hz-0.03m-0A-22degC-1"
    assert names[3] == "gap_0.25_mm-sine-2Hz-0.03m-steps-0-100A-22degC-2"
    assert names[-1] == "gap_0.25_mm-village-50A-warming-25degC"


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"base": TABLE_2, "voltages_V": None}, "voltages_V is missing: the damper has base rows at several"),
        ({"effects": {"valve_lag": {"tau": 0.01}}}, "voltages_V is missing: valve_lag depends"),
        ({"effects": DRIFT, "reference": 22}, "temperatures_degC is missing: temperature_drift depends"),
        ({"tests": [{"waveform": SINE}, {"waveform": SINE}]}, "two records would be called sine-2Hz-0.03m"),
        ({"tests": [{"waveform": SINE, "cycles": 2, "duration_s": 1}]}, "not both"),
        ({"oversampling": 8}, "oversampling"),
        (
            {"base": TABLE_2, "voltages_V": [{"kind": "steps", "voltages_V": [0, 1], "dwell_s": 0.001}]},
            "rise_s must be",
        ),
    ],
)
def test_an_impossible_stand_is_refused(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        stand(**changes)


def test_records_taken_at_the_same_time_are_the_same() -> None:
    entry = stand(TABLE_2, tests=[{"waveform": SINE, "cycles": 3}, {"waveform": TRIANGLE, "cycles": 3}])
    rig = RigConfig(virtual=(entry, entry.model_copy(update={"setting": "other"})))
    alone, together = (synthesise(rig, 1, Control(), Path(), jobs) for jobs in (1, 3))
    assert together.entries == alone.entries
    for one, other in zip(together.records, alone.records, strict=True):
        assert one.name == other.name
        assert np.array_equal(one.force, other.force)
        assert np.array_equal(one.velocity, other.velocity)


def test_the_quickstart_is_a_stand_with_something_hidden(root: Path) -> None:
    from pzd.config import load

    (entry,) = load(root / "configs" / "quickstart.yaml").rig.virtual or ()
    assert "orifice_quadratic" in entry.damper.effects
    assert len(entry.plan()) == 20
