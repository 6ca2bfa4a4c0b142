"""The gap on what no fit has seen, before and after: both dampers fitted to the training samples alone."""

from __future__ import annotations

from pzd.artefacts import Gap
from pzd.diagnose.fit.least_squares import fit
from pzd.diagnose.gap import gap_of
from pzd.diagnose.search.selection import Selection


def held_out_gap(named: Selection) -> Gap:
    """Criterion (4) on the untouched samples, nuisances at their prior mean, before and after alike.

    Parameters
    ----------
    named : what was adopted, and the evidence whose first half trains
    """
    campaign, training = named.first.campaign, named.first.halves[0]
    plain = fit(training, (), training.start()).damper
    before = gap_of(campaign.untouched(plain), campaign.parts)
    if not named.adopted:
        return before
    training = named.last.halves[0]
    adopted = fit(training, named.adopted, training.start_with(named.fitted.damper)).damper
    after = gap_of(campaign.untouched(adopted), campaign.parts)
    return after.model_copy(update={"before": before.before})
