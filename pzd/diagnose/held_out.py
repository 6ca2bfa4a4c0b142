"""The gap on what no fit has seen, before and after: both dampers fitted to the training samples alone."""

from __future__ import annotations

from pzd.artefacts import Gap
from pzd.diagnose.data.split import TRAINING
from pzd.diagnose.fit.least_squares import fit
from pzd.diagnose.gap import gap_of
from pzd.diagnose.kept_back import Trials
from pzd.diagnose.search.selection import Selection


def held_out_gap(selection: Selection, trials: Trials | None = None) -> Gap:
    """Criterion (4) on the untouched samples, nuisances at their prior mean, before and after alike.

    Parameters
    ----------
    selection : what was adopted, and the evidence whose first half trains
    trials : the tests, where the damper handed on is fitted by criterion (4); None where it is by likelihood
    """
    campaign, training = selection.first.campaign, selection.first.halves[0]
    plain = fit(training, (), training.start()).damper
    before = gap_of(campaign.untouched(plain), campaign.parts)
    if not selection.adopted:
        return before
    seen_later = [~mask for mask in campaign.in_role(TRAINING)]
    found = None if trials is None else trials.fitted_by_criterion(selection.fitted.damper, seen_later)
    training = selection.last.halves[0]
    adopted = found[1] if found else fit(training, selection.adopted, training.start_with(selection.fitted.damper))
    after = gap_of(campaign.untouched(adopted.damper), campaign.parts)
    return after.model_copy(update={"before": before.before})
