"""T0, C and k of the damper with what was adopted, with their 95 % intervals: one row a base row."""

from __future__ import annotations

import numpy as np

from pzd.artefacts import ParameterRow
from pzd.diagnose.fit.intervals import base_half_widths
from pzd.diagnose.search.selection import Selection
from pzd.diagnose.verdict import Verdict
from pzd.identify.determination import NAMES, scales_of
from pzd.identify.fit import row_of
from pzd.identify.objective import Bingham
from pzd.identify.trust import ParameterEvidence

DOUBTS: dict[Verdict, str] = {
    "unexplained": "something is still missed: the parameters are the model's, not the damper's",
    "ambiguous": "a rival effect would leave other values",
}
"""Why no row is `ok` under a verdict."""
SHOWN = 1.0
"""Share of the force that a parameter moves, for its status: what the tests do not show has a wide interval here."""


def base_parameters(selection: Selection, verdict: Verdict, setting: str | None) -> tuple[ParameterRow, ...]:
    """T0, C and k beside the effects adopted, judged by their intervals as those of identify are.

    An interval allows for noise, for the sensors' priors, and for how far the tests disagree; it
    holds the damper's own parameters where the effects adopted are all that there is.

    Parameters
    ----------
    selection : what was adopted
    verdict : what was decided
    setting : of the rig's settings, the one in use
    """
    fitted, whole = selection.fitted, selection.last.whole
    compared = [(o.place, o.measured, f) for o, f in zip(whole.observations, fitted.simulated, strict=True)]
    rows = []
    for place, (row, widths) in enumerate(
        zip(fitted.damper.base, base_half_widths(fitted, whole.scales.force), strict=True)
    ):
        mine = [(m, f) for at, m, f in compared if at == place] or [(m, f) for _, m, f in compared]
        measured = np.concatenate([m for m, _ in mine])
        residuals = measured - np.concatenate([f for _, f in mine])
        parameters = Bingham(row.T0_N, row.C_Ns_per_m, row.k_N_per_m)
        evidence = [
            ParameterEvidence(name, scale, width, width, SHOWN, doubt=DOUBTS.get(verdict))
            for name, scale, width in zip(NAMES, scales_of(parameters, measured).tolist(), widths.tolist(), strict=True)
        ]
        labels = (setting, row.voltage_V, row.temperature_degC)
        rows.append(row_of(labels, parameters, widths, evidence, (measured, residuals)))
    return tuple(rows)
