"""Checks of the force against a Bingham element: an offset, and a delay against the displacement.

Both compare the force with a coarse reference fit, fine enough to tell an offset or a delay from the damper's own
hysteresis, far too coarse to identify. A delay of 2 ms is found only where the delayed element explains nearly all of
the force, so not on a damper that lacks a law: one test cannot tell the two apart. Several could, for a delay moves the
reversal of the force by the same time everywhere, while friction against a spring or a lash moves it by a displacement
s, which takes sqrt(2 s / a) at the acceleration a of the reversal. Tried on eleven laws with 0.5 and 2 Hz, 20 and 30 mm
and 1 % of noise, the time left at infinite a is -0.3 to 1.4 ms without and 1.8 to 3.4 ms with a delay of 2 ms, but 13
and 15 ms under `rounded_yield`, whose lag is a speed, reached after w / a. With a term for that as well, four tests
leave the time known to +-3 ms only (-8 to 4 ms without a delay). So nothing is reported here; a diagnosis, which fits
whole laws to all tests, names `sensor_delay`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from pzd.artefacts import Finding, RecordEntry
from pzd.damper.element import element_forces
from pzd.record import Array, is_constant, voltage_scale
from pzd.rig.preflight import PreflightRecord
from pzd.rig.preflight.sensors import coarse_step
from pzd.signals.cycles import Cycles
from pzd.signals.kinematics import mean_over_period

# --- Offset ---

OFFSET_SHARE = 0.04
"""Smallest offset that is reported, as a share of half the force's range."""
OFFSET_MEANS = "a tare (fixture: {tare_N: ...} takes it out), a preload, or rebound unlike compression"
ALIKE_OFFSETS = 0.3
"""Offsets that differ by less than this share of the usual one are alike: friction at rest moves them so far."""
LEAST_RECORDS = 3
"""Records from which there is a usual offset."""
BY_CHANCE = 0.02
"""P value below which offsets rise or fall with the speed by no chance: five in order throughout have 1/60."""
LEAST_SLIP = 0.02
"""Least share of the samples at which the element must slip, either way.

Friction that sticks keeps any force within T0 from before the record, which is no offset.
"""


def offset(test: PreflightRecord) -> Iterator[Finding]:
    """Find a force at mid-stroke that a Bingham element, a spring and inertia leave over.

    Equation: F = F_0 + k f(T0/k, C/k) + c_1 x + c_2 a               Source: least squares on a coarse element
    """
    section, fit = reference_fit(test)
    force = section.delayed(np.zeros(1))[0]
    (unit,) = forces_per_stiffness(section, [(fit.friction_extension, fit.lag)])
    slip = min(np.mean(sign * unit > fit.friction_extension) for sign in (1.0, -1.0))
    if slip < LEAST_SLIP or not fit.explains():
        return
    x = section.displacement - 0.5 * float(section.displacement.max() + section.displacement.min())
    columns = (np.ones(x.size), unit, x, np.gradient(np.gradient(x)))
    design = np.stack([column / (np.abs(column).max() or 1.0) for column in columns], axis=1)
    size = float(np.linalg.lstsq(design, force, rcond=None)[0][0])
    low, high = np.percentile(test.record.force, (1, 99))
    share = size / (0.5 * float(high - low) or 1.0)
    if abs(share) > OFFSET_SHARE:
        where = f"force, {share:+.1%} of half its range"
        yield Finding(check="offset", where=where, size=size, unit="N", follows=OFFSET_MEANS)


def explain_offsets(entries: tuple[RecordEntry, ...]) -> tuple[RecordEntry, ...]:
    """Reword the offset of each record by those of the other records of its setting.

    A preload or a gas force is the damper's: the same in every record. Where rebound is unlike compression the offset
    goes with the speed. A tare may change from file to file, and a force and a displacement that are both turned over
    show the offset with the other sign.
    """
    return tuple(_explained(entry, [o for o in entries if o.setting == entry.setting]) for entry in entries)


def _explained(entry: RecordEntry, entries: list[RecordEntry]) -> RecordEntry:
    mine, offsets = _offset_of(entry), [_offset_of(other) for other in entries]
    usual = float(np.median(offsets))
    if mine == 0.0 or len(offsets) < LEAST_RECORDS:
        return entry
    if np.ptp(offsets) <= ALIKE_OFFSETS * abs(usual):
        follows = f"{OFFSET_MEANS}; alike in all {len(offsets)} records of this setting, as a preload or a gas force is"
    elif _rise_with_speed(entries):
        follows = "it goes with the speed of the test, as where rebound is unlike compression; no tare does that"
    elif usual and abs(mine + usual) <= ALIKE_OFFSETS * abs(usual):
        follows = f"{usual:+.4g} N is usual in this setting: force and displacement are both turned over here (sign)"
    elif abs(mine - usual) > ALIKE_OFFSETS * abs(usual):
        follows = f"{usual:+.4g} N is usual in this setting: a tare that changed; take it out of these files (fixture)"
    else:
        return entry
    findings = [f.model_copy(update={"follows": follows}) if f.check == "offset" else f for f in entry.findings]
    return entry.model_copy(update={"findings": tuple(findings)})


def _offset_of(entry: RecordEntry) -> float:
    return next((finding.size for finding in entry.findings if finding.check == "offset"), 0.0)


def _rise_with_speed(entries: list[RecordEntry]) -> bool:
    """Whether the offsets of records rise, or fall, with the speed.

    Equation: the exact probability of Kendall's tau        Source: Kendall 1938, Biometrika 30
    """
    from scipy.stats import kendalltau

    pairs = [(e.velocity_rms_m_per_s or 0.0, _offset_of(e)) for e in entries if _offset_of(e) != 0.0]
    return len(pairs) > LEAST_RECORDS and bool(kendalltau(*zip(*pairs, strict=True)).pvalue <= BY_CHANCE)


# --- Delay ---

LEAST_DELAY = 1e-3
"""Smallest delay that is reported [s]; a smaller one is within the nuisances of a diagnosis."""
SAMPLES = 2.0
"""and the least in samples: the flank of a rigid damper lies between two, and is known to one."""
EXPLAINS = 0.25
"""The delay has to leave less than this share of the squares that the element without it leaves."""
AS_WELL = 2.0
"""A rigid damper without any delay explains the force as well where it leaves less than this times as much."""
SIGMOIDS = (0.001, 0.003, 0.01, 0.03, 0.1, 0.3)
"""Where the friction of a rigid damper is rounded off, as a share of its top speed."""
LONGEST_DELAY = 0.1
"""Largest delay looked for in a motion without cycles [s]; in one with, half a cycle: a longer one is another's."""
TRIES = 61
"""Delays that are tried at first, a sixtieth of a cycle from one to the next,"""
NARROWED = 21
"""and then between the neighbours of the best, so often that they lie closer than half a sample."""
ALIKE_DELAYS = 0.25
"""Delays further than this share from the usual one are no recorder's: what is fitted to them differs as much."""


def delay(test: PreflightRecord) -> Iterator[Finding]:
    """Find a delay of the force against the displacement that a Bingham element asks for."""
    if not is_constant(test.record, voltage_scale([test.record])) or coarse_step(test.record.displacement):
        return  # what coarse steps do to the reversals passes for a delay
    section, undelayed = reference_fit(test)
    if undelayed.residual < LEAST_RESIDUAL:
        return
    size, residual, at_edge = _best_delay(section, 0.5 * test.cycles.period if test.cycles else LONGEST_DELAY)
    least = max(LEAST_DELAY, SAMPLES / test.record.rate, 0.5 * section.step)
    if abs(size) < least or residual > EXPLAINS * undelayed.residual:
        return
    if _residual_of_rigid_damper(section) >= AS_WELL * residual:
        share = 1.0 - residual / undelayed.residual
        edge = ", at the edge of the search: it may be more" if at_edge else ""
        yield Finding(
            check="delay",
            where=f"the force is {'late' if size > 0.0 else 'early'} against the displacement, the whole record{edge}",
            size=size,
            unit="s",
            follows=f"it takes {share:.0%} of what a Bingham element leaves; not corrected",
        )


def _best_delay(section: Section, longest: float) -> tuple[float, float, bool]:
    """Search for the delay of least squares, coarsely and then closer.

    Parameters
    ----------
    section : with the force at any delay
    longest : largest delay to try, either way [s]

    Returns
    -------
    the delay [s], the share of the force's squares that it leaves, and whether it lies at the edge of the search
    """
    step = 2.0 * longest / (TRIES - 1)
    delays = np.linspace(-longest, longest, TRIES)
    best = fit_element(section, section.delayed(delays))
    at_edge = best.number in (0, TRIES - 1)
    size = float(delays[best.number])
    while step > 0.5 * section.step:
        delays = size + np.linspace(-step, step, NARROWED)
        best = fit_element(section, section.delayed(delays))
        size, step = float(delays[best.number]), 2.0 * step / (NARROWED - 1)
    return size, best.residual, at_edge


def drop_contradicting_delays(entries: tuple[RecordEntry, ...]) -> tuple[RecordEntry, ...]:
    """Drop the delays of a setting whose records ask for different ones.

    A recorder is late by the same time in all tests, a hysteresis by an angle or a displacement.
    """
    found: dict[str | None, list[float]] = {}
    for entry in entries:
        found.setdefault(entry.setting, []).extend(f.size for f in entry.findings if f.check == "delay")
    different = {
        setting
        for setting, delays in found.items()
        if delays and np.ptp(delays) > 2.0 * max(ALIKE_DELAYS * abs(np.median(delays)), LEAST_DELAY)
    }
    return tuple(
        entry.model_copy(update={"findings": tuple(f for f in entry.findings if f.check != "delay")})
        if entry.setting in different
        else entry
        for entry in entries
    )


def _residual_of_rigid_damper(section: Section) -> float:
    """Share of the force's squares about its mean that a rigid damper with sigmoid friction leaves, undelayed.

    Equation: F = F_0 + c x + m a + C v + C_a abs(v) + q v abs(v) + sum of T_i tanh(v / v_i)    Source: least squares
    """
    x, force = section.displacement, section.delayed(np.zeros(1))[0]
    v = 0.5 * (np.roll(x, -1) - np.roll(x, 1)) if section.periodic else np.gradient(x)
    top = float(np.percentile(np.abs(v), 99.0)) or 1.0
    rounded = [np.tanh(v / (share * top)) for share in SIGMOIDS]
    columns = [np.ones(x.size), x - x.mean(), np.gradient(v), v, np.abs(v), v * np.abs(v), *rounded]
    design = np.stack([column / (np.linalg.norm(column) or 1.0) for column in columns], axis=1)
    rest = force - design @ np.linalg.lstsq(design, force, rcond=None)[0]
    return float(np.sum(rest**2) / max(np.sum((force - force.mean()) ** 2), 1e-300))


# --- Reference fit of a Bingham element ---

MOST_SAMPLES = 800
"""Samples of the section at most: enough for the shape of its loops."""
RATE = 250.0
"""A record without cycles is read at about this rate [Hz]."""
LEAST_RESIDUAL = 2e-3
"""Share of the force's squares worth explaining: less is noise, or how coarse the element is."""
RIGID = 3e-4
"""Least T0 / k that is tried, as a share of half the stroke: the flank of a rigid damper takes one sample."""
_GRID = (28, 16)
"""Values of T0 / k and of C / k in the first search, each 30 to 50 % above the last."""
_ZOOM = (7, 7)
_ZOOMS = 4
"""Each zoom divides the steps by three: four of them leave 0.3 to 0.5 %, finer than the element is true."""


@dataclass(frozen=True, eq=False)
class Section:
    """Section of a record that the reference is fitted to: its average cycle, or its beginning."""

    step: float
    """Sampling interval [s]."""
    displacement: Array
    """(n,) [m]"""
    delayed: Callable[[Array], Array]
    """Delays (m,) [s] -> the force (m, n) read that much later [N]."""
    periodic: bool
    """Whether the end joins the beginning."""


@dataclass(frozen=True)
class ReferenceFit:
    """Element of least squares over several forces."""

    residual: float
    """Share of the best fitted force's squares about its mean that is left."""
    residual_without_element: float
    """The same of offset, spring and inertia alone."""
    number: int
    """Index of the force that fits best."""
    friction_extension: float
    """T0 / k [m]."""
    lag: float
    """C / k [s]."""

    def explains(self) -> bool:
        """Whether the element takes more than half of a visible residual; else its parameters mean nothing."""
        return self.residual_without_element > LEAST_RESIDUAL and self.residual < 0.5 * self.residual_without_element


_Grid = tuple[Sequence[tuple[float, float]], tuple[float, float], Array]
"""Elements of many T0 / k [m] and C / k [s]: the (g,) pairs, the steps from one to the next in logarithms, and the
forces (g, n) without offset, spring and inertia, of unit length."""


@lru_cache(maxsize=1)
def reference_fit(test: PreflightRecord) -> tuple[Section, ReferenceFit]:
    """Fit the element to the undelayed force of a record; remembered, as both checks ask for it."""
    section = _beginning(test) if test.cycles is None else _average_cycle(test, test.cycles)
    return section, fit_element(section, section.delayed(np.zeros(1)))


def _beginning(test: PreflightRecord) -> Section:
    record = test.record
    every = max(round(record.rate / RATE), 1)
    rows = slice(0, every * MOST_SAMPLES, every)

    def delayed(delays: Array) -> Array:
        return np.stack([np.interp(record.time[rows] + delay, record.time, record.force) for delay in delays])

    return Section(every / record.rate, test.clean.displacement[rows], delayed, periodic=False)


def _average_cycle(test: PreflightRecord, cycles: Cycles) -> Section:
    record = test.record
    steady = test.clean.displacement - mean_over_period(record.time, test.clean.displacement, cycles)
    x, force = cycles.mean(record.time, steady), cycles.mean(record.time, record.force)
    every = -(-x.size // MOST_SAMPLES)
    spectrum, harmonics = np.fft.rfft(force), np.arange(force.size // 2 + 1)

    def delayed(delays: Array) -> Array:
        turn = np.exp(2j * np.pi * np.outer(delays, harmonics) * cycles.frequency)
        return np.asarray(np.fft.irfft(spectrum * turn, force.size, axis=1)[:, ::every])

    return Section(every * cycles.period / x.size, x[::every], delayed, periodic=True)


def fit_element(section: Section, forces: Array) -> ReferenceFit:
    """Fit a Bingham element beside a free offset, spring and inertia, by a grid search that zooms in.

    Parameters
    ----------
    section : the displacement
    forces : (m, n) [N]; the fit is that of the force that is explained best
    """
    free = _free_terms(section.displacement)
    rest = _projected_out(forces, free)
    targets = _normalised(rest)
    centred = forces - forces.mean(axis=1, keepdims=True)
    unexplained: Array = np.sum(rest**2, axis=1) / np.maximum(np.sum(centred**2, axis=1), 1e-300)

    def closest(elements: Array) -> tuple[int, int, float]:
        """Return the indices of the best element and force, and the share of the squares that is left."""
        left = unexplained * (1.0 - np.maximum(elements @ targets.T, 0.0) ** 2)
        element, force = (int(i) for i in np.unravel_index(int(np.argmin(left)), left.shape))
        return element, force, float(left[element, force])

    pairs, steps, elements = _first_grid(section)
    element, force, left = closest(elements)
    for _ in range(_ZOOMS):
        spans = [(np.log(v) - step, np.log(v) + step) for v, step in zip(pairs[element], steps, strict=True)]
        pairs, steps, elements = _grid(section, spans, _ZOOM)
        element, force, left = closest(elements)
    return ReferenceFit(left, float(unexplained[force]), force, *pairs[element])


@lru_cache(maxsize=1)
def _first_grid(section: Section) -> _Grid:
    """Every element that a record may show; remembered, as both fits of a record begin with it."""
    half = 0.5 * float(np.ptp(section.displacement))
    longest = max(2.0 * section.step, min(0.1, 0.1 * section.step * section.displacement.size))
    spans = [(np.log(RIGID * half), np.log(0.7 * half)), (np.log(0.2 * section.step), np.log(longest))]
    return _grid(section, spans, _GRID)


def _grid(section: Section, spans: Sequence[tuple[float, float]], counts: tuple[int, int]) -> _Grid:
    """Elements between the logarithms of two values each."""
    frictions, lags = (np.linspace(*span, count) for span, count in zip(spans, counts, strict=True))
    pairs = [(float(np.exp(u)), float(np.exp(w))) for u in frictions for w in lags]
    forces = _projected_out(forces_per_stiffness(section, pairs), _free_terms(section.displacement))
    return pairs, (float(frictions[1] - frictions[0]), float(lags[1] - lags[0])), _normalised(forces)


def forces_per_stiffness(section: Section, pairs: Sequence[tuple[float, float]]) -> Array:
    """Compute forces (g, n) of elements over their stiffness [m], in the second pass where the motion is periodic.

    Parameters
    ----------
    section : the displacement
    pairs : g of T0 / k [m] and C / k [s]
    """
    x = section.displacement
    passes = np.concatenate((x, x)) if section.periodic else x
    elements = np.column_stack([np.array(pairs), np.ones(len(pairs))])
    return element_forces(passes, section.step, elements)[:, -x.size :]


def _free_terms(x: Array) -> Array:
    """Orthonormal columns (n, 3) of offset, spring and inertia."""
    bend = np.gradient(np.gradient(x))
    return np.asarray(np.linalg.qr(np.stack([np.ones(x.size), x, bend], axis=1))[0])


def _projected_out(forces: Array, free: Array) -> Array:
    """Rows (m, n) without their offset, spring and inertia."""
    return np.asarray(forces - (forces @ free) @ free.T)


def _normalised(rows: Array) -> Array:
    """Rows (m, n) of unit length."""
    return np.asarray(rows / np.maximum(np.linalg.norm(rows, axis=1, keepdims=True), 1e-300))


CHECKS = (offset, delay)
COMPARISONS = (drop_contradicting_delays, explain_offsets)
"""In this order; each looks at its own findings only."""
