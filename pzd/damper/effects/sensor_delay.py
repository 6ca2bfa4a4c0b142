"""Delay between the recorded force and displacement: a filter or another converter in one of the channels.

Law: F recorded at t - tau; the force is late where tau is positive, the displacement where it is negative.
Range: 0.1-5 ms; slow converters up to 50 ms.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pzd.damper.effect import Effect, Parameter, Search, growing

LATEST = 0.06
"""Largest delay between two channels of one stand [s].

Load cells of home-made stands are read by bridge converters of 80 values a second, which settle in four: 0.05 s.
"""

_SEARCH = Search(lambda _: 1.0e-3, (0.0,))

EFFECT = Effect(
    name="sensor_delay",
    place="sensor",
    law="F recorded at t - tau",
    parameters=(
        Parameter(
            "tau", "s", 0.0, -0.1, 0.1, "delay of the force channel", _SEARCH, natural_from=-LATEST, natural_to=LATEST
        ),
    ),
    source="pure dead time of a measuring chain",
    tests=(({"time": 1.0, "tau": 0.002}, 0.998),),
    hidden=growing("tau", lambda _: 0.02, either=True),
)


def law(time: NDArray[np.float64] | float, tau: float) -> NDArray[np.float64] | float:
    """Moments [s] whose force the channel shows at one or more times [s]."""
    return time - tau
