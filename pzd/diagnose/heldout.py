"""The gap on what no fit has seen, before and after: both dampers fitted to the training samples alone."""

from __future__ import annotations

from pzd.artefacts import Gap
from pzd.damper.model import Damper
from pzd.diagnose.config import DiagnoseConfig
from pzd.diagnose.evidence import Evidence
from pzd.diagnose.fitting import fit
from pzd.diagnose.gap import gap_of
from pzd.diagnose.judge import Judged, judge
from pzd.diagnose.named import Named
from pzd.diagnose.split import UNTOUCHED, Split


def held_out_gap(named: Named, parts: Split, config: DiagnoseConfig) -> Gap:
    """Criterion (4) on the untouched samples, nuisances at their prior mean, before and after alike.

    Parameters
    ----------
    named : what was adopted, and the evidence whose first half trains
    parts : the split
    config : priors of the nuisances
    """
    training = named.first.halves[0]
    plain = fit(training, (), training.start()).damper
    before = gap_of(_untouched(named.first, parts, plain, config), parts)
    if not named.adopted:
        return before
    training = named.last.halves[0]
    adopted = fit(training, named.adopted, training.start_with(named.fitted.damper)).damper
    after = gap_of(_untouched(named.last, parts, adopted, config), parts)
    return after.model_copy(update={"before": before.before})


def _untouched(evidence: Evidence, parts: Split, damper: Damper, config: DiagnoseConfig) -> list[Judged]:
    masks = [roles == UNTOUCHED for roles in parts.roles]
    pairs = zip(evidence.prepared, masks, strict=True)
    return [judge(damper, p, mask, config.nuisance) for p, mask in pairs if mask.any()]
