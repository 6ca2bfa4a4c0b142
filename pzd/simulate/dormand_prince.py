"""The coefficients of Dormand and Prince's pair of order 5(4), the last stage being the first of the next step.

Source: Dormand and Prince 1980, J. Comput. Appl. Math. 6(1), table 2
"""

from __future__ import annotations

import numpy as np

STAGES = 7
"""Number of stages."""
TIMES = np.array([0.0, 1 / 5, 3 / 10, 4 / 5, 8 / 9, 1.0, 1.0])
"""(STAGES,) share of the step at which each stage stands."""
STAGE_WEIGHTS = np.array(
    [
        [0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        [1 / 5, 0.0, 0.0, 0.0, 0.0, 0.0],
        [3 / 40, 9 / 40, 0.0, 0.0, 0.0, 0.0],
        [44 / 45, -56 / 15, 32 / 9, 0.0, 0.0, 0.0],
        [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729, 0.0, 0.0],
        [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656, 0.0],
        [35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84],
    ]
)
"""(STAGES, STAGES - 1) what each stage takes of those before it; the last row is the step itself."""
ERROR_WEIGHTS = np.array([-71 / 57600, 0.0, 71 / 16695, -71 / 1920, 17253 / 339200, -22 / 525, 1 / 40])
"""(STAGES,) difference between the orders 5 and 4."""
