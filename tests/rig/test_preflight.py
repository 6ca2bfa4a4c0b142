"""The preflight says what is wrong with a record, where and how much, and is silent about a clean one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import butter, lfilter

from pzd.artefacts import Finding, RecordEntry
from pzd.damper.element import element_force
from pzd.record import Record
from pzd.rig.config import Limits
from pzd.rig.preflight import PreflightRecord, checks, findings
from pzd.rig.preflight.sense import unseen_levels
from pzd.signals.cycles import Cycles, cycles
from pzd.signals.kinematics import kinematics

Array = NDArray[np.float64]

KINDS = ("sine", "triangle", "random")
FINE = 16
NO_LIMITS = Limits()


def motion(kind: str, time: Array, rng: np.random.Generator) -> Array:
    """A displacement of 4 to 15 mm amplitude, 0.6 to 3 Hz; the triangle up to 60 Hz, random motion 0.3 to 12 Hz."""
    frequency, amplitude = rng.uniform(0.6, 3.0), rng.uniform(0.004, 0.015)
    phase = 2.0 * np.pi * (frequency * time + rng.random())
    if kind == "sine":
        return amplitude * np.sin(phase)
    if kind == "triangle":
        odd = np.arange(1, int(60.0 / frequency), 2)
        parts = [(-1.0) ** ((k - 1) // 2) / k**2 * np.sin(k * phase) for k in odd]
        return amplitude * 8.0 / np.pi**2 * np.sum(parts, axis=0)
    count = 2 * time.size
    hertz = np.fft.rfftfreq(count, time[1] - time[0])
    spectrum = rng.standard_normal(hertz.size) * np.exp(2j * np.pi * rng.random(hertz.size)) / np.maximum(hertz, 0.3)
    x = np.fft.irfft(np.where((hertz > 0.3) & (hertz < 12.0), spectrum, 0.0), count)[: time.size]
    return amplitude * x / np.abs(x).max()


def record(
    kind: str,
    rng: np.random.Generator,
    noise: float = 0.03,
    rate: float = 1000.0,
    delay: float = 0.0,
    seconds: float = 8.0,
    stroke: float | None = None,
) -> Record:
    """A Bingham element within the paper's range, force noise correlated at 0.9, displacement noise of 5 um.

    The stroke is that of `motion`, or a multiple of what the friction holds, 2 T0 / k.
    """
    time = np.arange(int(seconds * rate * FINE)) / (rate * FINE)
    x = motion(kind, time, rng)
    element = rng.uniform(100.0, 700.0), rng.uniform(1500.0, 5000.0), rng.uniform(1.5e5, 5e5)
    if stroke is not None:
        x = x * stroke * 2.0 * element[0] / element[2] / np.ptp(x)
    force = element_force(x, float(time[1]), *element)
    force = np.interp(time - delay, time, force)[::FINE]
    time, x = time[::FINE], x[::FINE] + 5e-6 * rng.standard_normal(time[::FINE].size)
    coloured = lfilter([np.sqrt(1.0 - 0.81)], [1.0, -0.9], rng.standard_normal(force.size))
    force = force + noise * np.sqrt(np.mean(force**2)) * coloured
    return Record(kind, None, time, x, x, x, force)


def found(one: Record, limits: Limits = NO_LIMITS) -> tuple[Finding, ...]:
    """Findings of a record whose velocity is derived."""
    run = cycles(one.time, one.displacement)
    clean = kinematics(one.time, one.displacement, run)
    whole = replace(one, velocity=clean.velocity, acceleration=clean.acceleration)
    return findings(PreflightRecord(whole, run, clean, limits))


def only(one: Record, check: str) -> Finding:
    """The one finding of a check."""
    (finding,) = [finding for finding in found(one) if finding.check == check]
    return finding


@pytest.mark.parametrize("kind", KINDS)
def test_clean_records_have_no_findings(kind: str, rng: np.random.Generator) -> None:
    said = [finding for _ in range(6) for finding in found(record(kind, rng))]
    assert len(said) <= 1, said


@pytest.mark.parametrize("kind", KINDS)
def test_noise_free_records_have_no_findings(kind: str, rng: np.random.Generator) -> None:
    for _ in range(3):
        assert found(record(kind, rng, noise=0.0)) == ()


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("noise", [0.0, 0.03])
def test_friction_that_never_slips_is_no_delay_no_offset_and_no_wrong_sign(
    kind: str, noise: float, rng: np.random.Generator
) -> None:
    for _ in range(3):
        one = record(kind, rng, noise=noise, stroke=rng.uniform(0.2, 0.5))
        assert not {"delay", "offset", "sign"} & {finding.check for finding in found(one)}


@pytest.mark.parametrize("kind", KINDS)
def test_an_offset_is_measured(kind: str, rng: np.random.Generator) -> None:
    # Of a random motion the damper may hardly slip, and what it holds from before hides the offset.
    one = record(kind, rng, stroke=rng.uniform(3.0, 8.0))
    offset = 0.1 * float(np.ptp(one.force))
    assert only(replace(one, force=one.force + offset), "offset").size == pytest.approx(offset, rel=0.15)


def test_a_late_force_is_measured(rng: np.random.Generator) -> None:
    # Random motion alone: at one speed a delay is the same as a softer spring.
    sizes = [
        [finding.size for finding in found(record("random", rng, noise=0.01, delay=0.008)) if finding.check == "delay"]
        for _ in range(6)
    ]
    assert sum(len(size) for size in sizes) >= 4
    assert np.median(np.concatenate(sizes)) == pytest.approx(0.008, abs=0.0015)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("channel", ["force", "displacement"])
def test_spikes_are_counted_and_placed(kind: str, channel: str, rng: np.random.Generator) -> None:
    one = record(kind, rng)
    values = getattr(one, channel).copy()
    rows = np.sort(rng.choice(np.arange(100, 7000, 50), 3, replace=False))
    values[rows] += np.array([1.0, -1.2, 1.5]) * 0.3 * np.ptp(values)
    finding = only(replace(one, **{channel: values}), "spikes")
    assert f"{channel}, 3 samples" in finding.where
    assert f"{one.time[rows[2]]:.6g} s" in finding.where


@pytest.mark.parametrize("kind", KINDS)
def test_a_force_cut_off_at_its_range_is_seen(kind: str, rng: np.random.Generator) -> None:
    one = record(kind, rng, noise=0.003)
    for sign in (1.0, -1.0):
        top = 0.7 * float(np.percentile(np.abs(one.force), 99.0))
        clipped = np.minimum(sign * one.force, top) * sign
        finding = only(replace(one, force=clipped), "saturation")
        assert finding.size == pytest.approx(np.mean(sign * one.force >= top), rel=0.3)


def test_a_digitised_peak_is_no_saturation(rng: np.random.Generator) -> None:
    for kind in KINDS:
        one = record(kind, rng, noise=0.0)
        digits = np.ptp(one.force) / 4096
        coarse = replace(one, force=np.round(one.force / digits) * digits, displacement=np.round(one.displacement, 5))
        assert [finding.check for finding in found(coarse)] == []


def test_hum_of_the_mains_is_measured(rng: np.random.Generator) -> None:
    ratios = []
    for kind in KINDS:
        for mains in (50.0, 60.0):
            one = record(kind, rng)
            hum = 0.05 * np.abs(one.force).max()
            shown = replace(one, force=one.force + hum * np.sin(2.0 * np.pi * (mains + 0.03) * one.time))
            ratios += [finding.size / hum for finding in found(shown) if finding.check == "hum"]
    # A harmonic of the motion may lie on the line and hide it, rarely.
    assert len(ratios) >= 5
    assert np.median(ratios) == pytest.approx(1.0, abs=0.1)


def test_lost_samples_are_counted(rng: np.random.Generator) -> None:
    for kind in KINDS:
        one = record(kind, rng)
        kept = np.delete(np.arange(one.time.size), [*range(3000, 3010), 5000])
        channels = {name: getattr(one, name)[kept] for name in ("time", "displacement", "force")}
        finding = only(replace(one, **channels), "dropped samples")
        assert finding.size == 11.0
        assert "2 gaps, the first after 2.999 s" in finding.where


def test_an_unsteady_clock_is_measured(rng: np.random.Generator) -> None:
    one = record("sine", rng)
    shaken = one.time + 1e-4 * rng.uniform(-1.0, 1.0, one.time.size)
    assert only(replace(one, time=shaken), "sampling").size == pytest.approx(1e-4 * np.sqrt(2.0 / 3.0) * 1e3, rel=0.1)


def test_few_samples_and_few_cycles_are_reported(rng: np.random.Generator) -> None:
    slow = record("sine", rng, rate=20.0, seconds=30.0)  # 33 samples a cycle at most: the sine is at 0.6 Hz or more
    assert only(slow, "sampling").unit == "samples a cycle"
    one = record("sine", rng)
    period = cycles(one.time, one.displacement).period  # type: ignore[union-attr] # a sine has cycles
    rows = slice(0, int(2.2 * period * 1000.0))
    short = replace(one, time=one.time[rows], displacement=one.displacement[rows], force=one.force[rows])
    assert only(short, "cycles").size == pytest.approx(2.2, abs=0.5)


def test_a_velocity_at_odds_with_the_displacement_is_reported(rng: np.random.Generator) -> None:
    for kind in KINDS:
        one = record(kind, rng)
        run = cycles(one.time, one.displacement)
        clean = kinematics(one.time, one.displacement, run)
        for factor in (1e3, -1.0, 1.1):
            whole = replace(one, velocity=factor * clean.velocity)
            (finding,) = checks()["recorded_velocity"](PreflightRecord(whole, run, clean, Limits()))
            assert finding.size == pytest.approx(factor, rel=0.01)
        late = replace(one, velocity=np.roll(clean.velocity, int(0.05 * 1000 / 2.0)))
        assert list(checks()["recorded_velocity"](PreflightRecord(late, run, clean, Limits())))
        noisy = replace(one, velocity=clean.velocity + 0.02 * clean.velocity.std() * rng.standard_normal(one.time.size))
        assert not list(checks()["recorded_velocity"](PreflightRecord(noisy, run, clean, Limits())))


def test_units_off_by_a_thousand_are_suspected(rng: np.random.Generator) -> None:
    one = record("sine", rng)
    small = [finding.where for finding in found(replace(one, displacement=1e-3 * one.displacement))]
    assert "stroke of the whole record" in small
    assert only(replace(one, force=1e-3 * one.force), "scale").unit == "N"
    assert only(replace(one, time=1e3 * one.time), "scale").unit == "m/s"


def test_limits_of_the_stand_and_rest_are_reported(rng: np.random.Generator) -> None:
    one = record("sine", rng)
    limits = Limits(stroke_m=1e-3, speed_m_per_s=1e-3, force_N=10.0, frequency_Hz=0.1)
    assert len([finding for finding in found(one, limits) if finding.check == "reach"]) == 4
    rest = np.arange(1, 3001) * 1e-3
    still = replace(
        one,
        time=np.concatenate((one.time, one.time[-1] + rest)),
        displacement=np.concatenate((one.displacement, np.full(3000, one.displacement[-1]))),
        force=np.concatenate((one.force, np.full(3000, one.force[-1]))),
    )
    assert only(still, "rest").size == pytest.approx(3.0 / 11.0, abs=0.05)


def test_a_cycle_that_feeds_energy_in_is_named(rng: np.random.Generator) -> None:
    one = record("sine", rng)
    run = cycles(one.time, one.displacement)
    assert run is not None
    flipped = np.where(run.number(one.time) == 2, -one.force, one.force)
    finding = only(replace(one, force=flipped), "sign")
    assert finding.size < 0.0
    assert finding.where.startswith(f"1 of {run.count} cycles")


def test_noise_of_a_small_stroke_feeds_no_energy_in_wherever_its_cycles_are_cut(rng: np.random.Generator) -> None:
    # 5 um of noise on 0.07 mm keeps the ends of a cycle apart by more than the work that is said, if it is not closed.
    time = np.arange(20_000) / 1000.0
    x = 3.5e-5 * np.sin(2.0 * np.pi * 1.3 * time)
    one = Record("small", None, time, x + 5e-6 * rng.standard_normal(x.size), x, x, 2e5 * x)
    clean = kinematics(one.time, one.displacement, None)
    for share in np.linspace(0.0, 0.9, 10):
        run = Cycles(start=share / 1.3, period=1.0 / 1.3, count=25)
        assert list(checks()["sign"](PreflightRecord(one, run, clean, NO_LIMITS))) == []


def two_tests(one: Record) -> Record:
    """A record that goes on with half the amplitude."""
    time = np.concatenate((one.time, one.time + one.time[-1] + one.time[1]))
    x = np.concatenate((one.displacement, 0.5 * one.displacement))
    return replace(one, time=time, displacement=x, force=np.tile(one.force, 2))


FAULTS: dict[str, Callable[[Record], Record]] = {
    "amplifier": lambda one: replace(one, force=lfilter(*butter(2, 6.0, fs=1000.0), one.force)),
    "cycle_count": lambda one: cut(one, 2.2),
    "delay": lambda one: replace(one, force=np.roll(one.force, 12)),
    "drift": lambda one: replace(one, force=one.force + np.linspace(0.0, 0.2, one.time.size) * np.ptp(one.force)),
    "dropouts": lambda one: replace(one, force=np.where(np.arange(one.time.size) % 700 == 5, 0.0, one.force + 900.0)),
    "fade": lambda one: replace(one, force=one.force * np.exp(-0.3 * one.time / one.time[-1])),
    "gain_step": lambda one: replace(one, force=one.force * np.where(one.time > 0.5 * one.time[-1], 1.1, 1.0)),
    "held_channel": lambda one: replace(one, force=one.force[np.arange(one.time.size) // 10 * 10]),
    "hum": lambda one: replace(one, force=one.force + 0.1 * np.ptp(one.force) * np.sin(100.0 * np.pi * one.time)),
    "jumps": lambda one: replace(
        one, displacement=np.where(np.arange(one.time.size) < 4000, 0.0, 0.02) + one.displacement
    ),
    "offset": lambda one: replace(one, force=one.force + 0.2 * np.ptp(one.force)),
    "quantisation": lambda one: replace(one, displacement=2e-4 * np.rint(one.displacement / 2e-4)),
    "reach": lambda one: one,  # the limits of the stand are what changes
    "recorded_velocity": lambda one: one,  # and here the velocity
    "resolution": lambda one: replace(
        one, displacement=one.displacement + 0.02 * np.ptp(one.displacement) * np.cos(np.pi * np.arange(one.time.size))
    ),
    "sampling": lambda one: without(one, slice(3000, 3010)),
    "saturation": lambda one: replace(one, force=np.minimum(one.force, 0.5 * one.force.max())),
    "scale": lambda one: replace(one, force=1e-4 * one.force),
    "sign": lambda one: replace(one, force=-one.force),
    "steps": two_tests,
    "spikes": lambda one: replace(one, force=one.force + 3.0 * np.ptp(one.force) * (np.arange(one.time.size) == 4000)),
}
"""What each check looks for, done to a clean record."""


def cut(one: Record, count: float) -> Record:
    """So many cycles of a record."""
    run = cycles(one.time, one.displacement)
    assert run is not None
    return without(one, slice(int(count * run.period * 1000.0), None))


def without(one: Record, rows: slice) -> Record:
    """A record that lacks some samples."""
    names = ("time", "displacement", "force")
    return replace(one, **{name: np.delete(getattr(one, name), rows) for name in names})


@pytest.mark.parametrize("name", checks())
def test_every_check_finds_its_fault_and_says_what_follows(name: str, rng: np.random.Generator) -> None:
    kind = "random" if name == "delay" else "sine"  # at one speed a delay is the same as a softer spring
    one = FAULTS[name](record(kind, rng, noise=0.003, stroke=5.0))
    run = cycles(one.time, one.displacement)
    clean = kinematics(one.time, one.displacement, run)
    velocity = 1e3 * clean.velocity if name == "recorded_velocity" else clean.velocity
    limits = Limits(stroke_m=1e-3, force_N=10.0) if name == "reach" else NO_LIMITS
    said = list(checks()[name](PreflightRecord(replace(one, velocity=velocity), run, clean, limits)))
    assert said
    for finding in said:
        assert finding.where
        assert len(finding.follows.split()) > 5
        assert finding.follows not in finding.where


@pytest.mark.parametrize("rate", [500.0, 512.0, 1024.0])
def test_a_coarse_clock_leaves_the_sampling_rate_as_it_is(rate: float, rng: np.random.Generator) -> None:
    """Time stamps of four digits: at 512 Hz every second or third step is 1.9 ms, and the median 2 ms."""
    one = record(KINDS[0], rng)
    time = np.arange(one.time.size) / rate
    time[time.size // 2 :] += 3.0  # and a gap, which says nothing of the rate
    assert replace(one, time=np.round(time, 4)).rate == pytest.approx(rate, rel=1e-4)


def entries_of(**forces: tuple[float, float, float | None]) -> tuple[RecordEntry, ...]:
    """Entries by name: force [N], displacement [m] and voltage [V]; every motion at one frequency."""
    return tuple(
        RecordEntry(
            name=name, setting=None, voltage_V=voltage, temperature_degC=None, rate_Hz=500.0, cycles=8.0,
            displacement_rms_m=x, velocity_rms_m_per_s=6.0 * x, acceleration_rms_m_per_s2=36.0 * x,
            force_rms_N=force, force_peak_N=1.5 * force, work_J=1.0, findings=(),
        )
        for name, (force, x, voltage) in forces.items()
    )  # fmt: skip


@pytest.mark.parametrize("volts", [(None, None), (None, 10.0)])
def test_a_force_much_larger_than_in_the_same_motion_is_that_of_another_level(volts: tuple[float | None, ...]) -> None:
    found = unseen_levels(entries_of(a=(400.0, 0.01, volts[0]), b=(800.0, 0.01, volts[1]), c=(900.0, 0.02, volts[1])))
    assert [[finding.check for finding in entry.findings] for entry in found] == [[], ["level"], []]
    assert "where a has 400 N in the same motion" in found[1].findings[0].where


def test_levels_that_are_recorded_other_motions_and_a_damper_that_warms_are_no_unseen_level() -> None:
    known = entries_of(a=(400.0, 0.01, 0.0), b=(800.0, 0.01, 10.0), c=(800.0, 0.02, 0.0), d=(480.0, 0.01, 0.0))
    assert unseen_levels(known) == known
