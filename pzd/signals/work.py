"""Work along a path of force over displacement."""

from __future__ import annotations

import numpy as np

from pzd.record import Array


def work(displacement: Array, force: Array, closed: bool = False) -> float:
    """Work done on the damper along the path.

    Equation: W = integral of F dx, the area of the loop of force over displacement      Source: definition

    Parameters
    ----------
    displacement : (n,) extension [m]
    force : (n,) force [N]
    closed : whether the last sample is followed by the first, as in an average cycle

    Returns
    -------
    work [J]
    """
    if closed:
        displacement, force = np.append(displacement, displacement[0]), np.append(force, force[0])
    return float(np.sum(0.5 * (force[1:] + force[:-1]) * np.diff(displacement)))
