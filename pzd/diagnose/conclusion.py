"""From the effects selected to the damper handed on and the verdict: no harm, no name for what only seems to be one."""

from __future__ import annotations

from pzd.diagnose.config import DiagnoseConfig
from pzd.diagnose.handed_on import HandedOn, handed_on, with_additions
from pzd.diagnose.kept_back import Trials
from pzd.diagnose.search.selection import Selection
from pzd.diagnose.trends_of_tests import trend_of_tests
from pzd.diagnose.verdict import Decision, decide, refused, unless_systematic, with_added


def concluded(selection: Selection, trials: Trials, config: DiagnoseConfig, unit: str) -> tuple[HandedOn, Decision]:
    """What is handed on of the selected effects, and the verdict.

    Parameters
    ----------
    selection : what was adopted
    trials : the tests, dealt into folds
    config : thresholds, forced and forbidden effects
    unit : of the control signal, for the words
    """
    handed = handed_on(selection, trials, config.force, unit)
    decision = refused(handed.refused) if handed.refused else decide(handed.selection, config)
    if decision.verdict != "unexplained":
        found = handed.selection.fitted.damper
        decision = unless_systematic(decision, trend_of_tests(selection.first.campaign, found, config))
    if decision.verdict == "unexplained":
        handed = with_additions(handed, trials, config)
        decision = with_added(decision, handed.added)
    return handed, decision
