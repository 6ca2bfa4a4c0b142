"""Slopes of the fit: the error of the simulation is small beside the change of force over a step of the search."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from numpy.random import Generator

from pzd.damper.compose import respond
from pzd.damper.model import BaseRow, Damper
from pzd.damper.motion import Motion
from pzd.diagnose.campaign import Campaign
from pzd.diagnose.data.cleaning import prepare
from pzd.diagnose.data.split import split
from pzd.diagnose.fit import likelihood
from pzd.diagnose.fit.least_squares import fit
from pzd.diagnose.fit.parameters import Problem
from pzd.diagnose.search.evidence import evidence_of
from pzd.record import Array, Record
from pzd.signals.kinematics import kinematics
from pzd.signals.nuisance import NuisanceConfig

ROW = BaseRow(voltage_V=0.0, T0_N=400.0, C_Ns_per_m=2500.0, k_N_per_m=4.0e5)
ROUNDED = Damper(base=(ROW,), effects={"rounded_yield": {"w_s": 0.003}})
CHARGED = Damper(base=(ROW,), effects={"gas_spring": {"k_g": 1330.0}})


def problem(damper: Damper, tones: Sequence[tuple[float, float]], rng: Generator) -> Problem:
    """Two tones of those amplitudes [m] and frequencies [Hz], sampled at 500 Hz, with 5 N of noise."""
    t = np.arange(0.0, 10.0, 1.0 / 500.0)
    x = np.sum([a * np.sin(2.0 * np.pi * f * t) for a, f in tones], axis=0)
    clean = kinematics(t, x, None)
    volts = np.zeros(t.size)
    force = respond(damper, Motion(t, x, clean.velocity, clean.acceleration, volts))
    measured = force + 5.0 * rng.standard_normal(t.size)
    tests = prepare((Record("two tones", None, t, x, clean.velocity, clean.acceleration, measured, volts),))
    return evidence_of(Campaign(tests, split(tests, None, 2.0), NuisanceConfig()), damper).whole


def test_slopes_of_a_rounded_yield_are_those_of_an_exact_simulation(
    rng: Generator, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In two tones the flow turns twenty times a second: a step of the search moves when, and the errors jump."""
    asked = problem(ROUNDED, ((0.015, 1.0), (0.002, 10.03)), rng)
    start = asked.start_with(ROUNDED)

    def slopes() -> Array:
        # Made anew, as an observation remembers the forces that it gave.
        anew = tuple(replace(o) for o in asked.observations)
        return fit(replace(asked, observations=anew), ("rounded_yield",), start, evaluations=1).slopes

    found = slopes()
    monkeypatch.setattr(likelihood, "SIMULATION_TOLERANCE", 1e-12)
    exact = slopes()
    assert np.all(np.linalg.norm(found - exact, axis=0) < 0.01 * np.linalg.norm(exact, axis=0))


def test_a_factor_common_to_all_forces_moves_them_in_proportion(rng: Generator) -> None:
    """The gain of a test leaves this one direction nearly open, where a search goes by what little is left of it."""
    asked = problem(CHARGED, ((0.01, 1.38), (0.01, 1.42)), rng)
    start = asked.start_with(CHARGED)
    found = fit(asked, ("gas_spring",), start, evaluations=1)
    friction, _, _, charge = start
    along = found.slopes @ np.array([friction, 1.0, 1.0, charge])
    exact = [-o.in_noise(force) for o, force in zip(asked.observations, found.simulated, strict=True)]
    assert np.linalg.norm(along - np.concatenate(exact)) < 0.02 * np.linalg.norm(along)
