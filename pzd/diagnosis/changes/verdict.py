"""The verdict on what changed: which changes are told, what rivals them, and the test that would tell them apart."""

from __future__ import annotations

from typing import Literal, cast

import numpy as np

from pzd.artefacts import NextTest
from pzd.artefacts.changes import Changes, Verdict
from pzd.damper.model import Damper
from pzd.diagnosis.changes.candidates import ELEMENT_COLUMNS, Candidate
from pzd.diagnosis.changes.findings import Findings, is_gas
from pzd.diagnosis.changes.pairs import averaged
from pzd.diagnosis.changes.quantities import (
    as_it_was,
    changed_quantities,
    displacement_zero,
    is_determined,
    is_little,
    may_be_as_before,
    unchanged_of_laws,
    unchanged_quantities,
)
from pzd.diagnosis.changes.reason import NOTHING, at_one_condition, beyond_the_model, left_out_differ, reason_of
from pzd.diagnosis.changes.regression import Fitted
from pzd.diagnosis.cleaned_records import CleanedRecord
from pzd.diagnosis.fit.prediction import comparable_samples, predicted_force
from pzd.diagnosis.next_test import operating_envelope, separating_test
from pzd.diagnosis.verdict import knee_note
from pzd.rig.config import Limits
from pzd.signals.measures import rms

STAND_TESTS = {
    "load_cell_zero": "rest, the load cell unloaded",
    "load_cell_gain": "rest, a known weight on the load cell",
    "recorder_delay": "sine, a steel spring in the place of the damper",
}
"""What tells a doing of the stand from one of the damper, without the damper."""


def changes_of(found: Findings) -> Changes:
    """Return the verdict on a pair of states, with what changed, what did not, and what cannot be told apart."""
    best, rivals = found.best, _rivals(found)
    difference = found.difference(best)
    reported = changed_quantities(found, best)
    still = unchanged_of_laws(best, reported)
    reported = [change for change in reported if change not in still]
    hardly = [name for name in may_be_as_before(reported, of=("damper", "stand")) if is_little(reported, name)]
    reported = [change for change in reported if change.name not in hardly]
    rivals = {name: fits for name, fits in rivals.items() if name not in hardly}
    others = {
        name: list(dict.fromkeys(each for fitted in fits for each in _added(fitted, best)))
        for name, fits in rivals.items()
    }
    zero = displacement_zero(found)
    of_damper = [change for change in reported if change.of == "damper"]
    verdict: Verdict = "changed" if of_damper else "unchanged"
    if rivals:
        verdict = "ambiguous"
    told = list(dict.fromkeys(name for names in others.values() for name in names))
    much = found.left_share(difference) > found.diagnose.unexplained_share and found.may_be_seen(best)
    if much and not any(map(found.search.leaves_nothing, (best, *rivals.get(NOTHING, ())))):
        verdict = "unexplained"
        doubtful = {c.name for c in best.candidates if c.name in rivals or not _stands_out(found, best, c)}
        doubtful.update(may_be_as_before(reported))
        told = list(dict.fromkeys([*(c.name for c in reported if c.name in doubtful), *told]))
        reported = [change for change in reported if change.name not in doubtful]
    unreached = _not_reached_before(found, best)
    if unreached:
        told = list(dict.fromkeys([*unreached, *told]))
        reported = [change for change in reported if change.name not in unreached]
        verdict = "ambiguous" if verdict in ("changed", "unchanged") else verdict
    listed = sorted([*reported, *zero], key=lambda change: -change.share)
    kinds = {"cycles" if c.before is not None else "model" for c in found.comparisons}
    compared = cast("Literal['cycles', 'model', 'both']", "both" if len(kinds) > 1 else kinds.pop())
    reason = reason_of(found, verdict, listed, others, difference)
    if unreached:
        reason.append(
            f"{', '.join(unreached)} acts where no test of {found.before.name} came, and may have been there before"
        )
    as_before = [as_it_was(change) for change in still if is_determined(change)]
    loose = [change.parameter for change in still if not is_determined(change)]
    reason += [f"these tests do not determine {', '.join(loose)}"] if loose else []
    reason += [f"{' and '.join(hardly)} may be as before: next to nothing of the difference"] if hardly else []
    unchanged = tuple(each for each in (*as_before, *unchanged_quantities(found, best)) if each.name not in told)
    if verdict == "unchanged" and (beside := left_out_differ(found) or beyond_the_model(found, best)):
        verdict, reason = "unexplained", [*reason, beside]
    elif verdict == "unchanged" and (beside := at_one_condition(found, best)):
        verdict, reason = "unexplained", [*reason, beside]
        unchanged = tuple(each for each in unchanged if each.name not in ELEMENT_COLUMNS)
    return Changes(
        verdict=verdict,
        from_=found.before.name,
        to=found.after.name,
        compared=compared,
        difference=difference,
        changes=tuple(listed),
        unchanged=unchanged,
        rivals=tuple(told),
        reason="; ".join(reason) + knee_note(found.law, verdict, found.first.damper.base),
        next_test=_next_test(found, best, rivals),
    )


# --- Rivals


def _rivals(found: Findings) -> dict[str, list[Fitted]]:
    """Return what would do as well in the place of each change; what may have changed too, by `NOTHING`."""
    best = found.best
    rivals: dict[str, list[Fitted]] = {}
    for candidate in best.candidates:
        fits = [f for f in found.search.rivals(best, candidate) if not _same_gas(found, best, candidate, f)]
        if any(_added(f, best) for f in fits):
            rivals[candidate.name] = fits
    if found.leaves_visible(best) and (perhaps := found.search.perhaps(best)):
        rivals[NOTHING] = perhaps
    return rivals


def _same_gas(found: Findings, best: Fitted, candidate: Candidate, rival: Fitted) -> bool:
    zero = "load_cell_zero" in _added(rival, best)
    return candidate.name == "preload_offset" and zero and is_gas(found.comparisons, best)


def _added(fitted: Fitted, best: Fitted) -> list[str]:
    mine = {c.name for c in best.candidates}
    return [c.name for c in fitted.candidates if c.name not in mine]


def _stands_out(found: Findings, best: Fitted, candidate: Candidate) -> bool:
    """Whether a change makes more than what is left without a name, which may be of the same cause."""
    return found.search.size_of(best, candidate) > found.search.left(best)


# --- What no test of the first state reached


def _not_reached_before(found: Findings, best: Fitted) -> list[str]:
    """Return the effects newly there that would not have shown in any test of the first state, had they been."""
    return [
        c.name
        for c in best.candidates
        if c.absent
        and c.of == "damper"
        and not any(
            _shows(found, found.first.changed(c.coordinates, best.values_of(c).tolist(), None), test)
            for test in found.before.cleaned
        )
    ]


def _shows(found: Findings, changed: Damper, test: CleanedRecord) -> bool:
    """Whether a damper other than the first gives visibly another force in a test."""
    mask = comparable_samples(test)
    moved = (predicted_force(changed, test) - predicted_force(found.first.damper, test))[mask]
    peak = float(np.max(np.abs(test.record.force)))
    return bool(moved.size and rms(moved) >= found.diagnose.visible * peak)


# --- The test that tells more


def _next_test(found: Findings, best: Fitted, rivals: dict[str, list[Fitted]]) -> NextTest | None:
    """Return the test that tells the first change with rivals from these, in place or on the damper.

    Without any, where what the model misses hides what is left, a motion of the first state run again tells more.
    """
    if not rivals:
        return _motion_again(found) if found.search.hidden(best) > found.diagnose.visible else None
    name, fits = next(iter(rivals.items()))
    named = {", ".join(_added(f, best)): f for f in reversed(fits) if _added(f, best)}
    told = (name or "nothing", *reversed(named))
    of_stand = [c.name for f in (best, *fits) for c in f.candidates if c.name in STAND_TESTS and c.name in told]
    if of_stand:
        # At rest a stand shows itself, and nothing of what else may have changed beside nothing.
        separates = tuple(dict.fromkeys((of_stand[0], *(each for each in told if each != "nothing"))))
        waveform = STAND_TESTS[of_stand[0]]
        return NextTest(waveform=waveform, frequency_Hz=None, amplitude_m=None, voltage_V=None, separates=separates)
    dampers = [found.first.changed(f.coordinates, f.values.tolist(), None) for f in (best, *reversed(named.values()))]
    cleaned = (*found.before.cleaned, *found.after.cleaned)
    voltages = [v for v in found.voltages() if v is not None]
    envelope = operating_envelope(Limits(), cleaned, voltages)
    return separating_test(list(zip(told, dampers, strict=True)), envelope, found.temperatures()[0])


def _motion_again(found: Findings) -> NextTest | None:
    """Return the test of the first state with the largest force, where no motion of it was run again."""
    own = averaged(found.before.cleaned)
    if not own or any(c.before is not None for c in found.comparisons):
        return None
    test = max(own, key=lambda each: float(np.max(np.abs(each.cleaned.folded))))
    return NextTest(
        waveform=f"the motion of {test.record.name} in {found.before.name}, run again",
        frequency_Hz=test.frequency,
        amplitude_m=2.0 * float(np.abs(test.displacement[1])),
        voltage_V=test.voltage,
        separates=("what changed", "what the model misses"),
    )
