"""The next test stays within the operating envelope, and separates rivals or tests between voltages."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from synthetic import campaign_of, damper_of, sines

from pzd.artefacts import NextTest
from pzd.damper.compose import respond
from pzd.damper.model import BaseRow, Damper
from pzd.damper.motion import Motion
from pzd.diagnosis.cleaned_records import CleanedRecord, clean
from pzd.diagnosis.cross_validation import cross_validation_of
from pzd.diagnosis.next_test import (
    RECORDED_ERROR,
    STROKES,
    OperatingEnvelope,
    intermediate_voltage_test,
    operating_envelope,
    repeated_longest_test,
    rounded_down,
    separating_test,
)
from pzd.record import Array, Record
from pzd.rig.config import Limits

SOFT = Damper(base=(BaseRow(T0_N=1.0, C_Ns_per_m=10.0, k_N_per_m=1e5),))
"""Nearly nothing beside what its effects give."""
MASS = 100.0
ALIKE_AT_1_HZ = MASS * (2.0 * np.pi) ** 2
RIVALS = (
    ("gas_spring", SOFT.with_effect("gas_spring", {"k_g": ALIKE_AT_1_HZ})),
    ("fluid_inertia", SOFT.with_effect("fluid_inertia", {"m": -MASS})),
)
ANY_FORCE = (-np.inf, np.inf)


def peak_acceleration(waveform: str, frequency: float, amplitude: float) -> float:
    """Closed form [m/s2]: a triangle of odd harmonics h up to the ninth, each 8/(pi h)^2, has five of equal share."""
    share = 1.0 if waveform == "sine" else 5.0 * 8.0 / np.pi**2
    return share * amplitude * (2.0 * np.pi * frequency) ** 2


def proposed(envelope: OperatingEnvelope) -> tuple[NextTest, float, float, float] | None:
    """The test, and its frequency, amplitude and middle."""
    found = separating_test(RIVALS, envelope, None)
    if found is None:
        return None
    assert found.frequency_Hz is not None
    assert found.amplitude_m is not None
    assert found.middle_m is not None
    return found, found.frequency_Hz, found.amplitude_m, found.middle_m


def test_the_test_is_within_stroke_speed_frequency_and_force(rng: np.random.Generator) -> None:
    for draw in rng.spawn(12):
        force = 10.0 ** draw.uniform(2, 5)
        envelope = OperatingEnvelope(
            0.0, draw.uniform(0.01, 0.06), draw.uniform(0.1, 1.0), draw.uniform(2.5, 30.0), (-force, force)
        )
        found = proposed(envelope)
        if found is None:
            continue  # nothing that the stand can do stays below its force
        told, f, amplitude, _ = found
        assert amplitude <= envelope.amplitude
        assert 2.0 * np.pi * f * amplitude <= envelope.speed
        assert f <= envelope.frequency
        friction = 1.0 + 10.0 * envelope.speed
        assert MASS * peak_acceleration(told.waveform, f, amplitude) <= 1.02 * force + friction
        assert ALIKE_AT_1_HZ * amplitude <= 1.02 * force + friction


def test_a_spring_and_a_mass_that_are_alike_on_one_frequency_are_told_apart_at_another_frequency() -> None:
    told = separating_test(RIVALS, OperatingEnvelope(0.0, 0.05, 0.6, 20.0, ANY_FORCE), None)
    assert told is not None
    assert told.frequency_Hz != pytest.approx(1.0)
    assert told.separates == ("gas_spring", "fluid_inertia")
    assert told.distance_percent is not None
    assert told.distance_percent > 20.0


def test_nothing_is_proposed_where_every_test_exceeds_the_force() -> None:
    assert separating_test(RIVALS, OperatingEnvelope(0.0, 0.05, 0.6, 20.0, (-0.5, 0.5)), None) is None


def sine(frequency: float, amplitude: float, middle: float = 0.0, force: Callable[[Array, Array], Array] | None = None,
         voltage: float | None = None) -> Record:  # fmt: skip
    """Six cycles about a middle; the force, by displacement about the middle and velocity, is 8000 N a m/s."""
    time = np.arange(600) / (100.0 * frequency)
    phase = 2.0 * np.pi * frequency * time
    x, v = amplitude * np.sin(phase), 2.0 * np.pi * frequency * amplitude * np.cos(phase)
    felt = None if voltage is None else np.full(time.size, voltage)
    return Record(
        f"{frequency:g} Hz", None, time, middle + x, v, -((2.0 * np.pi * frequency) ** 2) * x,
        8000.0 * v if force is None else force(x, v), felt,
    )  # fmt: skip


def extremes(cleaned: tuple[CleanedRecord, ...], channel: str) -> tuple[float, float]:
    values = [getattr(p.record, channel) for p in cleaned]
    return min(float(v.min()) for v in values), max(float(v.max()) for v in values)


def moved(told: NextTest) -> Motion:
    """The motion of a test, drawn again from what it says; a triangle with the harmonics that a servo makes of it."""
    assert told.frequency_Hz is not None
    assert told.amplitude_m is not None
    assert told.middle_m is not None
    time = np.arange(4000) / (2000.0 * told.frequency_Hz)
    orders, shares = np.array([1]), np.array([1.0])
    if told.waveform == "triangle":
        orders = np.arange(1, 10, 2)
        shares = 8.0 / np.pi**2 * (-1.0) ** (orders // 2) / orders**2
    rate = 2.0 * np.pi * told.frequency_Hz * orders
    phase = np.outer(time, rate)
    x, v, a = (
        told.amplitude_m * part @ shares for part in (np.sin(phase), np.cos(phase) * rate, -np.sin(phase) * rate**2)
    )
    return Motion(time, told.middle_m + x, v, a)


def test_a_damper_measured_off_zero_is_moved_within_its_stroke() -> None:
    """12.7 to 50 mm were recorded: 37.3 mm of stroke, not 100."""
    cleaned = clean((sine(2.0, 0.01865, 0.03135), sine(1.0, 0.01, 0.03135)))
    envelope = operating_envelope(Limits(), cleaned, ())
    assert envelope.middle == pytest.approx(0.03135, abs=2e-5)
    assert envelope.amplitude == pytest.approx(0.01865, abs=2e-5)
    assert envelope.frequency == pytest.approx(2.0, rel=1.1e-3)
    assert envelope.voltages == ()
    found = proposed(envelope)
    assert found is not None
    assert found[3] - found[2] >= 0.0127 - 1e-5
    assert found[3] + found[2] <= 0.05 + 1e-5


def test_a_proposed_motion_never_leaves_the_recorded_stroke_speed_and_force(rng: np.random.Generator) -> None:
    proposals = 0
    for draw in rng.spawn(20):
        middle = draw.uniform(-0.1, 0.1)
        # What the rivals give at 1 Hz, with room or without.
        size = 10.0 ** draw.uniform(-0.5, 0.5)
        records = tuple(
            sine(draw.uniform(0.3, 3.0), draw.uniform(0.002, 0.06), middle + draw.uniform(-0.01, 0.01),
                 lambda x, v: size * (ALIKE_AT_1_HZ * x + 10.0 * v))  # noqa: B023  # used inside the turn
            for _ in range(3)
        )  # fmt: skip
        cleaned = clean(records)
        told = separating_test(RIVALS, operating_envelope(Limits(), cleaned, ()), None, (-ALIKE_AT_1_HZ * middle, 0.0))
        if told is None:
            continue
        proposals += 1
        motion = moved(told)
        lowest, highest = extremes(cleaned, "displacement")
        room = RECORDED_ERROR * (highest - lowest)
        assert lowest - room <= motion.displacement.min(), records
        assert motion.displacement.max() <= highest + room, records
        speed = float(np.max(np.abs(motion.velocity)))
        assert speed <= (1.0 + RECORDED_ERROR) * max(map(abs, extremes(cleaned, "velocity"))), records
        assert told.peak_speed_m_per_s == pytest.approx(speed, rel=1e-3)
        low, high = extremes(cleaned, "force")
        for (_, damper), offset in zip(RIVALS, (-ALIKE_AT_1_HZ * middle, 0.0), strict=True):
            force = respond(damper, motion)[2000:] + offset
            scratch = 1e-3 * (high - low)  # of the sampling
            assert low - scratch <= force.min(), records
            assert force.max() <= high + scratch, records
        assert told.peak_force_N is not None
        assert told.peak_force_N <= max(-low, high)
    assert proposals >= 15


def test_the_zero_of_the_displacement_moves_the_middle_of_the_test_and_nothing_else() -> None:
    told = []
    for shift in (0.0, 0.05, -0.1):
        cleaned = clean((sine(2.0, 0.0183, shift), sine(0.7, 0.03, shift + 0.003)))
        found = separating_test(RIVALS, operating_envelope(Limits(), cleaned, ()), None, (-ALIKE_AT_1_HZ * shift, 0.0))
        assert found is not None
        assert found.middle_m == pytest.approx(shift + 0.003, abs=2e-5)
        told.append(found.model_copy(update={"middle_m": None, "peak_force_N": None, "peak_speed_m_per_s": None}))
    assert told[1:] == told[:1] * 2


def test_limits_rule_where_they_are_given_a_stroke_about_the_recorded_middle() -> None:
    cleaned = clean((sine(2.0, 0.01, 0.03, voltage=0.0), sine(2.0, 0.01, 0.03, voltage=100.0)))
    assert operating_envelope(Limits(), cleaned, (0.0, 100.0, 150.0)).voltages == pytest.approx((0.0, 100.0))
    wide = Limits(stroke_m=0.1, speed_m_per_s=3.0, force_N=5e4, frequency_Hz=20.0, voltage_V=(-10.0, 200.0))
    envelope = operating_envelope(wide, cleaned, (0.0, 150.0))
    assert replace(envelope, middle=0.0) == OperatingEnvelope(0.0, 0.05, 3.0, 20.0, (-5e4, 5e4), (0.0, 150.0))
    assert envelope.middle == pytest.approx(0.03, abs=1e-4)
    assert operating_envelope(Limits(stroke_m=0.004), cleaned, ()).amplitude == pytest.approx(0.002)


def test_an_amplitude_is_rounded_down_and_never_beyond() -> None:
    for amplitude in (0.0186549, 0.018659, 0.02, 0.0199999, 0.1 - 0.06, 0.03 - 0.01):
        found = proposed(OperatingEnvelope(0.0, amplitude, 10.0, 1.3, ANY_FORCE))
        assert found is not None
        left = [1.0 - found[2] / (share * amplitude) for share in STROKES]
        assert any(-1e-11 <= each < 0.01 for each in left), amplitude


def test_a_round_amplitude_stays_what_it_is_whatever_the_last_bit_of_a_difference() -> None:
    for amplitude in (0.02, 0.1 - 0.08, 0.03 - 0.01, 0.0199999999999999):
        found = proposed(OperatingEnvelope(0.0, amplitude, 10.0, 1.3, ANY_FORCE))
        assert found is not None
        assert found[2] in (0.003, 0.006, 0.012, 0.02)


@pytest.mark.parametrize("samples", [100, 133, 256])
def test_a_recorded_sine_of_round_stroke_and_frequency_is_proposed_as_it_is(samples: int) -> None:
    """Sampled off its peaks, a sine of 10 mm reaches a little less."""
    time = (np.arange(6 * samples) + 0.31) / (2.0 * samples)
    x = 0.01 * np.sin(4.0 * np.pi * time)
    v = 0.01 * 4.0 * np.pi * np.cos(4.0 * np.pi * time)
    record = Record("r", None, time, x, v, -((4.0 * np.pi) ** 2) * x, 900.0 * v)
    assert 0.5 * np.ptp(x) < 0.01
    envelope = operating_envelope(Limits(), clean([record]), ())
    assert (rounded_down(envelope.amplitude), rounded_down(envelope.frequency)) == (0.01, 2.0)
    assert 0.01 * 4.0 * np.pi <= envelope.speed <= 0.01 * 4.0 * np.pi * 1.005
    limited = operating_envelope(Limits(stroke_m=0.01998, speed_m_per_s=0.1, frequency_Hz=1.999), clean([record]), ())
    assert (limited.amplitude, limited.speed, limited.frequency) == (0.00999, 0.1, 1.999)


# --- Test at a voltage between two tested ones


THREE = (0.0, 50.0, 150.0)
TESTS = ((0.5, 0.02), (2.0, 0.03))
LIMITS = Limits()


def with_friction_at_50(T0: float) -> Damper:
    """T0 is 301 N at 0 V and 1325 N at 150 V; C and k are on the line between both."""
    low, middle, high = damper_of(THREE).base
    on_line = {
        name: (2.0 * getattr(low, name) + getattr(high, name)) / 3.0 for name in ("C_Ns_per_m", "k_N_per_m", "T0_N")
    }
    rows = (low, middle.model_copy(update={**on_line, "T0_N": T0}), high)
    return Damper(base=rows)


ON_THE_LINE = (2.0 * 301.0 + 1325.0) / 3.0


def asked(damper: Damper, rng: np.random.Generator, limits: Limits = LIMITS) -> NextTest | None:
    records = sines(damper, rng, [row.voltage_V or 0.0 for row in damper.base], tests=TESTS, cycles=4)
    campaign = campaign_of(records)
    validation = cross_validation_of(campaign, damper, 0.0025)
    errors = validation.baseline_error(), validation.baseline_interpolation_error
    envelope = operating_envelope(limits, campaign.cleaned, [row.voltage_V or 0.0 for row in damper.base])
    return intermediate_voltage_test(damper, 0.0, errors, validation, campaign.cleaned, envelope, None)


@pytest.mark.parametrize("T0", [0.6 * ON_THE_LINE, 1.5 * ON_THE_LINE])
def test_a_test_is_proposed_half_way_along_the_wider_step(T0: float, rng: np.random.Generator) -> None:
    found = asked(with_friction_at_50(T0), rng)
    assert found is not None
    assert found.between_voltage_V == (50.0, 150.0)
    assert found.voltage_V == 100.0
    assert any((found.frequency_Hz, found.amplitude_m) == pytest.approx(test, rel=0.01) for test in TESTS)
    assert found.separates == ()


def test_linear_parameters_need_no_test_between_voltages(rng: np.random.Generator) -> None:
    assert asked(with_friction_at_50(ON_THE_LINE), rng) is None


def test_without_a_voltage_between_two_others_no_test_is_proposed(rng: np.random.Generator) -> None:
    assert asked(damper_of((0.0, 150.0)), rng) is None


@pytest.mark.parametrize(
    "limits", [Limits(voltage_V=(0.0, 90.0)), Limits(force_N=500.0)], ids=["the voltage", "the force"]
)
def test_no_test_beyond_the_limits_of_the_stand_is_proposed(limits: Limits, rng: np.random.Generator) -> None:
    assert asked(with_friction_at_50(1.5 * ON_THE_LINE), rng, limits) is None


def test_stroke_and_speed_stay_within_the_limits_of_the_stand(rng: np.random.Generator) -> None:
    found = asked(with_friction_at_50(1.5 * ON_THE_LINE), rng, Limits(stroke_m=0.02, speed_m_per_s=0.05))
    assert found is not None
    assert found.amplitude_m == pytest.approx(0.01)
    assert found.peak_speed_m_per_s is not None
    assert found.peak_speed_m_per_s <= 0.05


def test_one_more_test_is_another_than_was_run(rng: np.random.Generator) -> None:
    damper, tests = damper_of(THREE), ((0.5, 0.02), (1.0, 0.01))
    records = sines(damper, rng, THREE, tests=tests, cycles=4)
    envelope = operating_envelope(LIMITS, clean(records), THREE)
    asked = []
    while (plan := repeated_longest_test(clean(records), envelope)) is not None:
        asked.append((plan.frequency_Hz, plan.amplitude_m, plan.voltage_V))
        assert isinstance(plan.voltage_V, float)
        assert plan.frequency_Hz is not None
        assert plan.amplitude_m is not None
        run = sines(damper, rng, (plan.voltage_V,), tests=((plan.frequency_Hz, plan.amplitude_m),), cycles=12)
        records = (*records, *run)
    assert len({*asked}) == len(asked) == len(THREE) * len(tests)


def test_a_test_at_rest_is_no_stroke_to_repeat(rng: np.random.Generator) -> None:
    records = sines(damper_of(THREE), rng, THREE, tests=((0.5, 0.02),), cycles=4)
    rest = replace(records[0], name="rest", time=20.0 * records[0].time, displacement=1e-4 * records[0].displacement)
    tests = clean((rest, *records))
    plan = repeated_longest_test(tests, operating_envelope(LIMITS, tests, THREE))
    assert plan is not None
    assert plan.amplitude_m == pytest.approx(0.02, rel=0.1)


def test_a_lag_beside_a_hysteresis_asks_for_a_control_signal_that_steps(rng: np.random.Generator) -> None:
    records = clean(sines(damper_of(THREE), rng, THREE, tests=((0.5, 0.02),), cycles=4))
    envelope, names = operating_envelope(LIMITS, records, THREE), ("valve_lag", "piezo_hysteresis")
    plan = repeated_longest_test(records, envelope, names)
    assert plan is not None
    assert (plan.waveform, plan.voltage_V, plan.separates) == ("sine, voltage stepped", (THREE[0], THREE[-1]), names)
    alone = repeated_longest_test(records, replace(envelope, voltages=()), names)
    assert alone is not None
    assert alone.waveform == "sine, ten cycles"
