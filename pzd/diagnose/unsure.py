"""How uncertain a predicted force is because the displacement is: errors in variables.

What noise and resolution leave in the cleaned displacement of an average cycle repeats in every
cycle of the prediction, and the oil spring makes force of it; the scatter of the force between
cycles does not show it. So a few displacements that are as likely are sent through the damper.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pzd.damper.model import Damper
from pzd.diagnose.inputs import Prepared
from pzd.diagnose.noise import harmonics_of
from pzd.diagnose.predict import predicted_force
from pzd.record import Array

NEIGHBOURS = 2
"""Harmonics on either side over which the scatter of so few draws is averaged."""


def force_error(damper: Damper, prepared: Prepared, force: Array) -> Array | float:
    """Variance of the harmonics of a predicted average cycle, because its displacement is not known better.

    Equation: s_h^2 = mean_j |c_h(x + e_j) - c_h(x)|^2              Source: Monte Carlo, JCGM 101:2008

    Parameters
    ----------
    damper : that predicts
    prepared : the record
    force : (n,) what it predicts [N]

    Returns
    -------
    (H + 1,) variance |.|^2 [N^2]; 0 where nothing repeats
    """
    run = prepared.cycles
    if run is None or not prepared.draws:
        return 0.0
    time = prepared.record.time
    changes = [
        run.fold(time, predicted_force(damper, replace(prepared, lead=draw)) - force).mean(axis=0)
        for draw in prepared.draws
    ]
    points = changes[0].size
    power = np.mean(np.abs(np.fft.rfft(changes, axis=1) / points) ** 2, axis=0)[: harmonics_of(points) + 1]
    width = np.ones(2 * NEIGHBOURS + 1)
    smooth: Array = np.convolve(power, width, "same") / np.convolve(np.ones(power.size), width, "same")
    smooth[0] = power[0]
    return smooth
