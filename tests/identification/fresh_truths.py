"""Rig tests of known dampers, made from the continuous waveform and never through the fit's own interpolation."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.random import Generator

from pzd.damper.compose import respond
from pzd.damper.element import element_force
from pzd.damper.model import BaseRow, Damper
from pzd.damper.motion import Motion
from pzd.identification.bingham_fit import Bingham
from pzd.identification.config import IdentifyConfig
from pzd.paper.published import published
from pzd.record import Array, Record
from pzd.signals.nuisance import NuisanceConfig

RATE = 1000
OVERSAMPLING = 32

TABLE_2 = {0.0: Bingham(301.0, 2720.0, 199e3), 150.0: Bingham(1325.0, 2560.0, 423e3)}

SENSORS_ALIKE = IdentifyConfig(nuisance=NuisanceConfig(offset=0.0, delay_s=0.0, gain=0.0))
"""For tests whose sensors do not differ: what is left to an interval is noise."""


def published_rows() -> list[tuple[Bingham, float, float]]:
    """Parameters, frequency [Hz] and amplitude [m] of each row of Tables 1-3 of the paper."""
    rows: dict[str, dict[str, float]] = {}
    for one in published().values():
        if one.kind == "identified":
            values = rows.setdefault(one.id.rsplit("-", 1)[0], {})
            values |= {one.quantity: one.number, "f": one.frequency_Hz or 0.0, "x": one.amplitude_m or 0.0}
    return [(Bingham(r["T0"], r["C"], r["k"]), r["f"], r["x"]) for r in rows.values()]


def sine_test(
    truth: Bingham,
    frequency: float,
    amplitude: float,
    *,
    cycles: float = 10.0,
    phase: float = 0.0,
    rate: int = RATE,
    voltage: float | None = None,
    name: str = "r",
) -> Record:
    """A sine through the exact element at many times the sampling rate, then thinned to it."""
    count = int(cycles / frequency * rate)
    fine = np.arange(count * OVERSAMPLING + 1) / (rate * OVERSAMPLING)
    angle = 2.0 * np.pi * frequency
    displacement = amplitude * np.sin(angle * fine + phase)
    force = element_force(displacement, 1.0 / (rate * OVERSAMPLING), *truth)[::OVERSAMPLING]
    time, displacement = fine[::OVERSAMPLING], displacement[::OVERSAMPLING]
    velocity = amplitude * angle * np.cos(angle * time + phase)
    held = None if voltage is None else np.full(time.size, voltage)
    return Record(name, None, time, displacement, velocity, -(angle**2) * displacement, force, held)


def moving_test(voltage_at: Callable[[Array], Array], *, seconds: float = 10.0, name: str = "m") -> Record:
    """A 2 Hz sine with a voltage that moves, through the damper of Table 2 between 0 and 150 V."""
    damper = Damper(
        base=tuple(
            BaseRow(voltage_V=u, T0_N=p.friction, C_Ns_per_m=p.damping, k_N_per_m=p.stiffness)
            for u, p in TABLE_2.items()
        )
    )
    fine = np.arange(int(seconds * RATE) * 16 + 1) / (RATE * 16)
    angle = 2.0 * np.pi * 2.0
    x, v = 0.03 * np.sin(angle * fine), 0.03 * angle * np.cos(angle * fine)
    voltage = np.asarray(voltage_at(fine))
    force = respond(damper, Motion(fine, x, v, -(angle**2) * x, voltage, None))
    return Record(name, None, *(c[::16] for c in (fine, x, v, -(angle**2) * x, force, voltage)))


def acceptance_test(rng: Generator) -> tuple[Bingham, tuple[Record, Record]]:
    """Parameters within 20 % of a row of Tables 1-3; the row's own test and ten cycles at 0.5 Hz."""
    rows = published_rows()
    row, frequency, amplitude = rows[rng.integers(len(rows))]
    truth = Bingham(*(float(p) for p in np.array(row) * rng.uniform(0.8, 1.2, 3)))
    phases = rng.uniform(0.0, 2.0 * np.pi, 2)
    return truth, (
        sine_test(truth, frequency, amplitude, phase=float(phases[0])),
        sine_test(truth, 0.5, amplitude, phase=float(phases[1])),
    )


def with_noise(record: Record, rng: Generator, share: float = 0.02, correlation: float = 0.0) -> Record:
    """The record with force noise of that share of r.m.s., an AR(1) of that correlation."""
    size = share * np.sqrt(np.mean(record.force**2))
    return replace(record, force=record.force + size * autoregressive(rng, record.force.size, correlation))


def autoregressive(rng: Generator, count: int, correlation: float) -> Array:
    """Stationary AR(1) noise of unit variance."""
    noise = rng.standard_normal(count) * np.sqrt(1.0 - correlation**2)
    noise[0] /= np.sqrt(1.0 - correlation**2)
    for i in range(1, count if correlation else 0):
        noise[i] += correlation * noise[i - 1]
    return noise
