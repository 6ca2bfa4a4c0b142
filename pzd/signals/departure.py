"""What an average over cycles would take away: noise, or motion that does not repeat.

Two tones without a common period look alike from one cycle to the next, and yet their average
holds but one of them. Noise differs between neighbouring cycles as much as between distant ones;
a second tone, a beat or an amplitude that grows differs least between some neighbours. Two or three
cycles do not show that; of them the smoothed motion is compared, in which there is next to no noise.
"""

from __future__ import annotations

import numpy as np

from pzd.record import Array

TOLERATED = 0.03
"""Share of the r.m.s. motion, or of its r.m.s. change within a small part of the cycle, that may depart from the
average: the closed loops of the measured stands wander by up to 0.027, a second tone of 2 % begins at 0.03."""
NEIGHBOURS = 4
"""Cycles so far apart are compared: a tone that gains any part of a turn a cycle is nearly in phase again by then."""
PARTS = (64, 16, 4)
"""Changes of the motion are compared over these parts of a cycle, so that quick motion of small size counts."""
SIGNIFICANT = 5.0
"""Standard errors by which a departure must exceed the noise."""
FEW = 4
"""With fewer cycles than these, a tone that gains on each cycle is not told from noise by what neighbours differ."""
INDEPENDENT = 20
"""Samples of a cycle that count as independent, at least, where its noise is coloured."""


def departure(folded: Array) -> float:
    """How much of a motion an average over its cycles takes away beyond noise.

    Equation: P - min_l D_l / 2 with P = n / (n - 1) mean (x_j - mean x)^2, D_l = mean (x_(j+l) - x_j)^2
              Source: von Neumann 1941; noise that no cycle shares with another has P = D_l / 2 at every l

    Parameters
    ----------
    folded : (n, points) displacement, one row a cycle, slow drift taken off; of fewer than FEW cycles smoothed

    Returns
    -------
    r.m.s. as a share of that of the motion, the largest over the motion itself and its changes within parts of a
    cycle; 0 within the noise
    """
    points = folded.shape[1]
    steps = [points // part for part in PARTS if points >= 2 * part]
    return max(_excess(of) for of in (folded, *(folded[:, step:] - folded[:, :-step] for step in steps)))


def _excess(cycles: Array) -> float:
    count = len(cycles)
    about_mean = float(np.mean((cycles - cycles.mean(axis=0)) ** 2)) * count / (count - 1)
    lags = range(1, min(NEIGHBOURS, count - 1) + 1) if count >= FEW else ()
    noise = min((0.5 * float(np.mean((cycles[lag:] - cycles[:-lag]) ** 2)) for lag in lags), default=0.0)
    excess = about_mean - noise
    if excess <= SIGNIFICANT * noise * np.sqrt(3.0 / (count * INDEPENDENT)):
        return 0.0
    return float(np.sqrt(excess / np.mean((cycles - cycles.mean()) ** 2)))
