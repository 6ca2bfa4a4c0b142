"""The rig test at a voltage between two tested ones, where the line between their parameters is known to miss most.

T0, C and k are linear between voltages. A voltage left out of the fit shows by how much that line misses it: where that
is visibly more than is missed of tests at that voltage, the force between voltages is what is known least.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from pzd.artefacts import NextTest
from pzd.damper.compose import respond
from pzd.damper.model import Damper
from pzd.diagnose.data.cleaning import Prepared
from pzd.diagnose.kept_back import Trials
from pzd.diagnose.missed import Missed
from pzd.diagnose.next_test import MEASURED, Reach, frequency_of, motion_of, rounded_down, sine


@dataclass(frozen=True)
class PredictingDamper:
    """A damper that is handed on, and what it misses of tests that it has not seen."""

    damper: Damper
    """Its displacement as recorded."""
    offset: float
    """By which the records lie above its force [N]."""
    missed: Missed
    """Of tests that were kept back."""
    missed_between: Missed
    """Of voltages between others that were left out."""


def next_voltage(
    predicting: PredictingDamper,
    trials: Trials,
    recorded: Sequence[Prepared],
    reach: Reach,
    temperature: float | None,
) -> NextTest | None:
    """A sine half-way between two voltages, with the stroke and frequency of the test that the line misses most.

    Parameters
    ----------
    predicting : the damper that is handed on
    trials : the tests, dealt into folds
    recorded : the records of the setting, their displacement as recorded
    reach : what a test may reach
    temperature : at which the test is run [degC]

    Returns
    -------
    None where voltages left out are predicted as well as tests are, or the test would reach too much
    """
    group = _least_known(trials, predicting.missed, predicting.missed_between)
    if group is None:
        return None
    below, above = _widest_beside(trials, group)
    voltage = 0.5 * (below + above)
    if not reach.voltages[0] <= voltage <= reach.voltages[-1]:
        return None
    test = recorded[_most_missed(predicting.missed_between.of(trials.groups[group]))]
    half_stroke = 0.5 * float(np.ptp(test.record.displacement))
    amplitude = min(rounded_down(half_stroke, MEASURED), rounded_down(reach.amplitude))
    fastest = rounded_down(min(reach.frequency, reach.speed / (2.0 * np.pi * amplitude)))
    frequency = min(rounded_down(frequency_of(test), MEASURED), fastest)
    motion = motion_of(sine, frequency, amplitude, voltage, temperature)
    force = respond(predicting.damper, motion.about(-reach.middle)) + predicting.offset
    if np.min(force) < reach.force[0] or np.max(force) > reach.force[1]:
        return None
    return NextTest(
        waveform="sine",
        frequency_Hz=frequency,
        amplitude_m=amplitude,
        middle_m=reach.middle,
        voltage_V=voltage,
        separates=(),
        between_voltage_V=(below, above),
        peak_speed_m_per_s=float(np.max(np.abs(motion.velocity))),
        peak_force_N=float(np.max(np.abs(force))),
    )


def _least_known(trials: Trials, missed: Missed, between: Missed) -> int | None:
    """Of the voltages that are predicted visibly worse left out than tests are, the one predicted worst."""
    pairs = [(i, missed.of(trials.groups[i]), between.of(trials.groups[i])) for i in trials.between()]
    worse = [(out.criterion or 0.0, i) for i, kept_back, out in pairs if kept_back.record and kept_back.less_than(out)]
    return max(worse)[1] if worse else None


def _widest_beside(trials: Trials, group: int) -> tuple[float, float]:
    """The wider of both steps from a voltage to its neighbours [V], the lower one where they are alike."""
    voltages = sorted(v for v in trials.voltages if v is not None)
    steps = [step for step in pairwise(voltages) if trials.voltages[group] in step]
    return max(steps, key=lambda step: step[1] - step[0])


def _most_missed(missed: Missed) -> int:
    """The record that is missed most, by its W_s."""
    return missed.record[int(np.argmax(missed.error / missed.energy))]
