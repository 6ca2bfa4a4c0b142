"""How closely weightings and measures keep to ISO 8041-1:2017 and ISO 2631-1:1997: each clause one function.

What is computed goes the whole way of a measured record, `weighted_record` and `evaluate`. What is expected is the
closed form of the standard at the true centre of each third octave, written here a second time from the poles and
zeros, or a tabulated or closed-form value of a measure.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache

import numpy as np

from pzd.comfort.iso2631_1997 import evaluate
from pzd.comfort.rating import SLOWEST_HZ, motion_sickness_dose, rated
from pzd.comfort.weighting import WEIGHTINGS, WF, Weighting, weighted_record

RATES_HZ = (SLOWEST_HZ, 100.0, 256.0, 500.0, 1000.0, 4000.0)
"""Rates at which each weighting is checked: the lowest that is accepted, and those that loggers have."""
_WITHIN = 0.45
"""Share of the rate up to which a tone is checked: no record holds what is faster than half of it."""
_PERIODS = 8.0
_SHORTEST_S = 4.0
"""Length of a tone: so many periods, or so long."""


@dataclass(frozen=True)
class Check:
    """One row: what a clause expects, what is computed, and how much of the tolerance that takes."""

    clause: str
    what: str
    expected: float
    computed: float
    low: float
    """Admissible error downwards, relative, as a positive number."""
    high: float
    """Admissible error upwards, relative."""

    @property
    def error(self) -> float:
        """Relative error."""
        return self.computed / self.expected - 1.0

    @property
    def share(self) -> float:
        """Share of the tolerance used; above 1 it fails."""
        return self.error / self.high if self.error >= 0.0 else -self.error / self.low


Clause = Callable[[], Iterator[Check]]


def weighting_factors() -> Iterator[Check]:
    """Yield each weighting at every third octave: of all rates the one that is farthest off."""
    for weighting in WEIGHTINGS.values():
        for number in range(*_bands(weighting)):
            frequency = 10.0 ** (number / 10.0)
            expected = abs(_closed_form(weighting, frequency))
            low, high = _tolerance(weighting, frequency)
            rates = [rate for rate in RATES_HZ if frequency < _WITHIN * rate]
            found = [
                Check(
                    "ISO 8041-1:2017, Annex B",
                    f"{weighting.name} at {frequency:.4g} Hz",
                    expected,
                    _measured(weighting, frequency, rate),
                    low,
                    high,
                )
                for rate in rates
            ]
            yield max(found, key=lambda check: check.share)


def _bands(weighting: Weighting) -> tuple[int, int]:
    """Return the third octaves of a weighting: two decades for that of motion sickness, else 0.1 to 400 Hz."""
    return (-17, 1) if weighting is WF else (-10, 27)


def _tolerance(weighting: Weighting, frequency: float) -> tuple[float, float]:
    """Return the admissible error of a weighting downwards and upwards.

    +12/-11 % from two third octaves above the high-pass to two below the low-pass, +26/-21 % up to two beyond these,
    +26/-100 % farther out: for Wk 0.631 to 63.1 Hz, and 0.251 to 158.5 Hz.      Source: ISO 8041-1:2017
    """
    inner, outer = 10.0**0.19, 10.0**-0.21  # a band counts whole
    if weighting.f1 * inner < frequency < weighting.f2 / inner:
        return 0.11, 0.12
    if weighting.f1 * outer < frequency < weighting.f2 / outer:
        return 0.21, 0.26
    return 1.0, 0.26


def _closed_form(weighting: Weighting, frequency: float) -> complex:
    """Return the response of ISO 8041-1 by its polynomials in s, with angular frequencies."""
    s = 2j * np.pi * frequency

    def quadratic(corner: float, Q: float) -> complex:
        w = 2.0 * np.pi * corner
        return complex(s * s + s * w / Q + w * w)

    w2 = 2.0 * np.pi * weighting.f2
    found = s * s / quadratic(weighting.f1, np.sqrt(0.5)) * w2 * w2 / quadratic(weighting.f2, np.sqrt(0.5))
    if np.isfinite(weighting.f4):
        w4 = 2.0 * np.pi * weighting.f4
        zero = 1.0 if np.isinf(weighting.f3) else 1.0 + s / (2.0 * np.pi * weighting.f3)
        found *= zero * w4 * w4 / quadratic(weighting.f4, weighting.Q4)
    if weighting.step is not None:
        f5, Q5, f6, Q6 = weighting.step
        found *= quadratic(f5, Q5) / quadratic(f6, Q6)
    return complex(found)


def _measured(weighting: Weighting, frequency: float, rate: float) -> float:
    """Return by what a tone is multiplied on the way of a record: its weighted r.m.s. over its own."""
    time = np.arange(round(max(_PERIODS / frequency, _SHORTEST_S) * rate)) / rate
    tone = np.sin(2.0 * np.pi * frequency * time + 1.0)
    # Over the record in which the tone was not cut short: the last instants are those of a decay.
    history = weighted_record(tone + 9.81, rate, weighting)
    expected = np.imag(_closed_form(weighting, frequency) * np.exp(1j * (2.0 * np.pi * frequency * time + 1.0)))
    return float(abs(_closed_form(weighting, frequency)) * np.sqrt(np.mean(history**2) / np.mean(expected**2)))


def running_rms() -> Iterator[Check]:
    """Yield MTVV of a burst of one second: the r.m.s. of the burst."""
    rate = 1000.0
    burst = np.zeros(10000)
    burst[4000:5000] = np.sqrt(2.0) * np.sin(2.0 * np.pi * 10.0 * np.arange(1000) / rate)
    yield Check("ISO 2631-1:1997, eq. (2) and (4)", "MTVV of 1 s at 10 Hz", 1.0, evaluate(burst, rate).mtvv, 0.1, 0.1)


def dose() -> Iterator[Check]:
    """Yield VDV of a tone: its closed form."""
    rate, amplitude, seconds = 1000.0, 2.0, 16.0
    tone = amplitude * np.sin(2.0 * np.pi * 5.0 * np.arange(int(seconds * rate)) / rate)
    expected = amplitude * (0.375 * seconds) ** 0.25
    yield Check("ISO 2631-1:1997, eq. (5)", "VDV of 16 s at 5 Hz", expected, evaluate(tone, rate).vdv, 0.06, 0.06)


def crest() -> Iterator[Check]:
    """Yield the crest factor of a tone."""
    tone = np.sin(2.0 * np.pi * 5.0 * np.arange(8000) / 1000.0)
    expected = float(np.sqrt(2.0))
    yield Check("ISO 2631-1:1997, 6.2.1", "crest factor of a tone", expected, evaluate(tone, 1000.0).crest, 0.1, 0.1)


def sickness() -> Iterator[Check]:
    """Yield MSDV of ten minutes at 0.2 Hz."""
    rate, seconds = 50.0, 600.0
    tone = np.sin(2.0 * np.pi * 0.2 * np.arange(int(seconds * rate)) / rate)
    expected = abs(_closed_form(WF, 0.2)) * float(np.sqrt(0.5 * seconds))
    computed = motion_sickness_dose(weighted_record(tone, rate, WF), rate)
    yield Check("ISO 2631-1:1997, Annex D", "MSDV of 600 s at 0.2 Hz", expected, computed, 0.11, 0.12)


def total() -> Iterator[Check]:
    """Yield the total value of three axes with gravity and offsets, by the factors of a seated person."""
    rate, time = 500.0, np.arange(10000) / 500.0
    both = [(1.0, 0.7, 9.81), (2.0, 0.5, 0.3), (4.0, 1.2, -1.0)]
    record = np.column_stack([a * np.sin(2.0 * np.pi * f * time) + offset for f, a, offset in both])
    names = ("Wd", "Wd", "Wk")
    parts = [abs(_closed_form(WEIGHTINGS[n], f)) * a for n, (f, a, _) in zip(names, both, strict=True)]
    expected = float(np.sqrt(0.5 * np.sum(np.square(parts))))
    yield Check("ISO 2631-1:1997, eq. (10)", "a_v of x, y, z", expected, rated(record, rate, "xyz").a_v, 0.11, 0.12)


CLAUSES: tuple[Clause, ...] = (weighting_factors, running_rms, dose, crest, sickness, total)


@cache
def checks() -> tuple[Check, ...]:
    """Return every check of every clause."""
    return tuple(check for clause in CLAUSES for check in clause())


def page() -> list[str]:
    """Return the table as lines of a page, which `docs/conformance.md` holds."""
    rates = ", ".join(f"{rate:g}" for rate in RATES_HZ)
    found = checks()
    worst = max(found, key=lambda check: check.share)
    used = max(round(100.0 * worst.share, 1), 0.1)
    return [
        "# Conformance of the weightings",
        "",
        "Printed by `pzd rate --conformance`. Tones with gravity on them go the way of a measured record, at",
        f"{rates} Hz as far as these hold the tone; the one that is farthest off is shown.",
        "Expected is the closed form at true centres, 10^(n/10) Hz; 100 % would use all of the tolerance.",
        "",
        f"{len(found)} rows; the largest share is below {used:.1f} % ({worst.what}).",
        "",
        "| clause | what | expected | computed | tolerance | share used |",
        "|---|---|---|---|---|---|",
        *(
            f"| {c.clause} | {c.what} | {c.expected:.4g} | {c.computed:.4g} | +{c.high:.0%} / -{c.low:.0%} "
            f"| {_percent(c.share)} |"
            for c in found
        ),
    ]


def _percent(share: float) -> str:
    """Write a share in per cent, so rounded that no processor writes it otherwise."""
    return "below 1 %" if share < 0.01 else f"{share:.0%}"
