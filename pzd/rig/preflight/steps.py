"""Whether one record holds several tests: the amplitude or the frequency steps between stretches that repeat."""

from __future__ import annotations

from pzd.artefacts import Finding
from pzd.rig.preflight import Measured
from pzd.signals.segmentation import Segment, steps_between_tests


def check(test: Measured) -> list[Finding]:
    """A stepwise change of amplitude or frequency between stretches of three or more cycles alike."""
    return [
        Finding(
            check="steps",
            where=f"displacement, {_in_words(old)} until {old.end:.4g} s, {_in_words(new)} from {new.start:.4g} s",
            size=old.change(new),
            unit="-",
            follows="two tests in one record, identified and diagnosed apart; for two records label each in a column of"
            " its own, and say split: {column: ...}",
        )
        for old, new in steps_between_tests(test.record.time, test.clean.displacement)
    ]


def _in_words(stretch: Segment) -> str:
    return f"{1e3 * stretch.amplitude:.3g} mm at {1.0 / stretch.period:.3g} Hz"
