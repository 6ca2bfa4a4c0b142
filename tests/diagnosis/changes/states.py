"""States of a damper for the tests of `pzd changes`: from rigid to soft, from friction to viscous, with noise."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from pzd.artefacts import Rig
from pzd.artefacts.changes import Change, Changes
from pzd.damper.compose import respond
from pzd.damper.model import BaseRow, Damper
from pzd.damper.motion import Motion
from pzd.diagnosis.changes.comparison import changes_between
from pzd.diagnosis.changes.findings import findings_between
from pzd.diagnosis.changes.regression import Likelihood
from pzd.diagnosis.changes.state import State
from pzd.diagnosis.config import DiagnoseConfig
from pzd.identification.config import IdentifyConfig
from pzd.identification.stage import identify
from pzd.quantities import Control
from pzd.record import Record

MOTIONS = ((0.5, 0.02), (2.0, 0.02), (2.0, 0.03))
FORCE, SPEED, STROKE = 2000.0, 0.4, 0.03


def drawn_damper(rng: np.random.Generator, voltages: tuple[float, ...] = (0.0, 100.0)) -> Damper:
    """T0 from next to nothing to nine tenths of 2 kN, the oil spring from a third of the stroke to rigid."""
    rows, share = [], rng.uniform(0.05, 0.9)
    stretch = float(np.exp(rng.uniform(np.log(0.002), np.log(0.1)))) * STROKE
    for i, voltage in enumerate(voltages):
        force = FORCE * (0.4 if i == 0 else 1.0)
        friction = share * force
        rows.append(
            BaseRow(voltage_V=voltage, T0_N=friction, C_Ns_per_m=(force - friction) / SPEED, k_N_per_m=FORCE / stretch)
        )
    return Damper(base=tuple(rows))


def campaign(
    damper: Damper, rng: np.random.Generator, motions: Iterable[tuple[float, float]] = MOTIONS, scatter: float = 0.002,
    noise: float = 0.003,
) -> tuple[Record, ...]:  # fmt: skip
    """Sines at every voltage; `scatter` is that of the gain from test to test, of the offset a quarter of it."""
    return tuple(
        sine(damper, row.voltage_V, f, x, rng, noise, scatter)
        for row in damper.base
        for f, x in motions
    )  # fmt: skip


def sine(
    damper: Damper, voltage: float | None, frequency: float, amplitude: float, rng: np.random.Generator, noise: float,
    scatter: float, cycles: int = 6, rate: float = 500.0,
) -> Record:  # fmt: skip
    """A test from the continuous waveform, two cycles after it began, with white noise of force and displacement."""
    finer = 8
    fine = np.arange(-2.0 / frequency, cycles / frequency, 1.0 / (rate * finer))
    w = 2.0 * np.pi * frequency
    x, v, a = amplitude * np.sin(w * fine), amplitude * w * np.cos(w * fine), -amplitude * w**2 * np.sin(w * fine)
    control = None if voltage is None else np.full(fine.size, voltage)
    force = respond(damper, Motion(fine, x, v, a, control))
    kept = np.flatnonzero(fine >= -1e-9)[::finer]
    t, x, v, a, force = (each[kept] for each in (fine, x, v, a, force))
    peak, draw = float(np.max(np.abs(force))), rng.standard_normal
    measured = (1.0 + scatter * draw()) * force + 0.25 * scatter * peak * draw() + noise * peak * draw(t.size)
    name = f"{voltage or 0.0:g}V-{frequency:g}Hz-{1e3 * amplitude:g}mm"
    recorded = None if voltage is None else np.full(t.size, voltage)
    return Record(name, None, t, x + 2e-6 * draw(t.size), v, a, measured, recorded)


def state_of(name: str, records: Iterable[Record], config: IdentifyConfig | None = None) -> State:
    rig = Rig(tuple(records), ())
    return State.of(name, rig, identify(config or IdentifyConfig(), rig, 1), None, Control())


def found(before: Iterable[Record], after: Iterable[Record], config: IdentifyConfig | None = None) -> Changes:
    """What changed, the first state identified and not diagnosed."""
    states = state_of("new", before, config), state_of("aged", after, config)
    return changes_between(*states, DiagnoseConfig(), config or IdentifyConfig(), Control()).changes


def likelihood_between(before: Iterable[Record], after: Iterable[Record]) -> Likelihood:
    """Likelihood of the differences between two states."""
    states = state_of("new", before), state_of("aged", after)
    return findings_between(*states, DiagnoseConfig(), IdentifyConfig(), Control()).search.regression.likelihood


def scaled(damper: Damper, **factors: float) -> Damper:
    rows = (row.model_copy(update={n: getattr(row, n) * f for n, f in factors.items()}) for row in damper.base)
    return damper.model_copy(update={"base": tuple(rows)})


def names(changes: Changes, of: str = "damper") -> list[str]:
    return list(dict.fromkeys(c.name for c in changes.changes if c.of == of))


def names_told(changes: Changes) -> set[str]:
    """Names in what changed and among its rivals."""
    return {c.name for c in changes.changes} | set(changes.rivals)


def inside(change: Change, ratio: float, slack: float = 1.0) -> bool:
    """Whether a ratio of `to` to `from` lies in the interval, widened by a factor, at every voltage."""
    columns = (change.from_, change.to, change.low95, change.high95)
    start, to, low, high = (np.atleast_1d(np.asarray(each, dtype=float)) for each in columns)
    half = 0.5 * slack * (high - low)
    return bool(np.all(np.abs(to - ratio * start) <= half + 1e-9))
