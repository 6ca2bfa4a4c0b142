"""The rig test at a voltage between two tested ones, where the line between their parameters is known to miss most.

T0, C and k are linear between voltages. A voltage left out of the fit shows by how much that line misses it: where that
is visibly more than is missed of tests at that voltage, the force between voltages is what is known least.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from pzd.artefacts import NextTest
from pzd.damper.compose import respond
from pzd.damper.model import Damper
from pzd.diagnose.data.cleaning import Prepared
from pzd.diagnose.kept_back import Trials
from pzd.diagnose.missed import Missed
from pzd.diagnose.next_test import Reach, frequency_of, motion_of, rounded_down, sine


def next_voltage(
    damper: tuple[Damper, float],
    trials: Trials,
    missed: tuple[Missed, Missed],
    recorded: Sequence[Prepared],
    reach: Reach,
    temperature: float | None,
) -> NextTest | None:
    """A sine half-way between two voltages, with the stroke and frequency of the test that the line misses most.

    Parameters
    ----------
    damper : the one handed on, its displacement as recorded, and by how much the records lie above its force [N]
    trials : the tests, dealt into folds
    missed : what the damper misses of kept-back tests, and of the voltages between others
    recorded : the records of the setting, their displacement as recorded
    reach : what a test may reach
    temperature : at which the test is run [degC]

    Returns
    -------
    None where voltages left out are predicted as well as tests are, or the test would reach too much
    """
    group = _least_known(trials, *missed)
    if group is None:
        return None
    below, above = _widest_beside(trials, group)
    voltage = 0.5 * (below + above)
    if not reach.voltages[0] <= voltage <= reach.voltages[-1]:
        return None
    test = recorded[_most_missed(missed[1].of(trials.groups[group]))]
    amplitude = rounded_down(min(0.5 * float(np.ptp(test.record.displacement)), reach.amplitude))
    frequency = rounded_down(min(frequency_of(test), reach.frequency, reach.speed / (2.0 * np.pi * amplitude)))
    motion = motion_of(sine, frequency, amplitude, voltage, temperature)
    model, offset = damper
    force = respond(model, motion.about(-reach.middle)) + offset
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
