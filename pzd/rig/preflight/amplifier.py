"""Checks of what an amplifier or a logger does to the whole force: a low-pass, soft saturation, a range that ends.

Each holds a reference that the channel shows so against the same reference as it is. A damper that lacks a law may
look alike in one record: what is found says what else it may be, and a low-pass whose corner differs from record to
record is none. A viscous damper alone behind a low-pass of first order is one on an oil spring, of k = 2 pi f C, to the
last digit: there nothing can be found.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from pzd.artefacts import Finding, RecordEntry
from pzd.record import MAD_TO_SIGMA, Array
from pzd.rig.preflight import PreflightRecord
from pzd.rig.preflight.force import best_delay
from pzd.rig.preflight.reference import WORTH, ReferenceFit, Section, columns, fit_element, reference_fit, sampled_fit
from pzd.rig.preflight.sensors import coarse_step

WORTH_OF_RANGE = 4e-5
"""As `WORTH`, beyond noise, for a range that ends.

Reason: half of what is left where friction is half of the peak and a fifth of the peak is missing, so that C is a third
too low; the grid, once closer, leaves less than a quarter of it."""
CLEAR = 5.0
"""Standard errors of the noise's share that a residual exceeds it by: one of the dozens of ranges always fits some."""
EXPLAINS = 0.25
"""What the channel does has to leave less than this share of what the reference leaves without it."""


def amplifier(test: PreflightRecord) -> Iterator[Finding]:
    """Find what a channel does to the whole force, where it explains most of what the reference leaves."""
    if not test.constant_control or coarse_step(test.record.displacement):
        return
    # The average cycle has less noise: where it leaves nothing to explain, the samples need no fit.
    if test.cycles is not None and reference_fit(test)[1].residual < WORTH_OF_RANGE:
        return
    section, plain = sampled_fit(test)
    noise = _noise(test, section)
    chance = CLEAR * noise * np.sqrt(2.0 / np.count_nonzero(section.shown))
    if plain.residual - noise < max(WORTH_OF_RANGE, chance):
        return
    found = [_saturation(section)]
    if plain.residual - noise >= WORTH:
        found.append(_low_pass(section, plain, test.cycles.frequency if test.cycles else 1.0))
    best, finding = min(found, key=lambda one: one[0].residual)
    if finding is None:
        return
    # The same element, and those near it, without what the channel does: the plain search may have missed them.
    without = fit_element(section, section.force[None], start=(best.friction_extension, best.lag)).residual
    beyond, left = min(plain.residual, without) - noise, best.residual
    if beyond < max(WORTH_OF_RANGE, chance) or left - noise >= EXPLAINS * beyond:
        return
    if finding.check == "filter" and (_rounded_yield(section) < max(left, WORTH) or _late(test, section) < left):
        return
    yield finding


def _noise(test: PreflightRecord, section: Section) -> float:
    """Return the noise as a share of the force's squares, from the differences of adjacent cycles; 0 without cycles.

    By their median: where a rigid damper turns, its force jumps at another sample in each cycle.
    """
    if test.cycles is None:
        return 0.0
    apart = np.diff(test.cycles.fold(test.record.time, test.record.force), axis=0)
    deviation = MAD_TO_SIGMA * float(np.median(np.abs(apart)))
    return 0.5 * deviation**2 * np.count_nonzero(section.shown) / section.squares


# --- A low-pass of the force ---

ORDERS = (1, 2)
"""Of the low-pass: an RC circuit; Butterworth's of second order, which stands for steeper ones too."""
CORNERS = 8
"""Corners that are tried at first, from the motion's frequency to a tenth of the rate."""
SLOWEST_CORNER = 2.0
"""Least corner of a finding, as a multiple of the motion's frequency.

Reason: nobody records a motion through a filter that takes it away, and a stroke without force looks alike (a shock
with air in its oil at 1.18 Hz "behind 1.43 Hz"); not tuned."""
CLOSER = 7
"""Corners and delays that are tried about the best one."""
DELAYS = (-1.0, -0.5, 0.0, 0.5)
"""Delays beside the low-pass, as shares of its own: -1 where it runs both ways, or the displacement has one too."""
ALIKE_CORNERS = 2.0
"""Corners further apart than this factor are no amplifier's;"""
LEAST_RECORDS = 1.0 / 3.0
"""nor is what fewer than this share of the records show: only a force without friction hides it."""


def _low_pass(section: Section, plain: ReferenceFit, slowest: float) -> tuple[ReferenceFit, Finding | None]:
    """Fit a low-pass of the force behind the element, which turns within a sample or over the travel of an oil spring.

    Equation: F = H(s) (F_0 + k f(T0/k, C/k) + c_1 x + c_2 a), H Butterworth's     Source: least squares

    Parameters
    ----------
    section, plain : the samples, and the reference without a low-pass
    slowest : least corner [Hz]

    Returns
    -------
    the element behind it, and what to say of it
    """
    corners = np.geomspace(slowest, max(0.1 / section.step, 2.0 * slowest), CORNERS)
    tried = [(_behind(section, order, corner), order, corner) for order in ORDERS for corner in corners]
    best, order, corner = min(tried, key=lambda one: one[0].residual)
    if best.residual > 2.0 * EXPLAINS * plain.residual:
        return best, None
    nearer = corner * (corners[1] / corners[0]) ** np.linspace(-1.0, 1.0, CLOSER)
    best, corner = min(((_behind(section, order, one, 2), one) for one in nearer), key=lambda one: one[0].residual)
    if corner < SLOWEST_CORNER * slowest:
        return best, None
    return best, Finding(
        check="filter",
        where=f"force, the whole record, as behind a low-pass of {'first' if order == 1 else 'second'} order",
        size=float(corner),
        unit="Hz",
        follows=f"it takes {1.0 - best.residual / plain.residual:.0%} of what a Bingham element leaves; not corrected, "
        "and k is too low: record the force without the filter, or every channel through the same one",
    )


ROUNDINGS = np.geomspace(0.003, 1.0, 16)
"""Speeds at which a yield is rounded that are tried, as shares of the largest: a quarter off is near enough."""


def _rounded_yield(section: Section) -> float:
    """Return the share of the squares left by a yield that is rounded, as in magneto-rheological dampers.

    A low-pass without delay turns the sign of a reversal into the same curve, where there is one motion alone.

    Equation: F = F_0 + T0 tanh(v / w_s) + C v + c_1 x + c_2 a     Source: least squares
    """
    x, force = section.displacement, section.force[section.shown]
    v = np.gradient(x, section.step)
    smooth = [np.ones(x.size), x, v, np.gradient(v, section.step)]
    shares = []
    for rounding in ROUNDINGS * float(np.abs(v).max()):
        design = np.stack([*smooth, np.tanh(v / rounding)], axis=1)[section.shown]
        design /= np.maximum(np.linalg.norm(design, axis=0), 1e-300)
        rest = force - design @ np.linalg.lstsq(design, force)[0]
        shares.append(float(rest @ rest) / section.squares)
    return min(shares)


def _late(test: PreflightRecord, section: Section) -> float:
    """Return the share of the squares left by a force that is late, and as it is otherwise."""
    return fit_element(section, section.delayed(np.array([best_delay(test)[0]]))).residual


def _behind(section: Section, order: int, corner: float, zooms: int = 1) -> ReferenceFit:
    """Fit the element behind a low-pass."""
    from scipy.signal import butter, lfilter, lfilter_zi  # half a second, and few records come so far

    b, a = butter(order, min(2.0 * corner * section.step, 0.9))
    start = lfilter_zi(b, a)

    def passed(rows: Array) -> Array:
        return np.asarray(lfilter(b, a, rows, axis=1, zi=rows[:, :1] * start)[0])

    own = order**0.5 / (2.0 * np.pi * corner)
    return fit_element(replace(section, passed=passed), section.delayed(own * np.array(DELAYS)), zooms)


def drop_contradicting_filters(entries: tuple[RecordEntry, ...]) -> tuple[RecordEntry, ...]:
    """Drop the low-passes of a rig whose records ask for different ones, or most for none: a law that is missing."""
    corners = [finding.size for entry in entries for finding in entry.findings if finding.check == "filter"]
    if not corners or (max(corners) <= ALIKE_CORNERS * min(corners) and len(corners) >= LEAST_RECORDS * len(entries)):
        return entries
    return tuple(
        entry.model_copy(update={"findings": tuple(f for f in entry.findings if f.check != "filter")})
        for entry in entries
    )


# --- A force that grows less the larger it is ---

SATURATES_AT = (1.01, 1.02, 1.04, 1.07, 1.12, 1.2, 1.35, 1.6, 2.2, 4.0)
"""Where a soft amplifier saturates, as multiples of the largest force that it shows."""
CLOSER_LIMITS = 1.15
"""Factor about the best of them within which it is looked for more closely."""
CLOSEST = 4
"""Zooms of the grid at the best range: as many as of the reference without one."""
CUT_SHARES = (0.04, 0.08, 0.12, 0.16, 0.2, 0.25, 0.3, 0.34, 0.37, 0.4)
"""Shares of the samples, at either end, that may be cut off: of more, friction alone is flat too."""
LEAST_BETWEEN = 20
"""Fewest samples between the ends, for the four columns of the reference."""
LEAST_CUT, LARGEST_CUT = 0.03, 1.0
"""Least and largest share of the force shown that is missing at the peak.

Reason: a load cell is good to less than the least; of a force that stays flat any amount might be missing."""


def _saturation(section: Section) -> tuple[ReferenceFit, Finding | None]:
    """Fit a force that bends over or is cut off near its peaks, with noise on top of it.

    Equation: F = F_s tanh(f / F_s), or F = f between two limits, f the element beside offset, spring, inertia
    Source: least squares

    Parameters
    ----------
    section : the samples

    Returns
    -------
    the element in front of it, and what to say of it
    """
    peak = float(np.abs(section.force).max())
    soft_left, soft = min((_bent(section, share * peak)[0].residual, share) for share in SATURATES_AT)
    hard_left, hard = min((_cut(section, share)[0].residual, share) for share in CUT_SHARES)
    cut = hard_left < soft_left
    if cut:
        best, missing = _cut(section, hard, CLOSEST)
    else:
        closer = np.maximum(soft * np.geomspace(1.0 / CLOSER_LIMITS, CLOSER_LIMITS, CLOSER), SATURATES_AT[0])
        tried = [_bent(section, float(share) * peak, CLOSEST) for share in closer]
        best, missing = min(tried, key=lambda one: one[0].residual)
    if not LEAST_CUT * peak <= missing <= LARGEST_CUT * peak:
        return best, None
    return best, Finding(
        check="range",
        where=f"force, {'cut off' if cut else 'bends over'} near {peak:.4g} N beneath its noise",
        size=missing,
        unit="N",
        follows="so much is missing at the peak, and of C as well, if the amplifier saturates; where a larger range "
        "shows the same, the damper itself gives way (relief valve, shear thinning), or gas hardens at the other end",
    )


def _bent(section: Section, limit: float, zooms: int = 2) -> tuple[ReferenceFit, float]:
    """Return the element in front of a soft amplifier of a limit [N], and what is missing at the peak [N]."""
    shown = np.clip(section.force / limit, -0.9999, 0.9999)
    straight = limit * np.arctanh(shown)
    fit = fit_element(replace(section, weights=1.0 - shown**2), straight[None], zooms)
    return fit, float(np.abs(straight).max() - np.abs(section.force).max())


def _cut(section: Section, share: float, zooms: int = 2) -> tuple[ReferenceFit, float]:
    """Return the element where so many samples are cut off at each end, and what is missing there [N]."""
    force = section.force
    low, high = np.quantile(force[section.shown], (share, 1.0 - share))
    ends = [section.shown & (force >= high), section.shown & (force <= low)]
    between = replace(section, shown=section.shown & (force < high) & (force > low))
    if np.count_nonzero(between.shown) < LEAST_BETWEEN:
        return ReferenceFit(np.inf, np.inf, 0, 1.0, 1.0), 0.0
    fit = fit_element(between, force[None], zooms)
    design = columns(between, fit)
    whole = design @ np.linalg.lstsq(design[between.shown], force[between.shown], rcond=None)[0]
    flat = sum(float(np.sum((force[rows] - np.median(force[rows])) ** 2)) for rows in ends)
    missing = min(float(np.max(sign * (whole - force)[rows])) for sign, rows in zip((1.0, -1.0), ends, strict=True))
    return replace(fit, residual=(fit.residual * between.squares + flat) / section.squares), missing


AS_MUCH = 1.5
"""Multiple of the share that is missing in a test of less force, up to which a test of more bends over as that does.

Reason: what is missing beneath the limit of an amplifier grows many times faster than the force."""


def drop_contradicting_ranges(entries: tuple[RecordEntry, ...]) -> tuple[RecordEntry, ...]:
    """Drop the ranges that a record of a larger force goes beyond: a damper gives way there, and no amplifier.

    By the peaks: where every test is cut off at one force, the faster has the larger r.m.s., and not the larger force.
    What bends over alike in a test of less force, far from the limit, does so in the damper as well.
    """
    free = [e.force_peak_N or 0.0 for e in entries if _missing_share(e) is None]
    largest = max((e.force_peak_N or 0.0 for e in entries), default=0.0)

    def bends_below(entry: RecordEntry) -> bool:
        """Whether it bends over below a limit that another record goes beyond."""
        missing = _missing_share(entry)
        return missing is not None and (1.0 + LEAST_CUT) * _soft_limit(missing) * (entry.force_peak_N or 0.0) < largest

    def goes_beyond(entry: RecordEntry) -> bool:
        """Whether a record without an end of its range has a larger force."""
        return (1.0 + LEAST_CUT) * (entry.force_peak_N or 0.0) < max(free, default=0.0)

    alike = AS_MUCH * max((_missing_share(e) or 0.0 for e in entries if bends_below(e)), default=0.0)
    return tuple(
        entry.model_copy(update={"findings": tuple(f for f in entry.findings if f.check != "range")})
        if goes_beyond(entry) or (_missing_share(entry) or np.inf) <= alike
        else entry
        for entry in entries
    )


def _missing_share(entry: RecordEntry) -> float | None:
    """Return how much is missing at the peak of a record whose range ends, as a share of it; None of any other."""
    found = next((f.size for f in entry.findings if f.check == "range"), None)
    return None if found is None or not entry.force_peak_N else found / entry.force_peak_N


def _soft_limit(missing: float) -> float:
    """Compute the limit of a soft amplifier, as a multiple of the peak that it shows, from what is missing there.

    Equation: atanh(1/s) s = 1 + m, see `_saturation`

    Examples
    --------
    >>> round(_soft_limit(0.0986), 3)  # it shows half of its limit
    2.0
    """
    from scipy.optimize import brentq

    return float(brentq(lambda s: np.arctanh(1.0 / s) * s - 1.0 - missing, 1.0 + 1e-12, 1e3))


CHECKS = (amplifier,)
COMPARISONS = (drop_contradicting_filters, drop_contradicting_ranges)
"""Each looks at its own findings only."""
