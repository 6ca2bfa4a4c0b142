"""How fast the force of a damper is beside solvers of other kinds, the error of each beside its time.

Both sides integrate the same equation under the same motion: the displacement a parabola inside each sample, voltage
linear. Times are those of the processor, taken in pairs, ours and the other's in turn in one process; the ratio is the
median over the pairs.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numba
import numpy as np
from bench_table import LEAST_SECONDS, PAIRS, Row, once, pairs
from scipy.integrate import solve_ivp

from pzd.damper.compiled.columns import STROKE_AND_FLOW
from pzd.damper.compose import integrated_force, sampling_steps
from pzd.damper.element import element_force, element_forces
from pzd.damper.motion import Motion
from pzd.damper.parameter_rows import constant_rows
from pzd.diagnosis.fit.likelihood import SIMULATION_TOLERANCE

Array = np.ndarray
STEP = 1e-3
SAMPLES = 10_000
SIZES = (1250, 2500, 5000, 10_000)
LARGEST_ERROR = 1e-10
"""Of a plain damper, as a share of the peak."""
SUBSTEPS = 8
TRUTH_SUBSTEPS = 8192
"""Of a Runge-Kutta scheme of order 4, which its kinks at stick make one of order 2: less than 1e-10 of peak is left."""
LSODA_TOLERANCE = 1e-6
CANDIDATES = 32
CYCLE = 500
"""Samples of the record that many candidates are tried on: what the preflight looks at."""
ORIFICE = 3000.0
"""q [N s2/m2]."""
TARGETS = {
    ("plain", "lsoda"): 5000.0,
    ("plain", "rk4"): 8.0,
    ("orifice", "lsoda"): 500.0,
    ("moving voltage", "lsoda"): 300.0,
}
"""Smallest ratios that are wanted."""


@dataclass(frozen=True)
class Compared:
    """One kind of damper against one other solver, over all pairs."""

    work: str
    peer: str
    samples: int
    pairs: int
    ours_ns: float
    """Median time a sample [ns]."""
    ours_error: float
    """Largest error, as a share of the peak force."""
    peer_ns: float
    peer_error: float
    ratio: float
    """Median over the pairs of the other's time by ours."""
    target: float | None


def multisine(rng: np.random.Generator) -> Motion:
    """Three sines of random phase up to 12 Hz, sampled."""
    at = np.arange(SAMPLES) * STEP
    x, v, a = np.zeros((3, SAMPLES))
    for frequency, amplitude in ((1.0, 0.02), (3.7, 0.006), (12.0, 0.001)):
        omega, phase = 2.0 * np.pi * frequency, rng.uniform(0.0, 2.0 * np.pi)
        x += amplitude * np.sin(omega * at + phase)
        v += amplitude * omega * np.cos(omega * at + phase)
        a -= amplitude * omega**2 * np.sin(omega * at + phase)
    return Motion(at, x, v, a)


def dampers(motion: Motion) -> dict[str, Array]:
    """(1, r) or (n, r) parameter rows by what is asked."""
    plain, _ = constant_rows(400.0, 2500.0, 4e5, {})
    orifice, _ = constant_rows(400.0, 2500.0, 4e5, {"orifice_quadratic": {"q": ORIFICE}})
    moving = np.repeat(plain, SAMPLES, axis=0)
    share = 0.5 + 0.47 * np.sin(2.0 * np.pi * 2.3 * motion.time)
    moving[:, :3] = np.column_stack([300.0 + 1000.0 * share, 2700.0 - 200.0 * share, 2e5 + 2e5 * share])
    return {"plain": plain, "orifice": orifice, "moving voltage": moving}


# ---------------------------------------------------------------- the other solvers


@numba.njit(error_model="numpy")
def rate(e: float, u: float, T0: float, C: float, k: float, q: float) -> float:
    """de/dt of the elastic deflection e: the flow curve T0 + C w + q w^2 inverted by hand."""
    over = abs(k * e) - T0
    if over <= 0.0:
        return u
    w = over / C if q == 0.0 else 2.0 * over / (C + math.sqrt(C * C + 4.0 * q * over))
    return u - math.copysign(w, e)


@numba.njit(error_model="numpy")
def runge_kutta(x: Array, v: Array, h: float, rows: Array, q: float, substeps: int, force: Array) -> None:
    """Fill the force by the classic scheme of order 4, so many steps to a sample."""
    last, e, d = len(rows) - 1, 0.0, h / substeps
    force[0] = 0.0
    for i in range(1, x.size):
        p0, p1 = rows[min(i - 1, last)], rows[min(i, last)]
        mean, half = (x[i] - x[i - 1]) / h, 0.5 * (v[i] - v[i - 1])
        for j in range(substeps):
            s0, s1, s2 = j / substeps, (j + 0.5) / substeps, (j + 1) / substeps
            r1 = _at(e, s0, mean, half, p0, p1, q)
            r2 = _at(e + 0.5 * d * r1, s1, mean, half, p0, p1, q)
            r3 = _at(e + 0.5 * d * r2, s1, mean, half, p0, p1, q)
            e += d / 6.0 * (r1 + 2.0 * (r2 + r3) + _at(e + d * r3, s2, mean, half, p0, p1, q))
        force[i] = p1[2] * e


@numba.njit(error_model="numpy")
def _at(e: float, share: float, mean: float, half: float, p0: Array, p1: Array, q: float) -> float:
    T0, C, k = p0[0] + share * (p1[0] - p0[0]), p0[1] + share * (p1[1] - p0[1]), p0[2] + share * (p1[2] - p0[2])
    return rate(e, mean + half * (2.0 * share - 1.0), T0, C, k, q)


def lsoda(motion: Motion, rows: Array, q: float) -> Array:
    """(n,) force by scipy's solve_ivp in one go, the compiled right-hand side called back from Python."""
    mean = np.diff(motion.displacement) / STEP
    half = 0.5 * np.diff(motion.velocity)

    def slope(t: float, y: Array) -> list[float]:
        i = min(int(t / STEP), SAMPLES - 2)
        return [_at(y[0], t / STEP - i, mean[i], half[i], rows[min(i, last)], rows[min(i + 1, last)], q)]

    last = len(rows) - 1
    tolerance = LSODA_TOLERANCE
    span = (0.0, float(motion.time[-1]))
    run = solve_ivp(slope, span, [0.0], "LSODA", t_eval=motion.time, rtol=tolerance, atol=tolerance * 1e-2)
    return rows[:, 2] * run.y[0]


# ---------------------------------------------------------------- the comparison


def compared(rng: np.random.Generator) -> Iterator[Compared]:
    """Every kind of damper against every other solver."""
    motion = multisine(rng)
    steps = sampling_steps(motion.time)
    x, v = motion.displacement, motion.velocity
    column = 3 + STROKE_AND_FLOW.index(("orifice_quadratic", "q"))
    for work, rows in dampers(motion).items():
        q, truth, out = float(rows[0, column]), np.empty(SAMPLES), np.empty(SAMPLES)
        runge_kutta(x, v, STEP, rows, q, TRUTH_SUBSTEPS, truth)

        def ours(rows: Array = rows) -> Array:
            return integrated_force(rows, motion, steps, 0.0, SIMULATION_TOLERANCE)

        def by_rk4(rows: Array = rows, q: float = q, out: Array = out) -> Array:
            runge_kutta(x, v, STEP, rows, q, SUBSTEPS, out)
            return out

        def by_lsoda(rows: Array = rows, q: float = q) -> Array:
            return lsoda(motion, rows, q)

        for peer, other in (("lsoda", by_lsoda), ("rk4", by_rk4)):
            times = np.array(list(pairs(ours, other)))
            ours_ns, peer_ns = np.median(times, axis=0) / SAMPLES * 1e9
            errors = [float(np.max(np.abs(f() - truth)) / np.max(np.abs(truth))) for f in (ours, other)]
            ratio = float(np.median(times[:, 1] / times[:, 0]))
            target = TARGETS.get((work, peer))
            yield Compared(work, peer, SAMPLES, PAIRS, ours_ns, errors[0], peer_ns, errors[1], ratio, target)


def rows(seed: int = 22) -> Iterator[Row]:
    """Every comparison, growth with the samples, and what is not there."""
    names = {"lsoda": f"solve_ivp LSODA {LSODA_TOLERANCE:g}", "rk4": f"numba RK4 of {SUBSTEPS} substeps"}
    for one in compared(np.random.default_rng(seed)):
        sides = f"{one.ours_ns:.3g} ns a sample, error {one.ours_error:.1e}; {one.peer_ns:.3g} ns, {one.peer_error:.1e}"
        yield Row(f"force, {one.work}, beside {names[one.peer]}", one.ratio, "x", one.target, about=sides)
        if (one.work, one.peer) == ("plain", "lsoda"):
            yield Row("force, plain: error, share of the peak", one.ours_error, "", LARGEST_ERROR, at_least=False)
    yield _at_once(np.random.default_rng(seed))
    yield from _growth(np.random.default_rng(seed))


def _at_once(rng: np.random.Generator) -> Row:
    """Many candidates for one record in one call, beside a call each."""
    x = multisine(rng).displacement[:CYCLE]
    elements = np.column_stack([rng.uniform(*span, CANDIDATES) for span in ((100, 1000), (500, 5000), (1e5, 1e6))])

    def together() -> Array:
        return element_forces(x, STEP, elements)

    def each() -> list[Array]:
        return [element_force(x, STEP, *element) for element in elements]

    times = np.array(list(pairs(together, each)))
    about = f"{CYCLE} samples; both give the same bytes: {np.array_equal(together(), each())}"
    ratio = float(np.median(times[:, 0] / times[:, 1]))
    return Row(f"{CANDIDATES} candidates at once, beside a call each", ratio, "", 0.9, at_least=False, about=about)


def _growth(rng: np.random.Generator) -> Iterator[Row]:
    motion = multisine(rng)
    for work, parameters in dampers(motion).items():
        times = []
        for count in SIZES:
            part = Motion(*(channel[:count] for channel in (motion.time, motion.displacement, motion.velocity)),
                          motion.acceleration[:count])  # fmt: skip
            steps, some = sampling_steps(part.time), parameters[:count]

            def force(part: Motion = part, steps: Array = steps, some: Array = some) -> Array:
                return integrated_force(some, part, steps, 0.0, SIMULATION_TOLERANCE)

            force()
            times.append(min(once(force, math.ceil(LEAST_SECONDS / once(force))) for _ in range(5)))
        exponent = float(np.polyfit(np.log(SIZES), np.log(times), 1)[0])
        yield Row(f"force, {work}: growth with samples, exponent", exponent, "", 1.05, at_least=False,
                  about=f"{SIZES[0]} to {SIZES[-1]} samples")  # fmt: skip
