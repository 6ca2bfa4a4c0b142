"""Whether the force stands off zero: a tare, a preload, gas pressure."""

from __future__ import annotations

import numpy as np

from pzd.artefacts import Finding, RecordEntry
from pzd.rig.preflight import Measured
from pzd.rig.reference_fit import fit_reference, unit_forces

SHARE = 0.04
"""Offset that is said, as a share of half the force's range."""
FOLLOWS = "a tare (fixture: {tare_N: ...} takes it out), a preload, or rebound unlike compression"
ALIKE = 0.3
"""Offsets that differ by less than this share of the usual one are alike: friction at rest moves them so far."""
LEAST_RECORDS = 3
"""Records from which there is a usual offset."""
BY_CHANCE = 0.02
"""Probability below which offsets rise or fall with the speed by no chance: five in order throughout have 1/60."""
SLIPS = 0.02
"""Least share of the samples at which the element must slip, either way.

Friction that sticks keeps any force within T0 from before the record, which is no offset.
"""


def check(test: Measured) -> list[Finding]:
    """The force that is left at mid-stroke beside a Bingham element, a spring and inertia.

    Equation: F = F_0 + k f(T0/k, C/k) + c_1 x + c_2 a               Source: least squares on a coarse element
    """
    part, element = fit_reference(test)
    force = part.force_later(np.zeros(1))[0]
    (unit,) = unit_forces(part, [(element.friction_extension, element.lag)])
    slips = min(np.mean(sign * unit > element.friction_extension) for sign in (1.0, -1.0))
    if slips < SLIPS or not element.explains():
        return []
    x = part.displacement - 0.5 * float(part.displacement.max() + part.displacement.min())
    bend = np.gradient(np.gradient(x))
    columns = (np.ones(x.size), unit, x, bend)
    design = np.stack([column / (np.abs(column).max() or 1.0) for column in columns], axis=1)
    offset = float(np.linalg.lstsq(design, force, rcond=None)[0][0])
    low, high = np.percentile(test.record.force, (1, 99))
    share = offset / (0.5 * float(high - low) or 1.0)
    if abs(share) <= SHARE:
        return []
    return [
        Finding(
            check="offset",
            where=f"force, {share:+.1%} of half its range",
            size=offset,
            unit="N",
            follows=FOLLOWS,
        )
    ]


def compared(entries: tuple[RecordEntry, ...]) -> tuple[RecordEntry, ...]:
    """The same entries, in which the offset of a record is compared with those of the other records of its setting.

    A preload or a gas force is the damper's: the same in every record. Where rebound is unlike compression the offset
    goes with the speed. A tare may change from file to file, and a force and a displacement that are both turned over
    show the offset with the other sign.
    """
    return tuple(_compared(entry, [o for o in entries if o.setting == entry.setting]) for entry in entries)


def _offset(entry: RecordEntry) -> float:
    return next((finding.size for finding in entry.findings if finding.check == "offset"), 0.0)


def _by_speed(entries: list[RecordEntry]) -> bool:
    """Whether the offsets of records rise, or fall, with the speed.

    Equation: the exact probability of Kendall's tau        Source: Kendall 1938, Biometrika 30
    """
    from scipy.stats import kendalltau

    said = [(e.velocity_rms_m_per_s or 0.0, _offset(e)) for e in entries if _offset(e) != 0.0]
    return len(said) > LEAST_RECORDS and bool(kendalltau(*zip(*said, strict=True)).pvalue <= BY_CHANCE)


def _compared(entry: RecordEntry, entries: list[RecordEntry]) -> RecordEntry:
    mine, offsets = _offset(entry), [_offset(other) for other in entries]
    usual = float(np.median(offsets))
    if mine == 0.0 or len(offsets) < LEAST_RECORDS:
        return entry
    if np.ptp(offsets) <= ALIKE * abs(usual):
        follows = f"{FOLLOWS}; alike in all {len(offsets)} records of this setting, as a preload or a gas force is"
    elif _by_speed(entries):
        follows = "it goes with the speed of the test, as where rebound is unlike compression; no tare does that"
    elif usual and abs(mine + usual) <= ALIKE * abs(usual):
        follows = f"{usual:+.4g} N is usual in this setting: force and displacement are both turned over here (sign)"
    elif abs(mine - usual) > ALIKE * abs(usual):
        follows = f"{usual:+.4g} N is usual in this setting: a tare that changed; take it out of these files (fixture)"
    else:
        return entry
    findings = [f.model_copy(update={"follows": follows}) if f.check == "offset" else f for f in entry.findings]
    return entry.model_copy(update={"findings": tuple(findings)})
