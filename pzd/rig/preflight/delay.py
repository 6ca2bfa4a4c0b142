"""Whether force and displacement were recorded at the same instants.

A delay of 2 ms is found only where the delayed element leaves hardly anything, so not on a damper that lacks a law: one
test cannot tell the two apart. Several could, for a delay moves the reversal of the force by the same time everywhere,
while friction against a spring or a lash moves it by a displacement s, which takes sqrt(2 s / a) at the acceleration a
of the reversal. Tried on eleven laws with 0.5 and 2 Hz, 20 and 30 mm and 1 % of noise, the time left at infinite a is
-0.3 to 1.4 ms without and 1.8 to 3.4 ms with a delay of 2 ms, but 13 and 15 ms under `rounded_yield`, whose lag is a
speed, reached after w / a. With a term for that as well, four tests leave the time known to +-3 ms only (-8 to 4 ms
without a delay). So nothing is said here; a diagnosis, which fits whole laws to all tests, names `sensor_delay`.

The other way round, what one test takes for a delay is none where other tests ask for another one: a recorder is late
by the same time in all, a hysteresis by an angle or a displacement.
"""

from __future__ import annotations

import numpy as np

from pzd.artefacts import Finding, RecordEntry
from pzd.record import is_constant, voltage_scale
from pzd.rig.preflight import Measured
from pzd.rig.reference_fit import VISIBLE, Piece, fit_reference, fitted

LEAST_DELAY = 1e-3
"""Smallest delay that is said [s]; what is less is within the nuisances of a diagnosis."""
EXPLAINS = 0.25
"""The delay has to leave less than this share of the squares that the element without it leaves."""
AS_WELL = 2.0
"""A rigid damper without any delay explains the force as well where it leaves less than this times as much."""
SIGMOIDS = (0.01, 0.03, 0.1, 0.3)
"""Where the friction of a rigid damper is rounded off, as a share of its top speed."""
LONGEST = 0.03
"""Largest delay looked for [s], or a twentieth of the cycle where that is less."""
TRIES = 31
ALIKE = 0.25
"""Delays further than this share from the usual one are no recorder's: those tried lie 2 ms from one to the next."""


def check(test: Measured) -> list[Finding]:
    """A delay of the force against the displacement that a plain Bingham element asks for."""
    if not is_constant(test.record, voltage_scale([test.record])):
        return []
    part, undelayed = fit_reference(test)
    if undelayed.left < VISIBLE:
        return []
    longest = min(LONGEST, test.run.period / 20.0) if test.run else LONGEST
    delays = np.linspace(-longest, longest, TRIES)
    best = fitted(part, part.force_later(delays))
    delay = float(delays[best.force])
    found = abs(delay) >= max(LEAST_DELAY, 0.5 * part.step) and best.force not in (0, TRIES - 1)
    if not found or best.left > EXPLAINS * undelayed.left:
        return []
    if _left_by_rigid(part) < AS_WELL * best.left:
        return []
    return [
        Finding(
            check="delay",
            where=f"the force is {'late' if delay > 0.0 else 'early'} against the displacement, the whole record",
            size=delay,
            unit="s",
            follows=f"it takes {1.0 - best.left / undelayed.left:.0%} of what a Bingham element leaves; not corrected",
        )
    ]


def compared(entries: tuple[RecordEntry, ...]) -> tuple[RecordEntry, ...]:
    """The same entries, without delays in settings whose records ask for different ones."""
    found: dict[str | None, list[float]] = {}
    for entry in entries:
        found.setdefault(entry.setting, []).extend(f.size for f in entry.findings if f.check == "delay")
    different = {
        setting
        for setting, delays in found.items()
        if delays and np.ptp(delays) > 2.0 * max(ALIKE * abs(np.median(delays)), LEAST_DELAY)
    }
    return tuple(_without_delay(entry) if entry.setting in different else entry for entry in entries)


def _without_delay(entry: RecordEntry) -> RecordEntry:
    return entry.model_copy(update={"findings": tuple(f for f in entry.findings if f.check != "delay")})


def _left_by_rigid(part: Piece) -> float:
    """Share of the force's squares about its mean that a rigid damper with sigmoid friction leaves, undelayed.

    Equation: F = F_0 + c x + m a + C v + C_a abs(v) + q v abs(v) + sum of T_i tanh(v / v_i)    Source: least squares
    """
    x, force = part.displacement, part.force_later(np.zeros(1))[0]
    v = np.gradient(x)
    if part.closed:
        v = 0.5 * (np.roll(x, -1) - np.roll(x, 1))
    top = float(np.percentile(np.abs(v), 99.0)) or 1.0
    rounded = [np.tanh(v / (share * top)) for share in SIGMOIDS]
    columns = [np.ones(x.size), x - x.mean(), np.gradient(v), v, np.abs(v), v * np.abs(v), *rounded]
    design = np.stack([column / (np.linalg.norm(column) or 1.0) for column in columns], axis=1)
    rest = force - design @ np.linalg.lstsq(design, force, rcond=None)[0]
    return float(np.sum(rest**2) / max(np.sum((force - force.mean()) ** 2), 1e-300))
