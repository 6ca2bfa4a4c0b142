"""How much of the gap to the noise-free force is taken away, by what was found and by the truth itself."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from pzd.artefacts import Diagnosed
from pzd.blind.clean import Clean
from pzd.damper.compose import respond
from pzd.damper.model import Damper
from pzd.identify.trial import warm_up


def gap_cut(found: Diagnosed, clean: Mapping[str, Clean], *, gains_out: bool = False) -> float:
    """How much of the gap to the noise-free force the found effects take away on the held-out records.

    Equation: 1 - W_s after / W_s before                    Source: Makowski and Knap 2021, eq. (4)

    Parameters
    ----------
    found : the diagnosis with the damper before and after
    clean : the noise-free records by name
    gains_out : compare shapes alone: the best gain of each record taken out, before and after alike
    """
    held_out = [clean[name] for name in _held_out(found)]
    before, after = (
        sum(_squares(damper, record, gains_out=gains_out) for record in held_out)
        for damper in (found.plain, found.damper)
    )
    return 1.0 - after / before


def gap_cut_of_truth(found: Diagnosed, clean: Mapping[str, Clean]) -> float:
    """What the truth itself would take away, its force at every voltage with the mean gain of the tests fitted there.

    About what a fit can reach: a gain that the tests of a voltage share is the same to it as a larger T0, C and k.

    Parameters
    ----------
    found : the diagnosis with the damper before
    clean : the noise-free records by name, with what was recorded of them
    """
    held_out = _held_out(found)
    fitted = {name: record for name, record in clean.items() if name not in held_out} or clean
    before = after = 0.0
    for record in (clean[name] for name in held_out):
        alike = [other.gain for other in fitted.values() if other.voltage == record.voltage]
        error = float(np.mean(alike or [other.gain for other in fitted.values()])) - 1.0
        after += float(np.sum((error * record.force[warm_up(record.motion.displacement) :]) ** 2))
        before += _squares(found.plain, record, gains_out=False)
    return 1.0 - after / before


def _held_out(found: Diagnosed) -> tuple[str, ...]:
    gap = found.diagnosis.gap
    if gap is None:
        raise ValueError("the gap could not be measured, so nothing is known of what is taken away")
    return gap.held_out


def _squares(damper: Damper, record: Clean, *, gains_out: bool) -> float:
    first = warm_up(record.motion.displacement)
    force = record.force[first:]
    simulated = respond(damper, record.motion, float(record.force[0]), 1e-7)[first:]
    gain = float(force @ simulated / (simulated @ simulated)) if gains_out else 1.0
    return float(np.sum((force - gain * simulated) ** 2))
