"""Campaigns on dampers whose T0, C and k are known, with sensors that differ from test to test and effects hidden."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from fresh_truths import autoregressive
from numpy.random import Generator

from pzd.blind.hide import parameters_of_size
from pzd.damper.compose import respond
from pzd.damper.effect import Scales
from pzd.damper.effects import library
from pzd.damper.model import BaseRow, Damper
from pzd.damper.motion import Motion
from pzd.identification.bingham_fit import Bingham
from pzd.record import Array, Record
from pzd.signals.nuisance import NuisanceConfig

RATE = 500
OVERSAMPLING = 8
CYCLES = 6
ROWS = (
    Bingham(301.0, 2720.0, 199e3),
    Bingham(356.0, 3300.0, 358e3),
    Bingham(796.0, 3040.0, 375e3),
    Bingham(1325.0, 2560.0, 423e3),
)
"""Table 2 of Makowski and Knap 2021."""
HIDDEN = (
    "orifice_quadratic",
    "shear_thinning",
    "relief_valve",
    "rounded_yield",
    "stribeck_friction",
    "asymmetry",
    "gas_spring",
    "fluid_inertia",
    "lash",
)
"""Effects that one voltage and one temperature show."""
SENSORS = NuisanceConfig()
"""How far the sensors differ from test to test: the priors that identify reckons with."""

Course = Callable[[Array], Array]


@dataclass(frozen=True)
class Test:
    """One test of a campaign."""

    __test__ = False

    seconds: float
    lead: float
    """Seconds before the recording begins."""
    course: Course


def sine(frequency: float, amplitude: float) -> Test:
    """Six cycles of a sine."""
    return Test(CYCLES / frequency, 1.0 / frequency, lambda t: amplitude * np.sin(2.0 * np.pi * frequency * t))


def triangle(frequency: float, amplitude: float) -> Test:
    """Six cycles of a triangle, its corners rounded as an actuator rounds them."""

    def course(t: Array) -> Array:
        orders = np.arange(1, 16, 2)
        signs = np.where(orders % 4 == 1, 1.0, -1.0) / orders**2
        return np.asarray(8.0 / np.pi**2 * amplitude * np.sin(2.0 * np.pi * frequency * np.outer(t, orders)) @ signs)

    return Test(CYCLES / frequency, 1.0 / frequency, course)


def random_motion(rng: Generator, seconds: float = 10.0, amplitude: float = 0.02) -> Test:
    """A motion between 0.3 and 4 Hz that repeats nowhere; the r.m.s. of a sine of that amplitude."""
    frequencies = rng.uniform(0.3, 4.0, 40)
    sizes = frequencies**-1.0
    sizes *= amplitude / np.sqrt(np.sum(sizes**2))
    phases = rng.uniform(0.0, 2.0 * np.pi, 40)
    return Test(seconds, 1.0, lambda t: np.sin(2.0 * np.pi * np.outer(t, frequencies) + phases) @ sizes)


KINDS: dict[str, Callable[[Generator], list[Test]]] = {
    "one sine": lambda _: [sine(2.0, 0.02)],
    "two sines": lambda _: [sine(1.0, 0.02), sine(2.0, 0.03)],
    "five tests": lambda _: [
        sine(1.0, 0.01),
        sine(1.0, 0.03),
        sine(2.0, 0.01),
        sine(2.0, 0.03),
        triangle(1.5, 0.02),
    ],
    "one random": lambda rng: [random_motion(rng)],
    "three random": lambda rng: [random_motion(rng, amplitude=a) for a in (0.01, 0.02, 0.03)],
}
"""What is driven at one voltage: records that repeat and records that do not, one and several."""


def campaign(
    rng: Generator,
    kind: str,
    *,
    correlation: float = 0.0,
    hidden: float = 0.0,
    noise: float = 0.01,
    sensors: NuisanceConfig = SENSORS,
) -> tuple[Bingham, tuple[Record, ...]]:
    """T0, C and k within 20 % of a row of the paper, and the records of such a damper at one voltage.

    Parameters
    ----------
    rng : of every draw
    kind : one of `KINDS`
    correlation : of the force noise, an AR(1)
    hidden : size of an effect drawn from `HIDDEN`: amplitude of a sine of the same r.m.s. over peak force, in the
        test that it changes most
    noise : standard deviation of the force noise over peak force
    sensors : standard deviations of gain, offset and delay from test to test
    """
    truth = Bingham(*(np.array(ROWS[rng.integers(len(ROWS))]) * rng.uniform(0.8, 1.2, 3)).tolist())
    motions = [(test, _motion(test)) for test in KINDS[kind](rng)]
    plain = Damper(base=(BaseRow(T0_N=truth.friction, C_Ns_per_m=truth.damping, k_N_per_m=truth.stiffness),))
    damper = _hiding(rng, plain, [motion for _, motion in motions], hidden) if hidden else plain
    return truth, tuple(
        _record(rng, damper, test, motion, f"r{i}", correlation, noise, sensors)
        for i, (test, motion) in enumerate(motions)
    )


def _motion(test: Test) -> Motion:
    fine = RATE * OVERSAMPLING
    time = np.arange(round(-test.lead * fine), round(test.seconds * fine) + 1) / fine
    x = test.course(time)
    v = np.gradient(x, time, edge_order=2)
    return Motion(time, x, v, np.gradient(v, time, edge_order=2), None, None)


def _hiding(rng: Generator, plain: Damper, motions: list[Motion], size: float) -> Damper:
    """The damper with an effect of the size; voltage and temperature being one, only what acts at once is drawn."""
    name = str(rng.choice(HIDDEN))
    coarse = [
        Motion(*(c[::OVERSAMPLING] for c in (m.time, m.displacement, m.velocity, m.acceleration)), None, None)
        for m in motions
    ]
    forces = [respond(plain, m, 0.0, 1e-6) for m in coarse]
    peaks = [float(np.max(np.abs(f))) for f in forces]
    scales = Scales(
        force=max(peaks),
        low_force=min(peaks),
        speed=max(float(np.max(np.abs(m.velocity))) for m in coarse),
        stroke=max(float(np.max(np.abs(m.displacement))) for m in coarse),
        acceleration=max(float(np.max(np.abs(m.acceleration))) for m in coarse),
        damping=plain.base[0].C_Ns_per_m,
        voltage=0.0,
    )

    def changed(values: dict[str, float]) -> float:
        damper = plain.with_effect(name, values)
        changes = [respond(damper, m, 0.0, 1e-6) - f for m, f in zip(coarse, forces, strict=True)]
        return max(float(np.sqrt(2.0 * np.mean(c**2))) / p for c, p in zip(changes, peaks, strict=True))

    hiding = library()[name].hidden
    assert hiding is not None, name
    values = parameters_of_size(hiding(rng, scales), changed, size)
    if name == "relief_valve" and values["F_r"] <= plain.base[0].T0_N:
        # Always open, it leaves a Bingham element with C_r for C: nothing is hidden, so another effect is drawn.
        return _hiding(rng, plain, motions, size)
    return plain.with_effect(name, values)


def _record(
    rng: Generator,
    damper: Damper,
    test: Test,
    motion: Motion,
    name: str,
    correlation: float,
    noise: float,
    sensors: NuisanceConfig,
) -> Record:
    """What the sensors show of one test."""
    fine = respond(damper, motion)
    time = np.arange(round(test.seconds * RATE)) / RATE
    peak = float(np.max(np.abs(fine)))
    at = partial(np.interp, time, motion.time)
    delayed = np.interp(time - sensors.delay_s * rng.standard_normal(), motion.time, fine)
    force = (1.0 + sensors.gain * rng.standard_normal()) * delayed + sensors.offset * peak * rng.standard_normal()
    force = force + noise * peak * autoregressive(rng, time.size, correlation)
    return Record(name, None, time, at(motion.displacement), at(motion.velocity), at(motion.acceleration), force)
