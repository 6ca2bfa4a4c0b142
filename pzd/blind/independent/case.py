"""Draws a case: a damper, laws hidden in it, a campaign of tests, and what the data logger records of them.

A hidden law is as strong as leaves a drawn visible gap, which is measured here with the generator's own integrator.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.random import Generator, SeedSequence, default_rng

from pzd.blind.independent import stand
from pzd.blind.independent.damper_space import elastic_levels
from pzd.blind.independent.kernel import BinghamTable, Parameters, integrated
from pzd.blind.independent.laws import LAWS, Scale, delayed_force, drift_factor, lagged_signal, signal_with_play
from pzd.blind.independent.outside import OUTSIDE
from pzd.blind.independent.stand import Actuator, Chain, Driven, ErrorsOfTest, LaboratoryCampaign
from pzd.record import SAME_TEMPERATURE, Array

GAPS = (0.008, 0.05)
"""Smallest and largest visible gap that a hidden law is drawn to leave, as a share of the peak."""
TRIALS = 5
"""Of the strength of a law, until its gap is near enough to the drawn one."""
OTHER_DAMPING = 0.7
"""Where force over speed asks for another damping by so much [logarithm], the refit starts there too.

Reason: a factor of two. Behind a relief valve that is always open it is C_r, far from C, and the search stays at C."""

HiddenLaws = Mapping[str, Mapping[str, float]]
"""Parameters by the names of the laws that are hidden."""


@dataclass(frozen=True, eq=False)
class LoggedTest:
    """One test: what the logger has of it, and the truth behind it; every array is (n,), in SI and degC."""

    time: Array
    displacement: Array
    force: Array
    signal: Array | None
    temperature: Array | None
    true_displacement: Array
    true_velocity: Array
    true_acceleration: Array
    true_signal: Array
    true_temperature: Array | None
    true_force: Array


@dataclass(frozen=True, eq=False)
class IndependentCase:
    """A case and its truth."""

    campaign: LaboratoryCampaign
    base: BinghamTable
    laws: HiddenLaws
    tests: tuple[LoggedTest, ...]
    chain: Chain
    reference_temperature: float | None
    """Of the material laws [degC]; None without one."""
    visible_gap: float
    """R.m.s. residual of the best T0, C and k, as a share of the peak."""
    gap_given_other: Mapping[str, float]
    """Of a pair, by the name of each law: visible gap that it leaves where the other one is known."""


# --- The damper with its hidden laws ---


@dataclass(frozen=True)
class HiddenDamper:
    """A damper with what is hidden in it."""

    base: BinghamTable
    laws: HiddenLaws
    start: float
    """Reference temperature [degC]."""

    def force(self, motion: Driven, temperature: Array | None) -> Array:
        """Return the force at every second instant of the fine grid [N], as recorded by a channel that may be late."""
        signal, step = motion.signal, float(motion.time[1] - motion.time[0])
        if "valve_lag" in self.laws:
            signal = lagged_signal(signal, step, self.laws["valve_lag"]["tau"])
        if "piezo_hysteresis" in self.laws:
            signal = signal_with_play(signal, self.laws["piezo_hysteresis"]["r"])
        T0, C, k = self.base.at(signal)
        if "temperature_drift" in self.laws and temperature is not None:
            betas = self.laws["temperature_drift"]
            T0 = T0 * drift_factor(temperature, self.start, betas["beta_T0"])
            C = C * drift_factor(temperature, self.start, betas["beta_C"])
        force = integrated(motion.time, motion.kinematics, (T0, C, k), integrated_parameters(self.laws))
        if "sensor_delay" in self.laws:
            force = delayed_force(motion.time[::2], force, self.laws["sensor_delay"]["tau"])
        return force

    def heated_forces(
        self, motions: Sequence[Driven], rise: float, drifts: bool
    ) -> tuple[list[Array], list[float] | None]:
        """Return the force in every test [N], and its median temperature [degC] where that matters.

        Parameters
        ----------
        motions : every test
        rise : by which the work of all tests warms the damper [K]
        drifts : whether a material law makes the temperature matter
        """
        forces = [self.force(m, None) for m in motions]
        if not drifts:
            return forces, None
        temperatures = stand.warmed(motions, forces, self.start, _heat_capacity(motions, forces, rise))
        medians = [float(np.median(t[m.time >= 0.0])) for m, t in zip(motions, temperatures, strict=True)]
        return [self.force(m, t) for m, t in zip(motions, temperatures, strict=True)], medians


def integrated_parameters(laws: HiddenLaws) -> Parameters:
    """Return the parameters that the integration needs; drive, material and sensor act before and after it."""
    return Parameters(**{key: v for law in laws.values() for key, v in law.items() if key in Parameters._fields})


def _heat_capacity(motions: Sequence[Driven], forces: Sequence[Array], rise: float) -> float:
    """Return the heat capacity at which the work of all tests warms the damper by so many kelvin [J/K]."""
    work = sum(
        float(np.sum(np.clip(f * m.velocity[::2], 0.0, None)) * (m.time[2] - m.time[0]))
        for m, f in zip(motions, forces, strict=True)
    )
    return work / rise


# --- The case ---


STEPS_OF_SPRING = 8.0
"""Least steps of the integration in C/k, which laws of the flow shorten."""
FINEST = 4.0
"""Most steps in place of one of the longest: what is stiffer than these follow is not drawn with a law hidden in it."""


def driven_tests(run: LaboratoryCampaign, actuator: Actuator, phases: int, *, coarse: bool = False) -> list[Driven]:
    """Return the motion of every test of a campaign.

    Parameters
    ----------
    run : the campaign
    actuator : how demands are followed
    phases : seed of the phases of tones and random motions
    coarse : steps four times as long, for a first look
    """
    return [stand.driven(run, t, actuator, default_rng([phases, i]), coarse) for i, t in enumerate(run.tests)]


def drawn_base(
    run: LaboratoryCampaign, actuator: Actuator, phases: int, rng: Generator
) -> tuple[BinghamTable, LaboratoryCampaign]:
    """Draw T0, C and k for the motions of a campaign, and return it with steps that follow them.

    Parameters
    ----------
    run : the campaign
    actuator : how demands are followed
    phases : seed of the phases of tones and random motions
    rng : of the damper
    """
    motions = driven_tests(run, actuator, phases, coarse=True)
    speed = max(float(np.max(np.abs(m.velocity))) for m in motions)
    stroke = min(float(np.ptp(m.displacement)) for m in motions)
    rows = elastic_levels(rng, len(run.values), speed, stroke, STEPS_OF_SPRING * run.step / FINEST)
    step = min(run.step, float(np.min(rows[:, 1] / rows[:, 2])) / STEPS_OF_SPRING)
    T0, C, k = (tuple(float(v) for v in row) for row in rows.T)
    return BinghamTable(run.values, T0, C, k), replace(run, step=step)


LEAST_DRIFT_RISE = 4.0
"""A damper whose drift is hidden warms by at least so much [K], or the drift could not be seen."""


def drawn_case(seed: int, index: int, campaign_name: str, hidden: Sequence[str]) -> IndependentCase:
    """Draw a case.

    Parameters
    ----------
    seed : of the benchmark
    index : of the case; with the seed it fixes every draw
    campaign_name : what the stand runs
    hidden : names of laws
    """
    rng = default_rng(SeedSequence(seed, spawn_key=(index, 2)))
    run = stand.campaign(campaign_name, rng)
    actuator = Actuator.drawn(rng)
    phases = int(rng.integers(1 << 31))
    base, run = drawn_base(run, actuator, phases, rng)
    fine, coarse = (driven_tests(run, actuator, phases, coarse=rough) for rough in (False, True))
    start, rise = float(rng.uniform(18.0, 26.0)), float(np.exp(rng.uniform(np.log(0.5), np.log(8.0))))
    drifts = "temperature_drift" in hidden
    heated = drifts or rng.random() < 0.3
    rise = max(rise, LEAST_DRIFT_RISE) if drifts else rise
    baseline = HiddenDamper(base, {}, start)
    scale = _scale(run, base, coarse, [baseline.force(m, None) for m in coarse])
    damper = HiddenDamper(base, _sized_laws(hidden, baseline, coarse, scale, rise, rng), start)
    temperatures: list[Array] | list[None] = [None] * len(fine)
    if heated:
        unheated = [damper.force(m, None) for m in fine]
        temperatures = stand.warmed(fine, unheated, start, _heat_capacity(fine, unheated, rise))
    forces = [damper.force(m, t) for m, t in zip(fine, temperatures, strict=True)]
    peak = max(float(np.max(np.abs(f))) for f in forces)
    chain = Chain.drawn(rng, peak, scale.stroke, run.rate)
    logged = tuple(
        _logged(m, f, t, chain, peak, base.values, rng) for m, f, t in zip(fine, forces, temperatures, strict=True)
    )
    coarse_forces, medians = damper.heated_forces(coarse, rise, drifts)
    return IndependentCase(
        campaign=run,
        base=base,
        laws=damper.laws,
        tests=logged,
        chain=chain,
        reference_temperature=start if drifts else None,
        visible_gap=gap_after_refit(coarse, coarse_forces, base, temperatures=medians),
        gap_given_other={
            name: gap_after_refit(
                coarse,
                coarse_forces,
                base,
                integrated_parameters({other: values for other, values in damper.laws.items() if other != name}),
                medians,
            )
            for name in (hidden if len(hidden) > 1 else ())
        },
    )


def _scale(run: LaboratoryCampaign, base: BinghamTable, motions: Sequence[Driven], forces: Sequence[Array]) -> Scale:
    return Scale(
        force=max(float(np.max(np.abs(f))) for f in forces),
        friction=max(base.T0),
        speed=max(float(np.max(np.abs(m.velocity))) for m in motions),
        stroke=max(float(np.max(np.abs(m.displacement))) for m in motions),
        acceleration=max(float(np.percentile(np.abs(m.acceleration), 99)) for m in motions),
        damping=float(np.median(base.C)),
        voltage=run.values[-1] - run.values[0],
    )


def _sized_laws(
    hidden: Sequence[str], baseline: HiddenDamper, coarse: Sequence[Driven], scale: Scale, rise: float, rng: Generator
) -> dict[str, dict[str, float]]:
    """Return every hidden law with parameters at which it alone leaves about the gap that was drawn."""
    highest = baseline.base.values[-1]
    motions = [m for m in coarse if m.test.signal != "constant" or m.test.value == highest]  # enough, and faster
    found = {}
    for name in hidden:
        wanted = float(np.exp(rng.uniform(*np.log(GAPS))))
        law, chance, strength = {**LAWS, **OUTSIDE}[name], int(rng.integers(1 << 31)), 0.15
        for _ in range(TRIALS):
            values = law.draw(default_rng(chance), scale, strength)
            damper = HiddenDamper(baseline.base, {name: values}, baseline.start)
            forces, medians = damper.heated_forces(motions, max(rise, LEAST_DRIFT_RISE), law.place == "material")
            gap = gap_after_refit(motions, forces, baseline.base, temperatures=medians)
            if 0.7 * wanted <= gap <= 1.4 * wanted:
                break
            strength = min(2.0, strength * min(4.0, max(0.2, wanted / max(gap, 1e-9))))
        found[name] = values
    return found


def _logged(
    motion: Driven,
    force: Array,
    temperature: Array | None,
    chain: Chain,
    peak: float,
    signal_values: Sequence[float],
    rng: Generator,
) -> LoggedTest:
    """Return what the logger records of a test; a damper with one value of the control signal has no such channel."""
    at = motion.recorded
    time, x, true = motion.time[at], motion.displacement[at], force[at // 2]
    errors = ErrorsOfTest.drawn(rng, float(np.max(np.abs(true))))
    # keyword arguments are drawn in this order, which a seed depends on
    return LoggedTest(
        time=stand.stamped(time, chain),
        displacement=stand.sensed_displacement(time, x, chain, errors, rng),
        force=stand.sensed_force(time, true, peak, chain, errors, rng),
        signal=_sensed_signal(motion.signal[at], signal_values, rng) if len(signal_values) > 1 else None,
        temperature=None if temperature is None else np.round(temperature[at] + rng.normal(0.0, 0.05, at.size), 2),
        true_displacement=x + chain.displacement_zero,
        true_velocity=motion.velocity[at],
        true_acceleration=motion.acceleration[at],
        true_signal=motion.signal[at],
        true_temperature=None if temperature is None else temperature[at],
        true_force=true,
    )


def _sensed_signal(signal: Array, values: Sequence[float], rng: Generator) -> Array:
    return np.asarray(np.round(signal + rng.normal(0.0, 0.001 * (values[-1] - values[0]), signal.size), 3))


# --- Visible gap: what the best Bingham element cannot follow ---


NO_LAWS = Parameters()
_ASTRAY = 10.0
"""Residual beyond which a search has gone astray, as a share of the peak."""


def gap_after_refit(
    motions: Sequence[Driven],
    forces: Sequence[Array],
    base: BinghamTable,
    known: Parameters = NO_LAWS,
    temperatures: Sequence[float] | None = None,
) -> float:
    """Compute the residual of noise-free tests after T0, C and k are refitted at every constant control signal.

    Equation: min sqrt(mean ((F - F_sim)/F_peak)^2), F_peak of each test; where the signal moves, the refitted ones are
    interpolated

    Parameters
    ----------
    motions : every test
    forces : of each, at every second instant of its grid [N]
    base : where the search starts
    known : laws that the search takes as they are; by default none
    temperatures : of each test [degC]; tests of other temperatures have T0, C and k of their own. None: all alike

    Returns
    -------
    share of the peak force
    """
    values, start = base.values, (base.T0, base.C, base.k)
    refitted = [np.array(row, dtype=float) for row in start]
    squares = count = 0.0
    tests = list(zip(motions, forces, strict=True))
    groups = _groups([0.0] * len(tests) if temperatures is None else temperatures)
    for i, value in enumerate(values):
        for group in groups:
            in_group = (tests[j] for j in group)
            own = [(m, f) for m, f in in_group if m.test.signal == "constant" and m.test.value == value]
            if not own:
                continue
            z, residual = _refit(own, (base.T0[i], base.C[i], base.k[i]), known)
            squares, count = squares + float(residual @ residual), count + residual.size
            for row, first, change in zip(refitted, start, z, strict=True):
                row[i] = first[i] * np.exp(change)
    for m, f in tests:
        if m.test.signal != "constant":
            T0, C, k = (np.asarray(np.interp(m.signal, values, row)) for row in refitted)
            residual = _residual(m, f, (T0, C, k), known)
            squares, count = squares + float(residual @ residual), count + residual.size
    return float(np.sqrt(squares / count))


def _groups(temperatures: Sequence[float]) -> list[list[int]]:
    """Return the indices of the tests that count as of one temperature, group by group."""
    groups: list[list[int]] = []
    for j in sorted(range(len(temperatures)), key=lambda j: temperatures[j]):
        if groups and temperatures[j] - temperatures[groups[-1][0]] <= SAME_TEMPERATURE:
            groups[-1].append(j)
        else:
            groups.append([j])
    return groups


def _refit(
    own: Sequence[tuple[Driven, Array]], start: tuple[float, float, float], known: Parameters
) -> tuple[Array, Array]:
    """Return (3,) logarithms of the change of T0, C and k, and the (n,) residual then: the better of two searches."""
    from scipy.optimize import least_squares

    def residuals(z: Array) -> Array:
        rows = [_residual(m, f, _constant(m, start, z), known) for m, f in own]
        return np.asarray(np.nan_to_num(np.clip(np.concatenate(rows), -_ASTRAY, _ASTRAY), nan=_ASTRAY))

    low, high = np.array([-6.0, -6.0, -3.0]), np.array([3.0, 6.0, 3.0])
    friction, damping = _line_through(own)
    step = float(own[0][0].time[2] - own[0][0].time[0])
    stiffness = min(start[2], damping / step)  # the integration follows C/k of a step and more
    line = np.clip(np.log([friction / start[0], damping / start[1], stiffness / start[2]]), low, high)
    starts = [np.zeros(3)] if abs(line[1]) < OTHER_DAMPING else [np.zeros(3), line]
    # a thousandth of the gap is closeness enough, and 12 evaluations reach it
    fits = [
        least_squares(residuals, at, bounds=(low, high), max_nfev=12, diff_step=np.full(3, 1e-3), xtol=1e-3, ftol=1e-3)
        for at in starts
    ]
    best = min(fits, key=lambda fit: fit.cost)
    return np.asarray(best.x), np.asarray(best.fun)


def _line_through(own: Sequence[tuple[Driven, Array]]) -> tuple[float, float]:
    """Fit T0 [N] and C [N s/m] of a straight line through force over speed, where the motion is fast."""
    speed, force = np.concatenate([m.velocity[::2] for m, _ in own]), np.concatenate([f for _, f in own])
    fast = (np.abs(speed) > 0.3 * np.max(np.abs(speed))) & (speed * force > 0.0)
    C, T0 = np.polyfit(np.abs(speed[fast]), np.abs(force[fast]), 1)
    return max(float(T0), 1e-3), max(float(C), 1e-3)


def _constant(motion: Driven, start: tuple[float, float, float], z: Array) -> tuple[Array, Array, Array]:
    T0, C, k = (np.full_like(motion.time, first * np.exp(change)) for first, change in zip(start, z, strict=True))
    return T0, C, k


def _residual(motion: Driven, force: Array, base: tuple[Array, Array, Array], known: Parameters) -> Array:
    """Return the (n,) residual of the recorded part of a test, as a share of its peak; at most some 2000 samples."""
    simulated = integrated(motion.time, motion.kinematics, base, known)
    recorded = motion.time[::2] >= 0.0
    every = max(1, int(np.count_nonzero(recorded)) // 2000)
    return np.asarray(((force - simulated) / np.max(np.abs(force)))[recorded][::every])
