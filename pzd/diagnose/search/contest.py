"""Every other effect in the place of one adopted early, beside all that was adopted after it."""

from __future__ import annotations

from collections.abc import Callable

from pzd.damper.nature import against_nature
from pzd.diagnose.config import DiagnoseConfig
from pzd.diagnose.fit.least_squares import Fitted
from pzd.diagnose.fit.parameters import Problem
from pzd.diagnose.search.candidates import Candidate, as_candidate, candidates, nearly_as_good
from pzd.diagnose.search.selection import Round, rivals_of


def contest(
    problem: Problem,
    without: Fitted,
    name: str,
    current: Fitted,
    refused: Callable[[Candidate], str | None],
    config: DiagnoseConfig,
    jobs: int,
) -> tuple[Round, Candidate]:
    """The step in which an effect was adopted, taken again; and what is adopted in it.

    What came first was chosen beside less than is adopted now, and may have stood in for what came later. It stays
    where nothing that the data support is better by more than rivals differ, and nature has its values.

    Parameters
    ----------
    problem : what is fitted to what
    without : the optimum with all that was adopted but this effect
    name : of the effect
    current : the optimum with it
    refused : why the data do not support a candidate beside `without`, None where they do
    config : how near a rival comes
    jobs : candidates fitted at the same time
    """
    own = as_candidate(problem, without, name, current)
    tried = [c for c in candidates(problem, without, config.forbid, jobs) if c.effect != name]
    ended = sorted((own, *nearly_as_good(problem, without, own, tried)), key=lambda c: c.delta_bic)
    close = [c for c in ended if c is not own and c.delta_bic - own.delta_bic < config.rival_bic]
    stand_ins = frozenset(c.effect for c in close if refused(c))
    alike = [c for c in close if c.effect not in stand_ins]
    kept = next((c for c in alike if _better(c, own, config.rival_bic)), own)
    return Round(tuple(ended), kept.effect, rivals_of(kept, (*alike, own), config), stand_ins), kept


def _better(other: Candidate, own: Candidate, rival_bic: float) -> bool:
    """Whether a candidate takes the place of the effect adopted."""
    if against_nature(other.fitted.damper):
        return False
    return other.delta_bic < own.delta_bic - rival_bic or bool(against_nature(own.fitted.damper))
