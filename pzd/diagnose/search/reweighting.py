"""Iteratively reweighted fits, until the parameters no longer depend on the damper that the weights came from."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from pzd.damper.model import Damper
from pzd.diagnose.fit.intervals import standard_errors
from pzd.diagnose.fit.least_squares import Fitted, fit
from pzd.diagnose.search.evidence import Evidence
from pzd.diagnose.thresholds import AT_REST, MOST_REWEIGHTINGS


def reweighted(weighed: Callable[[Damper], Evidence], evidence: Evidence, current: Fitted) -> tuple[Evidence, Fitted]:
    """The evidence weighed by what an optimum leaves and the optimum by that evidence, in turn until neither moves.

    The delay of a test acts along the slope of the force that the damper gives, and shifts its corners.

    Parameters
    ----------
    weighed : the evidence by what a damper leaves
    evidence : by which the optimum was found
    current : the optimum with the effects adopted
    """
    for _ in range(MOST_REWEIGHTINGS if current.effects else 0):
        before, evidence = current, weighed(current.damper)
        current = fit(evidence.whole, before.effects, evidence.whole.start_with(before.damper))
        moved = [abs(u.of(current.damper) - u.of(before.damper)) for u in before.unknowns]
        if np.all(moved <= AT_REST * standard_errors(current)):
            break
    return evidence, current
