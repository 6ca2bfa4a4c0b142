"""Fit, ride and comfort beside what a library offers for the same work; the error of each side beside its time."""

from __future__ import annotations

import json
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import numpy as np
from bench_kernels import rate
from bench_table import Row, once, pairs
from scipy.integrate import solve_ivp
from scipy.signal import bilinear_zpk, resample_poly, sosfilt, sosfreqz, zpk2sos

import pzd
from pzd.artefacts import Table
from pzd.comfort.iso2631_1997 import evaluate, maximum_transient, vibration_dose
from pzd.comfort.weighting import WK, response, weighted
from pzd.damper.element import element_force
from pzd.damper.model import BaseRow, Damper
from pzd.identification.bingham_fit import Bingham, Objective, descend, fit_evolutionary, fit_separable
from pzd.identification.config import EvolutionaryConfig
from pzd.identification.prepared_record import prepare
from pzd.pipeline.command import opened
from pzd.pipeline.execution import InMemory
from pzd.pipeline.stages import stages
from pzd.record import Record
from pzd.simulate.config import KM_PER_H, SimulateConfig
from pzd.simulate.ride.model import dynamic_damper_of, grid_of
from pzd.simulate.roads import Way
from pzd.simulate.study.plan import cases
from pzd.simulate.study.tuning import Setup

Array = np.ndarray

# ---------------------------------------------------------------- the fit of one record

SAMPLES = 10_000
SEEDS = 50
SAME = 1e-6
"""A criterion this close to that from the truth, relative, is of the same optimum."""
FITS = 3
"""Pairs; the other side takes seconds."""


def record_of(rng: np.random.Generator) -> Record:
    """A minute of two sines by a damper drawn at random, with 1 % noise."""
    t = np.arange(SAMPLES) * 2e-3
    x = 0.02 * np.sin(2.0 * np.pi * t) + 0.004 * np.sin(2.0 * np.pi * 3.1 * t + rng.uniform(0.0, 6.0))
    truth = true_of(rng)
    force = element_force(x, 2e-3, *truth, 0.0)
    force += 0.01 * np.max(np.abs(force)) * rng.standard_normal(SAMPLES)
    v = np.gradient(x, t)
    return Record("one", None, t, x, v, np.gradient(v, t), force)


def true_of(rng: np.random.Generator) -> Bingham:
    """T0, C and k over a decade each."""
    return Bingham(*np.exp(rng.uniform(np.log([100.0, 800.0, 1e5]), np.log([1000.0, 8000.0, 1e6]))).tolist())


def fits() -> Iterator[Row]:
    """The separable method beside differential evolution on the same criterion and kernel."""
    objective = Objective((prepare(record_of(np.random.default_rng(22))),))

    def ours() -> float:
        return fit_separable(objective).criterion

    def evolved() -> float:
        return fit_evolutionary(objective, EvolutionaryConfig(), 1).criterion

    times = np.array(list(pairs(ours, evolved, FITS)))
    mine, other = np.median(times, axis=0)
    about = f"{mine:.3g} s, W_s {ours():.6g}; {other:.3g} s, W_s {evolved():.6g}"
    ratio = float(np.median(times[:, 1] / times[:, 0]))
    yield Row("identify a record of 10^4 samples, beside differential_evolution", ratio, "x", 100.0, about=about)
    found = 0
    for seed in range(SEEDS):
        one = Objective((prepare(record_of(np.random.default_rng(seed))),))
        truth = _truth(seed)
        found += fit_separable(one).criterion <= descend(one, truth).criterion * (1.0 + SAME)
    yield Row(f"identify: optimum as low as from the truth, of {SEEDS}", found, "", SEEDS)


def _truth(seed: int) -> Bingham:
    rng = np.random.default_rng(seed)
    rng.uniform()  # the phase is drawn first
    return true_of(rng)


# ---------------------------------------------------------------- a ride

RIDES = Path(__file__).parent / "campaign" / "rides.yaml"
RIDE_S = 4.0
CAR = {"T0": 300.0, "C": 2700.0, "k": 2e5}


def rides() -> Iterator[Row]:
    """The half-car on dampers with dynamics, beside solve_ivp restarted at each control step."""
    block = {
        "roads": [{"kind": "sine", "frequency_Hz": 2.25}],
        "policies": ["passive"],
        "fidelities": ["dynamic"],
        "duration_s": RIDE_S,
        "settle_s": 1.0,
        "output_rate_Hz": 1000.0,
        "tolerance": 1e-6,
    }
    config = SimulateConfig.model_validate_json(json.dumps(block))
    damper = Damper(
        base=tuple(BaseRow(voltage_V=u, T0_N=300.0, C_Ns_per_m=2700.0, k_N_per_m=2e5) for u in (0.0, 100.0))
    )
    speed = config.vehicle_speed_km_per_h * KM_PER_H
    road = config.roads[0].profile(Way(speed, speed * RIDE_S, 1, None))
    oil = dynamic_damper_of(damper, None, config.valve_response_s)
    setup = Setup(config, {config.roads[0].name: road}, grid_of(_some_table(), None), oil, ends=False)
    (case,) = cases(config, True, False)

    def ours() -> Array:
        return setup.ridden(case)[1].history[:, 3]

    car = config.car.car()
    h, mass = car.force_directions(), car.mass_matrix()
    k = np.array(car.stiffnesses)
    behind = np.array([0.0, car.wheelbase])

    def slope(t: float, y: Array) -> Array:
        d = 1e-6
        at = speed * t - behind
        rise = (road.height(at + d) - road.height(at - d)) / (2.0 * d) * speed
        deflection, moving = h.T @ y[:2] - road.height(at), h.T @ y[2:4] - rise
        force = k * deflection + CAR["k"] * y[4:]
        flowing = [rate(e, u, CAR["T0"], CAR["C"], CAR["k"], 0.0) for e, u in zip(y[4:], moving, strict=True)]
        return np.concatenate([y[2:4], -np.linalg.solve(mass, h @ force), flowing])

    def restarted(tolerance: float) -> Array:
        y, found = np.zeros(6), [0.0]
        for step in range(round(RIDE_S / config.control_period_s)):
            span = (step * config.control_period_s, (step + 1) * config.control_period_s)
            y = solve_ivp(slope, span, y, "LSODA", rtol=tolerance, atol=tolerance * 1e-3).y[:, -1]
            at = speed * span[1] - behind
            force = k * (h.T @ y[:2] - road.height(at)) + CAR["k"] * y[4:]
            found.append(float(car.force_to_comfort() @ force))
        return np.array(found)

    truth = restarted(1e-10)
    ours()
    mine = float(np.median([once(ours, 3) for _ in range(7)]))
    other = min(once(lambda: restarted(1e-6)) for _ in range(2))
    peak = np.max(np.abs(truth))
    errors = [float(np.max(np.abs(a[1 : truth.size] - truth[1 : a.size])) / peak) for a in (ours(), restarted(1e-6))]
    mine_us, other_us = mine / RIDE_S * 1e3, other / RIDE_S * 1e3
    about = f"{mine_us:.3g} us a ms, error of a_K {errors[0]:.1e}; {other_us:.3g} us, {errors[1]:.1e}"
    yield Row("half-car, dynamic dampers, 1 kHz, 1e-6, beside solve_ivp", other / mine, "x", 1000.0, about=about)


def _some_table() -> Table:
    """A table that such a ride needs and does not look into: its voltage is given, its dampers have dynamics."""
    given = opened(RIDES, Path("runs"))
    chain = InMemory(given.config, given.run, stages(given.config), lambda _: None)
    table = chain.through("table")[Table.folder]
    assert isinstance(table, Table)
    return table


STIFF = pzd.Damper(
    [
        {"voltage_V": u, "T0_N": T0, "C_Ns_per_m": C, "k_N_per_m": k}
        for u, T0, C, k in ((0.0, 110.0, 980.0, 9e6), (0.5, 520.0, 4500.0, 1.5e7), (1.0, 970.0, 6100.0, 1.2e7))
    ],
    {"second_branch": {"T0_2": 100.0, "k_2": 5e5}, "gas_spring": {"k_g": 700.0}},
)
"""Like the measured damper of UTFSM, current in the place of the voltage."""
PREDICTED_S = (1.0, 3.0)
"""Lengths of two rides, whose difference leaves out what it takes to begin."""
PREDICTION_US = 150.0


def prediction() -> Iterator[Row]:
    """A ride by the predictive policy on a stiff damper with branches that remember."""

    def ours(seconds: float) -> None:
        pzd.ride(STIFF, road="sine", policy="comfort_predictive", duration=seconds)

    ours(PREDICTED_S[0])  # compiles
    few, many = (min(once(partial(ours, seconds)) for _ in range(3)) for seconds in PREDICTED_S)
    each = 1e3 * (many - few) / (PREDICTED_S[1] - PREDICTED_S[0])
    yield Row("comfort_predictive on a stiff damper, a ms of the ride", each, "us", PREDICTION_US, at_least=False)


# ---------------------------------------------------------------- comfort

RATE = 1000.0
MINUTE = 60_000
WITHIN = 1e-3
"""Of the formula, over the third-octave bands of Wk."""


def sections(factor: int) -> Array:
    """Wk by the bilinear transform at so many times the rate."""
    corner = 2.0 * np.pi * np.array([WK.f1, WK.f2, WK.f3, WK.f4])
    f5, q5, f6, q6 = WK.step
    zeros = [0.0, 0.0, -corner[2], *_pair(2.0 * np.pi * f5, q5)]
    poles = [*_pair(corner[0], np.sqrt(0.5)), *_pair(corner[1], np.sqrt(0.5)), *_pair(corner[3], WK.Q4)]
    poles += _pair(2.0 * np.pi * f6, q6)
    at = 2j * np.pi * 10.0
    gain = response(WK, np.array([10.0]))[0] / (np.prod(at - np.array(zeros)) / np.prod(at - np.array(poles)))
    return zpk2sos(*bilinear_zpk(np.array(zeros), np.array(poles), gain.real, factor * RATE))


def _pair(omega: float, quality: float) -> list[complex]:
    return np.roots([1.0, omega / quality, omega**2]).tolist()


def deviation(factor: int) -> float:
    """Largest error of the sections' gain between 0.5 and 80 Hz, relative."""
    bands = 10.0 ** (np.arange(-3, 20) / 10.0)
    _, gain = sosfreqz(sections(factor), bands, fs=factor * RATE)
    return float(np.max(np.abs(np.abs(gain) / np.abs(response(WK, bands)) - 1.0)))


def comfort() -> Iterator[Row]:
    """Weighting, running r.m.s. and dose of a minute, beside sosfilt at the rate at which it is as exact."""
    factor = next(m for m in (1, 2, 4, 8, 16, 32) if deviation(m) <= WITHIN)
    given = np.random.default_rng(22).standard_normal(MINUTE)
    filtering = sections(factor)

    def ours() -> tuple[float, float, float]:
        found = evaluate(weighted(given, RATE), RATE)
        return found.a_w, found.mtvv, found.vdv

    def other() -> tuple[float, float, float]:
        fine = sosfilt(filtering, resample_poly(given, factor, 1) if factor > 1 else given)[::factor]
        return float(np.sqrt(np.mean(fine**2))), maximum_transient(fine, RATE), vibration_dose(fine, RATE)

    times = np.array(list(pairs(ours, other)))
    mine, theirs = np.median(times, axis=0) * 1e3
    about = (
        f"{mine:.3g} ms, exact, a_w {ours()[0]:.5g}; {theirs:.3g} ms at {factor} kHz, error {deviation(factor):.1e}, "
    )
    about += f"a_w {other()[0]:.5g}"
    ratio = float(np.median(times[:, 0] / times[:, 1]))
    yield Row("Wk, running r.m.s., VDV of a minute, share of sosfilt's", ratio, "", 0.5, at_least=False, about=about)


def rows() -> Iterator[Row]:
    """All."""
    yield from fits()
    yield from rides()
    yield from prediction()
    yield from comfort()
