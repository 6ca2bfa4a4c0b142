"""Draws a case: a damper, a law hidden in it or beside it, a campaign, and what the logger has of it."""

from __future__ import annotations

import importlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import ModuleType

import numpy as np
from numpy.random import Generator, SeedSequence, default_rng

from pzd.blind.independent.bingham import Base, Scale
from pzd.blind.independent.kernel import Parameters, integrated
from pzd.blind.independent.laws import piezo_hysteresis, sensor_delay, temperature_drift, valve_lag
from pzd.blind.independent.refit import gap_after_refit
from pzd.blind.independent.stand import (
    Actuator,
    Chain,
    Driven,
    ErrorsOfTest,
    LaboratoryCampaign,
    campaign,
    driven,
    sensed_displacement,
    sensed_force,
    stamped,
    warmed,
)
from pzd.record import Array

LAWS = (
    *("asymmetry", "end_stop", "fluid_inertia", "gas_spring", "lash", "orifice_quadratic", "piezo_hysteresis"),
    *("preload_offset", "relief_valve", "rounded_yield", "sensor_delay", "shear_thinning", "stribeck_friction"),
    *("temperature_drift", "valve_lag"),
)
"""What can be hidden that the library names."""
DRIVE = ("piezo_hysteresis", "valve_lag")
"""Those of them that show only where the control signal moves."""
SEPARATE = (*DRIVE, "sensor_delay", "temperature_drift")
"""Those of them that act before or after the integration, and are hidden alone."""
OUTSIDE = (
    *("frequency_dependent", "thixotropy", "position_grooves", "two_stage_blow_off", "frame_stick_slip"),
    *("viscoelastic_mount", "aeration", "late_filling", "cubic_spring", "smooth_pipe", "polytropic_gas"),
    "second_branch",
)
"""What can be hidden that no name of the library is right about, or a name that is not its own."""
GAPS = (0.008, 0.05)
"""Smallest and largest visible gap that a hidden law is drawn to leave, as a share of the peak."""
TRIALS = 5


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
    base: Base
    laws: Mapping[str, Mapping[str, float]]
    """What is hidden, with its parameters."""
    tests: tuple[LoggedTest, ...]
    chain: Chain
    reference_temperature: float | None
    visible_gap: float
    """R.m.s. that the best T0, C and k miss, as a share of the peak."""
    gap_given_other: Mapping[str, float]


def module_of(name: str) -> ModuleType:
    """The file of a law."""
    folder = "laws" if name in LAWS or name == "second_branch" else "outside"
    return importlib.import_module(f"pzd.blind.independent.{folder}.{name}")


def described_by(name: str) -> tuple[str, ...]:
    """Names of the library with which a verdict is right about a form outside it."""
    return ("second_branch",) if name == "second_branch" else tuple(module_of(name).DESCRIBED_BY)


def drawn_case(seed: int, index: int, campaign_name: str, hidden: Sequence[str]) -> IndependentCase:
    """A case.

    Parameters
    ----------
    seed : of the benchmark
    index : of the case; with the seed it fixes every draw
    campaign_name : what the stand runs
    hidden : names of laws
    """
    draw = default_rng(SeedSequence(seed, spawn_key=(index, 2)))
    run = campaign(campaign_name, draw)
    base, actuator = Base.drawn(run.values, draw), Actuator.drawn(draw)
    phases = int(draw.integers(1 << 31))
    fine, coarse = (
        [driven(run, t, actuator, default_rng([phases, i]), rough) for i, t in enumerate(run.tests)]
        for rough in (False, True)
    )
    start, rise = float(draw.uniform(18.0, 26.0)), float(np.exp(draw.uniform(np.log(0.5), np.log(8.0))))
    drifts = "temperature_drift" in hidden
    heated = drifts or draw.random() < 0.3
    damper = Hidden(base, {}, start)
    plain = [damper.force(m, None) for m in coarse]
    scale = _scale(run, base, coarse, plain)
    damper = Hidden(base, _sized(hidden, damper, coarse, scale, start, max(rise, 4.0), draw), start)
    temperatures: list[Array] | list[None] = [None] * len(fine)
    if heated:
        first = [damper.force(m, None) for m in fine]
        temperatures = warmed(fine, first, start, _capacity(fine, first, max(rise, 4.0) if drifts else rise))
    forces = [damper.force(m, t) for m, t in zip(fine, temperatures, strict=True)]
    peak = max(float(np.max(np.abs(f))) for f in forces)
    chain = Chain.drawn(draw, peak, scale.stroke, run.rate)
    logged = tuple(
        _logged(m, f, t, chain, peak, len(run.values) > 1, damper, draw)
        for m, f, t in zip(fine, forces, temperatures, strict=True)
    )
    seen, warm = _forces_and_temperatures(damper, coarse, start, rise, drifts)
    return IndependentCase(
        campaign=run,
        base=base,
        laws=damper.laws,
        tests=logged,
        chain=chain,
        reference_temperature=start if drifts else None,
        visible_gap=gap_after_refit(coarse, seen, base, temperatures=warm),
        gap_given_other={
            name: gap_after_refit(
                coarse, seen, base, parameters_of({n: v for n, v in damper.laws.items() if n != name}), warm
            )
            for name in (hidden if len(hidden) > 1 else ())
        },
    )


@dataclass(frozen=True)
class Hidden:
    """A damper with what is hidden in it."""

    base: Base
    laws: Mapping[str, Mapping[str, float]]
    start: float
    """Reference temperature [degC]."""

    def force(self, motion: Driven, temperature: Array | None) -> Array:
        """Force at every second instant of the fine grid [N], as recorded by a channel that may be late."""
        signal, step = motion.signal, float(motion.time[1] - motion.time[0])
        if "valve_lag" in self.laws:
            signal = valve_lag.effective(signal, step, self.laws["valve_lag"]["tau"])
        if "piezo_hysteresis" in self.laws:
            signal = piezo_hysteresis.effective(signal, self.laws["piezo_hysteresis"]["r"])
        T0, C, k = self.base.at(signal)
        if "temperature_drift" in self.laws and temperature is not None:
            betas = self.laws["temperature_drift"]
            T0 = T0 * temperature_drift.factor(temperature, self.start, betas["beta_T0"])
            C = C * temperature_drift.factor(temperature, self.start, betas["beta_C"])
        kinematics = (motion.displacement, motion.velocity, motion.acceleration)
        force = integrated(motion.time, kinematics, (T0, C, k), parameters_of(self.laws))
        if "sensor_delay" in self.laws:
            force = sensor_delay.delayed(motion.time[::2], force, self.laws["sensor_delay"]["tau"])
        return force


def parameters_of(laws: Mapping[str, Mapping[str, float]]) -> Parameters:
    """The parameters of those laws that the integration knows; drive, temperature and delay act before and after it."""
    return Parameters(**{key: v for law in laws.values() for key, v in law.items() if key in Parameters._fields})


def _scale(run: LaboratoryCampaign, base: Base, motions: Sequence[Driven], forces: Sequence[Array]) -> Scale:
    return Scale(
        force=max(float(np.max(np.abs(f))) for f in forces),
        speed=max(float(np.max(np.abs(m.velocity))) for m in motions),
        stroke=max(float(np.max(np.abs(m.displacement))) for m in motions),
        acceleration=max(float(np.percentile(np.abs(m.acceleration), 99)) for m in motions),
        damping=float(np.median(base.C)),
        voltage=run.values[-1] - run.values[0],
    )


def _capacity(motions: Sequence[Driven], forces: Sequence[Array], rise: float) -> float:
    """Heat capacity at which the work of all tests warms the damper by so many kelvin [J/K]."""
    work = sum(
        float(np.sum(np.clip(f * m.velocity[::2], 0.0, None)) * (m.time[2] - m.time[0]))
        for m, f in zip(motions, forces, strict=True)
    )
    return work / rise


def _forces_and_temperatures(
    damper: Hidden, coarse: Sequence[Driven], start: float, rise: float, drifts: bool
) -> tuple[list[Array], list[float] | None]:
    """The force in every test [N], and its median temperature [degC] where that matters."""
    forces = [damper.force(m, None) for m in coarse]
    if not drifts:
        return forces, None
    temperatures = warmed(coarse, forces, start, _capacity(coarse, forces, max(rise, 4.0)))
    warm = [float(np.median(t[m.time >= 0.0])) for m, t in zip(coarse, temperatures, strict=True)]
    return [damper.force(m, t) for m, t in zip(coarse, temperatures, strict=True)], warm


def _sized(
    hidden: Sequence[str],
    plain: Hidden,
    coarse: Sequence[Driven],
    scale: Scale,
    start: float,
    rise: float,
    draw: Generator,
) -> dict[str, dict[str, float]]:
    """Every hidden law with parameters at which it alone leaves about the gap that was drawn."""
    tried = [i for i, m in enumerate(coarse) if m.test.signal != "constant" or m.test.value == plain.base.values[-1]]
    some = [coarse[i] for i in tried]
    found = {}
    for name in hidden:
        wanted = float(np.exp(draw.uniform(*np.log(GAPS))))
        law, chance, strength = module_of(name), int(draw.integers(1 << 31)), 0.15
        for _ in range(TRIALS):
            values = law.drawn(default_rng(chance), scale, strength)
            damper = Hidden(plain.base, {name: values}, start)
            seen, warm = _forces_and_temperatures(damper, some, start, rise, name == "temperature_drift")
            gap = gap_after_refit(some, seen, plain.base, temperatures=warm)
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
    controlled: bool,
    damper: Hidden,
    draw: Generator,
) -> LoggedTest:
    at = motion.recorded
    time, x, true = motion.time[at], motion.displacement[at], force[at // 2]
    errors = ErrorsOfTest.drawn(draw, float(np.max(np.abs(true))))
    span = damper.base.values[-1] - damper.base.values[0]
    return LoggedTest(
        time=stamped(time, chain),
        displacement=sensed_displacement(time, x, chain, errors, draw),
        force=sensed_force(time, true, peak, chain, errors, draw),
        signal=np.round(motion.signal[at] + draw.normal(0.0, 0.001 * span, at.size), 3) if controlled else None,
        temperature=None if temperature is None else np.round(temperature[at] + draw.normal(0.0, 0.05, at.size), 2),
        true_displacement=x + chain.zero,
        true_velocity=motion.velocity[at],
        true_acceleration=motion.acceleration[at],
        true_signal=motion.signal[at],
        true_temperature=None if temperature is None else temperature[at],
        true_force=true,
    )
