"""The coefficients of RODAS4, a Rosenbrock method of order 4(3) for stiff equations; L-stable, each stage one division.

Source: Hairer and Wanner 1996, Solving Ordinary Differential Equations II, section IV.10, code RODAS
"""

from __future__ import annotations

import numpy as np

STAGES = 6
"""Number of stages."""
DIAGONAL = 0.25
"""What of the derivative by the variable itself each stage takes implicitly."""
TIMES = np.array([0.0, 0.386, 0.21, 0.63, 1.0, 1.0])
"""(STAGES,) share of the step at which each stage stands."""
TIME_WEIGHTS = np.array([0.25, -0.1043, 0.1035, -0.3620000000000023e-1, 0.0, 0.0])
"""(STAGES,) what each stage takes of the derivative by the time."""
STAGE_WEIGHTS = np.array(
    [
        [0.0, 0.0, 0.0, 0.0, 0.0],
        [0.1544000000000000e1, 0.0, 0.0, 0.0, 0.0],
        [0.9466785280815826, 0.2557011698983284, 0.0, 0.0, 0.0],
        [0.3314825187068521e1, 0.2896124015972201e1, 0.9986419139977817, 0.0, 0.0],
        [0.1221224509226641e1, 0.6019134481288629e1, 0.1253708332932087e2, -0.6878860361058950, 0.0],
        [0.1221224509226641e1, 0.6019134481288629e1, 0.1253708332932087e2, -0.6878860361058950, 1.0],
    ]
)
"""(STAGES, STAGES - 1) what the argument of each stage takes of those before it; the step takes the last stage too."""
RATE_WEIGHTS = np.array(
    [
        [0.0, 0.0, 0.0, 0.0, 0.0],
        [-0.5668800000000000e1, 0.0, 0.0, 0.0, 0.0],
        [-0.2430093356833875e1, -0.2063599157091915, 0.0, 0.0, 0.0],
        [-0.1073529058151375, -0.9594562251023355e1, -0.2047028614809616e2, 0.0, 0.0],
        [0.7496443313967647e1, -0.1024680431464352e2, -0.3399990352819905e2, 0.1170890893206160e2, 0.0],
        [
            0.8083246795921522e1,
            -0.7981132988064893e1,
            -0.3152159432874371e2,
            0.1631930543123136e2,
            -0.6058818238834054e1,
        ],
    ]
)
"""(STAGES, STAGES - 1) what the rate of each stage takes of those before it."""
