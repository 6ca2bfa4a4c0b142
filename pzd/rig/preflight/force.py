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

from collections.abc import Iterator
from functools import lru_cache
from typing import Literal

import numpy as np

from pzd.artefacts import Finding, RecordEntry
from pzd.rig.preflight import PreflightRecord
from pzd.rig.preflight.reference import LEAST_RESIDUAL, WORTH, Section, columns, fit_element, reference_fit
from pzd.rig.preflight.sensors import coarse_step

# --- Offset ---

OFFSET_SHARE = 0.04
"""Smallest offset that is reported, as a share of half the force's range."""
OFFSET_MEANS = "a tare (fixture: {tare_N: ...} takes it out), a preload, or rebound unlike compression"
ALIKE_OFFSETS = 0.3
"""Offsets that differ by less than this share of the usual one are alike: friction at rest moves them so far."""
LEAST_RECORDS = 3
"""Records from which there is a usual offset."""
STEADY_OFFSETS = 0.5
"""Share of the largest offset that the least has, of one sign in all records, where most is there at any speed.

Reason: rebound unlike compression alone makes next to nothing in a slow test. Not tuned."""
A_GAS_PUSHES = (
    "; a gas pushes the rod out, a negative force where extension is positive: check which way is rebound "
    "(sign: {displacement: -1, force: -1} turns both)"
)
BY_CHANCE = 0.02
"""P value below which offsets rise or fall with the speed by no chance: five in order throughout have 1/60."""
OF_FEW = 0.34
"""P value of three in order, 1/3: no proof, but reason enough to take nothing out as a tare."""
FEW_IN_ORDER = "it goes with the speed of the few tests, as where rebound is unlike compression"
LEAST_SLIP = 0.02
"""Least share of the samples at which the element must slip, either way.

Friction that sticks keeps any force within T0 from before the record, which is no offset.
"""


def offset(test: PreflightRecord) -> Iterator[Finding]:
    """Find a force at mid-stroke that a Bingham element, a spring and inertia leave over.

    Equation: F = F_0 + k f(T0/k, C/k) + c_1 x + c_2 a               Source: least squares on a coarse element
    """
    if not test.constant_control:
        return
    section, fit = reference_fit(test)
    design = columns(section, fit)[section.shown]
    slip = min(np.mean(sign * design[:, 1] > fit.friction_extension) for sign in (1.0, -1.0))
    if slip < LEAST_SLIP or not fit.explains():
        return
    lengths = np.abs(design).max(axis=0)
    force = section.force[section.shown]
    size = float(np.linalg.lstsq(design / np.where(lengths > 0.0, lengths, 1.0), force, rcond=None)[0][0])
    low, high = np.percentile(test.record.force, (1, 99))
    share = size / (0.5 * float(high - low) or 1.0)
    if abs(share) > OFFSET_SHARE:
        where = f"force, {share:+.1%} of half its range"
        yield Finding(check="offset", where=where, size=size, unit="N", follows=OFFSET_MEANS)


def explain_offsets(entries: tuple[RecordEntry, ...]) -> tuple[RecordEntry, ...]:
    """Reword the offset of each record by those of the other records of its setting.

    A preload or a gas force is the damper's: the same in every record, and seldom in the direction of rebound. Where
    rebound is unlike compression the offset goes with the speed, from nothing at rest. A tare may change from file to
    file, and a force and a displacement that are both turned over show the offset with the other sign.
    """
    shown = [entry for entry in entries if not entry.control_moves]
    return tuple(_explained(entry, [o for o in shown if o.setting == entry.setting]) for entry in entries)


def _explained(entry: RecordEntry, entries: list[RecordEntry]) -> RecordEntry:
    mine, offsets = _offset_of(entry), [_offset_of(other) for other in entries]
    if mine == 0.0 or len(offsets) < LEAST_RECORDS:
        return entry
    usual = float(np.median(offsets))
    # The median of two groups is the offset of neither.
    any_usual = np.mean(np.abs(np.array(offsets) - usual) <= ALIKE_OFFSETS * abs(usual)) > 0.5
    alike = f"in all {len(offsets)} records of this setting, as a preload or a gas force is"
    turned = A_GAS_PUSHES if usual > 0.0 else ""
    chance = _in_order_of(entries, "velocity_rms_m_per_s")
    if np.ptp(offsets) <= ALIKE_OFFSETS * abs(usual):
        follows = f"{OFFSET_MEANS}; alike {alike}{turned}"
    elif chance <= BY_CHANCE or _in_order_of(entries, "force_rms_N") <= BY_CHANCE:
        goes = f"goes with the {'speed' if chance <= BY_CHANCE else 'force'} of the test, as where rebound is unlike "
        follows = f"it {goes}compression; no tare does that"
        if min(np.multiply(offsets, np.sign(usual))) >= STEADY_OFFSETS * max(np.abs(offsets)):
            follows = f"most of it is there {alike}; the rest {goes}compression{turned}"
    elif not any_usual and chance <= OF_FEW:
        follows = f"{FEW_IN_ORDER}; else a tare that changed"
    elif not any_usual:
        return entry
    elif usual and abs(mine + usual) <= ALIKE_OFFSETS * abs(usual):
        follows = f"{usual:+.4g} N is usual in this setting: force and displacement are both turned over here (sign)"
    elif chance <= OF_FEW and abs(mine - usual) > ALIKE_OFFSETS * abs(usual):
        follows = f"{usual:+.4g} N is usual in this setting; {FEW_IN_ORDER}; else a tare that changed"
    elif abs(mine - usual) > ALIKE_OFFSETS * abs(usual):
        follows = f"{usual:+.4g} N is usual in this setting: a tare that changed; take it out of these files (fixture)"
    else:
        return entry
    findings = [f.model_copy(update={"follows": follows}) if f.check == "offset" else f for f in entry.findings]
    return entry.model_copy(update={"findings": tuple(findings)})


def _offset_of(entry: RecordEntry) -> float:
    return next((finding.size for finding in entry.findings if finding.check == "offset"), 0.0)


def _in_order_of(entries: list[RecordEntry], size: Literal["velocity_rms_m_per_s", "force_rms_N"]) -> float:
    """Return the probability that offsets rise, or fall, so orderly with the speed or the force of the test by chance.

    Equation: the exact probability of Kendall's tau        Source: Kendall 1938, Biometrika 30
    """
    from scipy.stats import kendalltau

    pairs = [(getattr(e, size) or 0.0, _offset_of(e)) for e in entries if _offset_of(e) != 0.0]
    return float(kendalltau(*zip(*pairs, strict=True)).pvalue) if len(pairs) >= LEAST_RECORDS else 1.0


# --- Delay ---

LEAST_DELAY = 1e-3
"""Smallest delay that is reported [s]; a smaller one is within the nuisances of a diagnosis."""
SAMPLES = 2.0
"""and the least in samples: the flank of a rigid damper lies between two, and is known to one."""
EXPLAINS = 0.25
"""The delay has to leave less than this share of the squares that the element without it leaves."""
ALL_BUT = 0.02
"""The same where `WORTH` and no more than `LEAST_RESIDUAL` is left: less is how coarse the element is.

Reason: on an oil spring as soft as the delay is long, 20 ms leave 1e-3, which a low-pass explains to a tenth."""
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
ASKED_BY = 0.5
"""Share of the tests that would show a delay of which more have to ask for it: else it is a law that is missing."""
ALIKE_WIDTH = 1.5
"""Ratio up to which two motions are as fast as one another, and of as many frequencies."""
ALIKE_DELAYS = 0.25
"""Delays further than this share from the usual one are no recorder's: what is fitted to them differs as much."""


def delay(test: PreflightRecord) -> Iterator[Finding]:
    """Find a delay of the force against the displacement that a Bingham element asks for."""
    if not test.constant_control or coarse_step(test.record.displacement):
        return  # what coarse steps do to the reversals passes for a delay
    section, undelayed = reference_fit(test)
    if undelayed.residual < WORTH:
        return
    size, residual, at_edge = best_delay(test)
    least = max(LEAST_DELAY, SAMPLES / test.record.rate, 0.5 * section.step)
    explains = EXPLAINS if undelayed.residual >= LEAST_RESIDUAL else ALL_BUT
    if abs(size) < least or residual > explains * undelayed.residual:
        return
    if residual_of_rigid_damper(section) >= AS_WELL * residual:
        share = 1.0 - residual / undelayed.residual
        edge = ", at the edge of the search: it may be more" if at_edge else ""
        yield Finding(
            check="delay",
            where=f"the force is {'late' if size > 0.0 else 'early'} against the displacement, the whole record{edge}",
            size=size,
            unit="s",
            follows=f"it takes {share:.0%} of what a Bingham element leaves; not corrected",
        )


@lru_cache(maxsize=1)
def best_delay(test: PreflightRecord) -> tuple[float, float, bool]:
    """Search for the delay of least squares, coarsely and then closer; remembered, as the low-pass asks for it too.

    Parameters
    ----------
    test : the record, whose force is tried at delays up to half a cycle either way

    Returns
    -------
    the delay [s], the share of the force's squares that it leaves, and whether it lies at the edge of the search
    """
    section, longest = reference_fit(test)[0], 0.5 * test.cycles.period if test.cycles else LONGEST_DELAY
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
    """Drop the delays of a setting whose records ask for different ones, and those that most of their kind do not ask.

    A recorder is late by the same time in all tests, a hysteresis by an angle or a displacement, and a law that is
    missing looks like a delay in single tests.
    """
    found: dict[str | None, list[float]] = {}
    for entry in entries:
        found.setdefault(entry.setting, []).extend(_delays(entry))
    different = {
        setting
        for setting, delays in found.items()
        if delays and np.ptp(delays) > 2.0 * max(ALIKE_DELAYS * abs(np.median(delays)), LEAST_DELAY)
    }

    def contradicted(entry: RecordEntry) -> bool:
        asked = [bool(_delays(other)) for other in entries if _would_show_it(entry, other)]
        return entry.setting in different or sum(asked) <= ASKED_BY * len(asked)

    return tuple(
        entry.model_copy(update={"findings": tuple(f for f in entry.findings if f.check != "delay")})
        if _delays(entry) and contradicted(entry)
        else entry
        for entry in entries
    )


def _delays(entry: RecordEntry) -> list[float]:
    return [finding.size for finding in entry.findings if finding.check == "delay"]


def _would_show_it(entry: RecordEntry, other: RecordEntry) -> bool:
    """Whether another test of the same level shows a delay as well as one does: as fast, and of as many frequencies.

    In a sine a delay is nearly a softer spring.
    """
    same_level = (
        entry.voltage_V is None or other.voltage_V is None or np.isclose(entry.voltage_V, other.voltage_V, 0.05)
    )
    (speed, width), (its_speed, its_width) = _speed_and_width(entry), _speed_and_width(other)
    alike = max(width, its_width) <= ALIKE_WIDTH * min(width, its_width)
    return entry.setting == other.setting and bool(same_level) and alike and ALIKE_WIDTH * its_speed >= speed


def _speed_and_width(entry: RecordEntry) -> tuple[float, float]:
    """Return r.m.s. speed over displacement [1/s], and acceleration over speed as a multiple of it: 1 of a sine."""
    x, v, a = entry.displacement_rms_m, entry.velocity_rms_m_per_s, entry.acceleration_rms_m_per_s2
    return (v / x, a * x / v**2) if x and v and a else (0.0, 1.0)


def residual_of_rigid_damper(section: Section) -> float:
    """Share of the force's squares about its mean that a rigid damper with sigmoid friction leaves, undelayed.

    Equation: F = F_0 + c x + m a + C v + C_a abs(v) + q v abs(v) + sum of T_i tanh(v / v_i)    Source: least squares
    """
    x, force = section.displacement, section.force[section.shown]
    v = np.gradient(x)
    top = float(np.percentile(np.abs(v), 99.0)) or 1.0
    rounded = [np.tanh(v / (share * top)) for share in SIGMOIDS]
    laws = [np.ones(x.size), x - x.mean(), np.gradient(v), v, np.abs(v), v * np.abs(v), *rounded]
    design = np.stack([law / (np.linalg.norm(law) or 1.0) for law in laws], axis=1)[section.shown]
    rest = force - design @ np.linalg.lstsq(design, force, rcond=None)[0]
    return float(np.sum(rest**2)) / section.squares


CHECKS = (offset, delay)
COMPARISONS = (drop_contradicting_delays, explain_offsets)
"""In this order; each looks at its own findings only."""
