"""What a damper makes of a record, and how uncertain that is because the channels are: errors in variables.

What noise and resolution leave in the cleaned displacement of an average cycle repeats in every
cycle of the prediction, and the oil spring makes force of it; the scatter of the force between
cycles does not show it. So a few displacements that are as likely are sent through the damper.
A voltage that moves is known at its samples alone: a step falls anywhere between two of them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pzd.damper.model import Damper
from pzd.diagnose.data.cleaning import Prepared
from pzd.diagnose.fit.prediction import force_in, predicted_force
from pzd.record import Array
from pzd.signals.between_cycles import harmonics_of

BETWEEN_SAMPLES = 0.5
"""Standard deviation of the instant of the voltage [samples]."""
NEIGHBOURS = 2
"""Harmonics on either side over which the scatter of so few draws is averaged."""


@dataclass(frozen=True, eq=False)
class Predicted:
    """The force that a damper gives in a record, and how uncertain it is."""

    damper: Damper
    force: Array
    """(n,) that it gives [N]."""
    displacement_variance: Array | float
    """(H + 1,) variance |.|^2 of the harmonics of its average cycle by the displacement [N^2]; 0 where none repeats."""
    timing: Array
    """(n, 1) change of the force by one standard deviation of the voltage's instant [N]; (n, 0) where it stands."""


def expected(damper: Damper, prepared: Prepared, delay: float) -> Predicted:
    """What a damper makes of a record.

    Parameters
    ----------
    damper : that predicts
    prepared : the record
    delay : standard deviation of a test's own delay [s]
    """
    force = predicted_force(damper, prepared)
    return Predicted(damper, force, force_error(damper, prepared), _timing(damper, prepared, force, delay))


def _timing(damper: Damper, prepared: Prepared, force: Array, delay: float) -> Array:
    record = prepared.record
    if prepared.constant or record.voltage is None:
        return np.zeros((force.size, 0))
    late = replace(record, voltage=np.concatenate([record.voltage[:1], record.voltage[:-1]]))
    change = predicted_force(damper, replace(prepared, record=late)) - force
    return np.asarray(np.hypot(BETWEEN_SAMPLES, delay * record.rate) * change[:, None])


def force_error(damper: Damper, prepared: Prepared) -> Array | float:
    """Variance of the harmonics of a predicted average cycle, because its displacement is not known better.

    Equation: s_h^2 = mean_j |c_h(x + e_j) - c_h(x)|^2              Source: Monte Carlo, JCGM 101:2008

    Parameters
    ----------
    damper : that predicts
    prepared : the record

    Returns
    -------
    (H + 1,) variance |.|^2 [N^2]; 0 where nothing repeats
    """
    if not prepared.draws:
        return 0.0
    points = prepared.draws[0].time.size // 2
    known, *others = (force_in(damper, draw)[points:] for draw in prepared.draws)
    changes = np.fft.rfft(np.stack(others) - known, points, axis=1) / points
    power = np.mean(np.abs(changes) ** 2, axis=0)[: harmonics_of(points) + 1]
    power[0] = 0.0  # a stuck damper keeps whatever offset it began with
    width = np.ones(2 * NEIGHBOURS + 1)
    smooth: Array = np.convolve(power, width, "same") / np.convolve(np.ones(power.size), width, "same")
    smooth[0] = 0.0
    return smooth
