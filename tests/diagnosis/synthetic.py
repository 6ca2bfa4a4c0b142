"""Synthetic rig records of a known damper, made from the continuous waveform, and their diagnosis."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from pzd.artefacts import Diagnosed, Rig
from pzd.damper.compose import respond
from pzd.damper.effects import library
from pzd.damper.model import BaseRow, Damper
from pzd.damper.motion import Motion
from pzd.diagnosis.campaign import Campaign, evidence_of
from pzd.diagnosis.cleaned_records import clean
from pzd.diagnosis.config import DiagnoseConfig
from pzd.diagnosis.fit.problem import Problem
from pzd.diagnosis.roles import split
from pzd.diagnosis.stage import diagnose
from pzd.identification.config import IdentifyConfig
from pzd.identification.stage import identify
from pzd.quantities import Control
from pzd.record import Array, Record
from pzd.rig.config import FilesEntry, RigConfig
from pzd.signals.nuisance import NuisanceConfig

TWO = (0.0, 150.0)
"""The voltages of most tests: the least and the largest friction."""
FINER = 16
TABLE_2 = {0.0: (301.0, 2720.0, 199e3), 50.0: (356.0, 3300.0, 358e3), 100.0: (796.0, 3040.0, 375e3),
           150.0: (1325.0, 2560.0, 423e3)}  # fmt: skip


def damper_of(voltages: Sequence[float] = tuple(TABLE_2), **effects: dict[str, float]) -> Damper:
    rows = (BaseRow(voltage_V=U, T0_N=TABLE_2[U][0], C_Ns_per_m=TABLE_2[U][1], k_N_per_m=TABLE_2[U][2])
            for U in voltages)  # fmt: skip
    return Damper(base=tuple(rows), effects=dict(effects))


def coloured(rng: np.random.Generator, count: int, level: float, colour: float) -> Array:
    """Noise of that r.m.s., e_i = colour e_(i-1) + w_i."""
    from scipy.signal import lfilter

    white = rng.standard_normal(count + 2000)
    return np.asarray(level * np.sqrt(1.0 - colour**2) * lfilter([1.0], [1.0, -colour], white)[2000:])


def sine(
    damper: Damper,
    voltage: float,
    frequency: float,
    amplitude: float,
    rng: np.random.Generator,
    *,
    noise: float = 0.01,
    colour: float = 0.9,
    cycles: int = 8,
    rate: float = 1000.0,
    displacement_noise: float = 0.0,
    gain: float = 1.0,
    offset: float = 0.0,
) -> Record:
    """A sine test; noise and offset as shares of the peak force."""
    lead = 2.0 / frequency
    fine = np.arange(-lead, cycles / frequency, 1.0 / (rate * FINER))
    x, v, a = waveform(fine, frequency, amplitude)
    U = np.full(fine.size, voltage)
    force = respond(damper, Motion(fine, x, v, a, U))[::FINER]
    t = fine[::FINER]
    keep = t >= 0.0
    t, force = t[keep], force[keep]
    x, v, a = waveform(t, frequency, amplitude)
    peak = float(np.max(np.abs(force)))
    measured = gain * force + offset * peak + coloured(rng, t.size, noise * peak, colour)
    return Record(
        f"s{voltage:g}V-{frequency:g}Hz-{1e3 * amplitude:g}mm", None, t,
        x + displacement_noise * rng.standard_normal(t.size), v, a, measured, np.full(t.size, voltage),
    )  # fmt: skip


def waveform(time: Array, frequency: float, amplitude: float) -> tuple[Array, Array, Array]:
    w = 2.0 * np.pi * frequency
    return (
        amplitude * np.sin(w * time),
        amplitude * w * np.cos(w * time),
        -amplitude * w**2 * np.sin(w * time),
    )


def sines(
    damper: Damper, rng: np.random.Generator, voltages: Sequence[float] = tuple(TABLE_2), jitter: float = 0.0,
    tests: Sequence[tuple[float, float]] = ((0.5, 0.02), (0.5, 0.03), (2.0, 0.02), (2.0, 0.03)),
    noise: float = 0.01, colour: float = 0.9, displacement_noise: float = 0.0, cycles: int = 8,
) -> tuple[Record, ...]:  # fmt: skip
    """Two frequencies by two amplitudes at every voltage; `jitter` is the test-to-test scatter of the gain."""
    return tuple(
        sine(damper, U, f, x, rng, noise=noise, colour=colour, displacement_noise=displacement_noise, cycles=cycles,
             gain=1.0 + jitter * rng.standard_normal(), offset=jitter / 4.0 * rng.standard_normal())
        for U in voltages
        for f, x in tests
    )  # fmt: skip


def campaign_of(records: Iterable[Record]) -> Campaign:
    cleaned = clean(tuple(records))
    return Campaign(cleaned, split(cleaned, None, 2.0), NuisanceConfig())


STAND = RigConfig(files=(FilesEntry(path="*.csv"),))
"""A rig whose files say nothing of the stand."""


def all_but(*effects: str) -> tuple[str, ...]:
    """What to forbid where the claim needs few candidates: most of a diagnosis is their fits."""
    return tuple(sorted(set(library()) - set(effects)))


def problem_of(records: Iterable[Record]) -> Problem:
    """The least-squares problem of tests at one voltage, weighed by what the baseline leaves."""
    return evidence_of(campaign_of(records), damper_of((0.0,))).whole


def diagnosed(records: Rig | Iterable[Record], jobs: int = 1, **config: object) -> Diagnosed:
    """The diagnosis of records of one setting, alone or with what the preflight found; `config` is its block."""
    rig = records if isinstance(records, Rig) else Rig(tuple(records), ())
    settings = DiagnoseConfig.model_validate(config)
    return diagnose(settings, IdentifyConfig(), STAND, rig, identify(IdentifyConfig(), rig, 1), Control(), None, jobs)
