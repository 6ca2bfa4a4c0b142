"""The force channel comes late: a filter or another converter than that of the displacement.

Law: F recorded at t - tau; negative where the displacement is the late one. Range: 0.1-5 ms.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pzd.damper.effect import Effect, Parameter, Search, growing

EFFECT = Effect(
    name="sensor_delay",
    place="sensor",
    law="F recorded at t - tau",
    parameters=(Parameter("tau", "s", 0.0, -0.1, 0.1, "delay of the force channel", Search(lambda _: 1.0e-3, (0.0,))),),
    source="pure dead time of a measuring chain",
    tests=(({"time": 1.0, "tau": 0.002}, 0.998),),
    hidden=growing("tau", lambda _: 0.02, either=True),
)


def law(time: NDArray[np.float64] | float, tau: float) -> NDArray[np.float64] | float:
    """Moments [s] whose force the channel shows at one or more times [s]."""
    return time - tau
