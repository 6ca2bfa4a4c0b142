"""From two states of a damper to what changed between them: the steps in order, and the words of the verdict."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal, cast

import numpy as np

from pzd.artefacts import NextTest
from pzd.artefacts.changes import Change, Changes, Difference, Numbers, Unchanged, Verdict, holds_what_was
from pzd.damper.compose import steady_force
from pzd.damper.effect import NODE_VOLTAGES
from pzd.damper.effects.accumulator import POLYTROPIC
from pzd.damper.fitted_laws import knee
from pzd.damper.model import Damper
from pzd.damper.parameter_rows import nearest_condition, rows_per_voltage
from pzd.diagnosis.changes.candidates import (
    ELEMENT_COLUMNS,
    Candidate,
    Coordinate,
    FirstState,
    Of,
    Response,
    candidates,
    element_of,
    known_effect,
    known_parameter,
    nearest_node,
    parameter_value,
    values_by_control,
)
from pzd.diagnosis.changes.compared_tests import BEYOND_TESTED, comparisons_of, error_in_own_tests
from pzd.diagnosis.changes.pairs import (
    Comparison,
    averaged,
    course,
    has_average_cycle,
    stacked,
    unstacked,
)
from pzd.diagnosis.changes.regression import Fitted, Likelihood, Regression
from pzd.diagnosis.changes.selection import Search
from pzd.diagnosis.changes.state import State
from pzd.diagnosis.changes.uncertainty import Uncertainty
from pzd.diagnosis.config import DiagnoseConfig
from pzd.diagnosis.data import PreparedRecord
from pzd.diagnosis.fit.prediction import comparable_samples, predicted_force
from pzd.diagnosis.next_test import operating_envelope, separating_test
from pzd.diagnosis.verdict import knee_note
from pzd.fit.intervals import LEVEL
from pzd.identification.config import IdentifyConfig
from pzd.identification.knee import TRADE_SPEEDS
from pzd.quantities import Control
from pzd.record import CONSTANT_SHARE, Array, mid_stroke
from pzd.rig.config import Limits
from pzd.schema.errors import counted
from pzd.signals.measures import criterion, rms

GAS_LENGTHS = (1.0, 100.0)
"""Shortest and longest gas column, in half strokes, whose force and stiffness change together as those of a gas do.

Reason: shorter than the stroke it could not be compressed, and one of a hundred half strokes hardens by a hundredth."""
GAS_FORCES = ("preload_offset", "gas_spring")
"""Effects that a change of the gas is told as where they explain it: its force and its stiffness."""
SHOWN = 0.3
"""Change of a coordinate that must be visible for a quantity to be told unchanged: a third of T0, C, k or the scale of
an effect. What moves the force by less is not shown by the tests."""
STAND_TESTS = {
    "load_cell_zero": "rest, the load cell unloaded",
    "load_cell_gain": "rest, a known weight on the load cell",
    "recorder_delay": "sine, a steel spring in the place of the damper",
}
"""What tells a doing of the stand from one of the damper, without the damper."""
LARGE_MODEL_ERROR = 0.05
"""Share of the force (r.m.s.) that the first damper misses in its own tests from which values are its model's.

Reason: a model off by a twentieth has T0 and C off by about as much, more than the intervals of a change; not tuned."""
LITTLE = 0.05
"""Share of the difference (mean square) below which a change is believed only where its intervals leave out what was
before. Not tuned."""
GONE = 1e-3
"""Share of an interval by which a value may differ from that of an effect that is off, and be it.

Reason: far less than any interval tells; the search ends so near to a limit. Not tuned."""
ONE_CONDITION = 2.0
"""Times what is visible that has to be left at one condition alone: its few tests differ by more than all together."""
NOTHING = ""
"""In the place of a name: what rivals nothing."""
MOST_NAMES = 3
"""Tests of a kind that are named in a sentence."""
SAME_RECORDING = 1e-9
"""Difference of force, as a share of the peak, of a recording from itself: the rounding of the averages."""
EXCHANGED_LEAVES = 0.3
"""Share (r.m.s.) that is left of a difference which comes of rebound and compression being exchanged.

Reason: a tenth of it as a mean square; a damper that changed otherwise differs as much from its mirror image. Not
tuned."""
ZERO_SHARE = 0.01
"""Shift of the mean displacement that is reported, as a share of the half stroke: an actuator centres so well."""


@dataclass(frozen=True, eq=False)
class ComparedCycle:
    """One compared motion over the cycle, for the picture; every array is (points,)."""

    before: str | None
    after: str
    voltage: float | None
    displacement: Array
    velocity: Array
    force_before: Array
    force_after: Array
    explained: Array
    """Difference that the changes make [N]."""


@dataclass(frozen=True, eq=False)
class Compared:
    """What changed, and the curves behind it."""

    changes: Changes
    cycles: tuple[ComparedCycle, ...]
    undetermined: tuple[str, ...] = ()
    """Why the result is not to be trusted: T0 or C of a state is undetermined."""


def changes_between(
    before: State, after: State, diagnose: DiagnoseConfig, identify: IdentifyConfig, control: Control
) -> Compared:
    """Find what changed between two states of a damper.

    Parameters
    ----------
    before : the first state, whose damper carries small differences of motion and stands in for motions not run in it
    after : the second state
    diagnose : thresholds and the priors on how tests differ
    identify : for what counts as one condition
    control : the control signal, for units

    Raises
    ------
    DataError : when no test of the second state can be compared
    """
    findings = findings_between(before, after, diagnose, identify, control)
    return Compared(findings.changes(), findings.cycles(), (*before.undetermined, *after.undetermined))


def findings_between(
    before: State, after: State, diagnose: DiagnoseConfig, identify: IdentifyConfig, control: Control
) -> Findings:
    """Compare two states and search for what changed; see `changes_between`."""
    known = error_in_own_tests(before, diagnose.nuisance)
    comparisons = comparisons_of(before, after, identify, diagnose.nuisance, known)
    mean = float(np.mean([c.mean_displacement for c in comparisons]))
    peak, middle = max(c.peak for c in comparisons), mid_stroke(r.displacement for r in before.records)
    first = FirstState(before.damper.about(mean), peak, before.scales(), middle)
    likelihood = Likelihood(comparisons, diagnose.nuisance, known.share)
    regression = Regression(likelihood, Response(first, comparisons))
    search = Search(
        regression, candidates(first, comparisons), diagnose.adopt_bic, diagnose.rival_bic, diagnose.visible
    )
    best = _with_gas_force(search, search.run())
    return Findings(first, search, best, diagnose, control, before, after, identify.law)


def _with_gas_force(search: Search, best: Fitted) -> Fitted:
    """Put a gas force in the place of a load-cell zero beside a gas spring that changed as that of a gas does."""
    names = {c.name for c in best.candidates}
    if "load_cell_zero" not in names or "gas_spring" not in names:
        return best
    zero = next(c for c in best.candidates if c.name == "load_cell_zero")
    preload = next(c for c in search.candidates if c.name == "preload_offset")
    less = search.without(best, zero)
    start = np.concatenate([less.values, [0.0]])
    swapped = search.regression.fit((*less.candidates, preload), start, best.scatter)
    return swapped if _is_gas(search.regression.comparisons, swapped) else best


def _is_gas(comparisons: Sequence[Comparison], fitted: Fitted) -> bool:
    """Whether force and stiffness beside the element changed in the proportion of a gas column.

    Equation: dF_0 = - dk_g L / n, L the length of the gas column, n the exponent of the gas
    """
    changed = {c.parameter: x * c.scale for c, x in zip(fitted.coordinates, fitted.values, strict=True)}
    if "F_0" not in changed or "k_g" not in changed or changed["k_g"] == 0.0:
        return False
    length = -POLYTROPIC * changed["F_0"] / changed["k_g"]
    half_stroke = max(c.amplitude for c in comparisons)
    return bool(GAS_LENGTHS[0] * half_stroke <= length <= GAS_LENGTHS[1] * half_stroke)


# --- Tests that have no average cycle


def _not_averaged(state: State) -> list[PreparedRecord]:
    """Return the tests in which the control signal moves, or no cycle repeats."""
    return [test for test in state.prepared if not has_average_cycle(test)]


def _error_share(damper: Damper, tests: Sequence[PreparedRecord]) -> float | None:
    """Compute the error of a damper in tests as they were run, as a share of the force (r.m.s.); None without one."""
    if not tests:
        return None
    masks = [comparable_samples(test) for test in tests]
    measured = np.concatenate([test.record.force[mask] for test, mask in zip(tests, masks, strict=True)])
    made = np.concatenate([predicted_force(damper, test)[mask] for test, mask in zip(tests, masks, strict=True)])
    return float(np.sqrt(criterion(measured - made, measured))) if measured.any() else None


def _first(names: Sequence[str]) -> str:
    """Return some names in words, the first few of many."""
    return ", ".join(names[:MOST_NAMES]) + (" and others" if len(names) > MOST_NAMES else "")


# --- What is found


def _beyond_noise(difference: Difference) -> float:
    """Return what is left of a difference beyond the noise, r.m.s. [N]."""
    return float(np.sqrt(max(difference.left_N**2 - difference.noise_N**2, 0.0)))


@dataclass(frozen=True, eq=False)
class Findings:
    """The fitted changes, and what of them is reported."""

    first: FirstState
    search: Search
    best: Fitted
    diagnose: DiagnoseConfig
    control: Control
    before: State
    after: State
    law: str
    """`identify.law` of the first state."""

    @property
    def comparisons(self) -> tuple[Comparison, ...]:
        """What is compared."""
        return self.search.regression.comparisons

    def changes(self) -> Changes:
        """Return verdict and tables."""
        best, rivals = self.best, self._rivals()
        difference = self.difference(best)
        reported = self._reported(best)
        still = self._still(best, reported)
        reported = [change for change in reported if change not in still]
        hardly = [name for name in _may_be_as_before(reported, of=("damper", "stand")) if _is_little(reported, name)]
        reported = [change for change in reported if change.name not in hardly]
        rivals = {name: fits for name, fits in rivals.items() if name not in hardly}
        others = {
            name: list(dict.fromkeys(each for fitted in fits for each in _added(fitted, best)))
            for name, fits in rivals.items()
        }
        zero = self._displacement_zero()
        of_damper = [change for change in reported if change.of == "damper"]
        verdict: Verdict = "changed" if of_damper else "unchanged"
        if rivals:
            verdict = "ambiguous"
        told = list(dict.fromkeys(name for names in others.values() for name in names))
        much = self._left_share(difference) > self.diagnose.unexplained_share and self._may_be_seen(difference)
        if much and not any(map(self.search.leaves_nothing, (best, *rivals.get(NOTHING, ())))):
            verdict = "unexplained"
            doubtful = {c.name for c in best.candidates if c.name in rivals or not self._stands_out(best, c)}
            doubtful.update(_may_be_as_before(reported))
            told = list(dict.fromkeys([*(c.name for c in reported if c.name in doubtful), *told]))
            reported = [change for change in reported if change.name not in doubtful]
        unreached = self._not_reached_before(best)
        if unreached:
            told = list(dict.fromkeys([*unreached, *told]))
            reported = [change for change in reported if change.name not in unreached]
            verdict = "ambiguous" if verdict in ("changed", "unchanged") else verdict
        listed = sorted([*reported, *zero], key=lambda change: -change.share)
        kinds = {"cycles" if c.before is not None else "model" for c in self.comparisons}
        compared = cast("Literal['cycles', 'model', 'both']", "both" if len(kinds) > 1 else kinds.pop())
        reason = self._reason(verdict, listed, others, difference)
        if unreached:
            reason.append(
                f"{', '.join(unreached)} acts where no test of {self.before.name} came, and may have been there before"
            )
        as_before = [_as_before(change) for change in still if _is_determined(change)]
        loose = [change.parameter for change in still if not _is_determined(change)]
        reason += [f"these tests do not determine {', '.join(loose)}"] if loose else []
        reason += [f"{' and '.join(hardly)} may be as before: next to nothing of the difference"] if hardly else []
        unchanged = tuple(each for each in (*as_before, *self._unchanged(best)) if each.name not in told)
        if verdict == "unchanged" and (beside := self._left_out_differs() or self._beyond_the_model(best)):
            verdict, reason = "unexplained", [*reason, beside]
        elif verdict == "unchanged" and (beside := self._at_one_condition(best)):
            verdict, reason = "unexplained", [*reason, beside]
            unchanged = tuple(each for each in unchanged if each.name not in ELEMENT_COLUMNS)
        return Changes(
            verdict=verdict,
            from_=self.before.name,
            to=self.after.name,
            compared=compared,
            difference=difference,
            changes=tuple(listed),
            unchanged=unchanged,
            rivals=tuple(told),
            reason="; ".join(reason) + knee_note(self.law, verdict, self.first.damper.base),
            next_test=self._next_test(best, rivals),
        )

    def difference(self, best: Fitted) -> Difference:
        """Return the size of the difference and of what is left of it."""
        whole = float(np.mean([c.difference @ c.difference for c in self.comparisons]))
        likelihood = self.search.regression.likelihood
        missed = [np.sum(likelihood.missed_by_model(i)) for i in range(len(self.comparisons))]
        noise = float(np.mean([np.sum(c.variance) + m for c, m in zip(self.comparisons, missed, strict=True)]))
        left = self._left(best)
        explained = 1.0 - max(left - noise, 0.0) / (whole - noise) if whole > noise else 0.0
        return Difference(
            rms_N=whole**0.5,
            share_of_peak=whole**0.5 / self.first.force,
            noise_N=noise**0.5,
            left_N=left**0.5,
            explained=float(np.clip(explained, 0.0, 1.0)),
        )

    def _left(self, fitted: Fitted) -> float:
        """Return the mean square that a fit leaves beside each test's own offset, gain and delay [N^2]."""
        own = self.search.regression.likelihood.own_of_tests(fitted.residuals, fitted.scatter)
        return float(np.mean([(r - o) @ (r - o) for r, o in zip(fitted.residuals, own, strict=True)]))

    def _left_share(self, difference: Difference) -> float:
        whole = difference.rms_N**2 - difference.noise_N**2
        return _beyond_noise(difference) / float(np.sqrt(whole)) if whole > 0.0 else 0.0

    def _rivals(self) -> dict[str, list[Fitted]]:
        """Return what would do as well in the place of each change; what may have changed too, by `NOTHING`."""
        best = self.best
        rivals: dict[str, list[Fitted]] = {}
        for candidate in best.candidates:
            fits = [f for f in self.search.rivals(best, candidate) if not self._same_gas(best, candidate, f)]
            if any(_added(f, best) for f in fits):
                rivals[candidate.name] = fits
        if self._visible_left(best) and (perhaps := self.search.perhaps(best)):
            rivals[NOTHING] = perhaps
        return rivals

    def _visible_left(self, best: Fitted) -> bool:
        """Whether a fit leaves more beyond the noise than counts as nothing.

        Taken for granted where a test is compared through the model, since what that misses counts as noise.
        """
        if any(c.before is None for c in self.comparisons):
            return True
        return _beyond_noise(self.difference(best)) >= self.diagnose.visible * self.first.force

    def _may_be_seen(self, difference: Difference) -> bool:
        """Whether what is left may be seen: where the model stands for every test, a visible share of the peak.

        Of a difference that is hardly visible itself the error of the model makes up any share.
        """
        beyond = _beyond_noise(difference) >= self.diagnose.visible * self.first.force
        return beyond or any(c.before is not None for c in self.comparisons)

    def _left_out_differs(self) -> str | None:
        """Say by how much worse the first damper predicts the tests that are not compared; None where it does not.

        What is seen where the control signal moves alone, as a lag of the valve, changes no average cycle.
        """
        tests = [_not_averaged(state) for state in (self.before, self.after)]
        own, other = (_error_share(self.first.damper, each) for each in tests)
        if own is None or other is None or other <= BEYOND_TESTED * own + self.diagnose.visible:
            return None
        return (
            f"but of the tests left out the damper of {self.before.name} misses {100.0 * other:.2g} % in "
            f"{self.after.name} and {100.0 * own:.2g} % in {self.before.name} (r.m.s., of the force): what changed "
            "shows there alone, and has no name"
        )

    def _stroke_beyond(self) -> str | None:
        """Say which compared test goes farthest beyond the stroke of the first state; None where none does."""
        strokes = [float(np.max(np.abs(r.displacement - self.first.middle_m))) for r in self.before.records]
        farthest = {
            r.name: float(np.max(np.abs(r.displacement - self.first.middle_m)))
            for r in self.after.records
            if r.name in {c.after for c in self.comparisons}
        }
        test = max(farthest, key=lambda name: farthest[name])
        if farthest[test] <= (1.0 + CONSTANT_SHARE) * max(strokes):
            return None
        return (
            f"{test} goes {_digits(1e3 * farthest[test])} mm from the middle, the tests of {self.before.name} "
            f"{_digits(1e3 * max(strokes))} mm: what acts there alone may be no change"
        )

    def _beyond_the_model(self, best: Fitted) -> str | None:
        """Say which test compared through the model differs by more than the first damper may miss; None if none does.

        Beside tests compared cycle by cycle these decide nothing else, but an end stop may be reached in them alone.
        """
        if all(c.before is None for c in self.comparisons):
            return None
        beyond = {
            c.after: left**0.5 / c.peak
            for c, left, missed in self._left_of_tests(best)
            if c.before is None and left > missed + (self.diagnose.visible * c.peak) ** 2
        }
        if not beyond:
            return None
        test = max(beyond, key=lambda name: beyond[name])
        return (
            f"but {test} differs from what the damper of {self.before.name} would give there by "
            f"{100.0 * beyond[test]:.2g} % of its peak, more than that damper misses in its own tests: what shows "
            "there alone has no name"
        )

    def _at_one_condition(self, best: Fitted) -> str | None:
        """Say at which condition the force changed that is the same at all others; None where it did at none.

        T0, C and k change at a control signal or at all, and over all tests what changed at one temperature alone is
        too little to be seen.
        """
        where, left = self._most_left(best)
        if left <= ONE_CONDITION * max(self.diagnose.visible, self.search.hidden(best)):
            return None
        return f"but {where} {100.0 * left:.2g} % of peak is left: what changed there alone has no name"

    def _most_left(self, best: Fitted) -> tuple[str, float]:
        """Return the condition at which most is left, and how much (r.m.s., share of peak).

        Beyond noise, what the model may miss, and each test's own offset, gain and delay; nothing where there is one
        condition alone.
        """
        rows, squares = self.first.damper.base, dict[int, list[float]]()
        for c, left, missed in self._left_of_tests(best):
            row = nearest_condition(rows, c.voltage, c.temperature)
            squares.setdefault(row, []).append((left - missed) / c.peak**2)
        if len(squares) < 2:
            return "", 0.0
        means = {row: float(np.mean(each)) for row, each in squares.items()}
        most = max(means, key=lambda row: means[row])
        told = [
            f"{rows[most].voltage_V:.4g} {self.control.unit}" if len(rows_per_voltage(rows)) > 1 else "",
            f"{rows[most].temperature_degC:.3g} degC" if len({row.temperature_degC for row in rows}) > 1 else "",
        ]
        return f"at {' and '.join(filter(None, told))}", max(means[most], 0.0) ** 0.5

    def _left_of_tests(self, best: Fitted) -> Iterator[tuple[Comparison, float, float]]:
        """Yield every comparison with what is left of it beyond noise and its own offset, gain and delay [N^2].

        And with what the first damper may miss of it, as far as an interval goes [N^2].
        """
        likelihood = self.search.regression.likelihood
        own = likelihood.own_of_tests(best.residuals, best.scatter)
        for i, (r, o, c) in enumerate(zip(best.residuals, own, self.comparisons, strict=True)):
            left = float((r - o) @ (r - o) - np.sum(c.variance))
            yield c, left, LEVEL**2 * float(np.sum(likelihood.missed_by_model(i)))

    def _not_reached_before(self, best: Fitted) -> list[str]:
        """Return the effects newly there that would not have shown in any test of the first state, had they been."""
        return [
            c.name
            for c in best.candidates
            if c.absent
            and c.of == "damper"
            and not any(
                self._shows(self.first.changed(c.coordinates, best.values_of(c).tolist(), None), test)
                for test in self.before.prepared
            )
        ]

    def _shows(self, changed: Damper, test: PreparedRecord) -> bool:
        """Whether a damper other than the first gives visibly another force in a test."""
        mask = comparable_samples(test)
        moved = (predicted_force(changed, test) - predicted_force(self.first.damper, test))[mask]
        peak = float(np.max(np.abs(test.record.force)))
        return bool(moved.size and rms(moved) >= self.diagnose.visible * peak)

    def _stands_out(self, best: Fitted, candidate: Candidate) -> bool:
        """Whether a change makes more than what is left without a name, which may be of the same cause."""
        return self.search.size_of(best, candidate) > self.search.left(best)

    def _next_test(self, best: Fitted, rivals: dict[str, list[Fitted]]) -> NextTest | None:
        """Return the test that tells the first change with rivals from these, in place or on the damper.

        Without any, where what the model misses hides what is left, a motion of the first state run again tells more.
        """
        if not rivals:
            return self._motion_again() if self.search.hidden(best) > self.diagnose.visible else None
        name, fits = next(iter(rivals.items()))
        named = {", ".join(_added(f, best)): f for f in reversed(fits) if _added(f, best)}
        told = (name or "nothing", *reversed(named))
        of_stand = [c.name for f in (best, *fits) for c in f.candidates if c.name in STAND_TESTS and c.name in told]
        if of_stand:
            # At rest a stand shows itself, and nothing of what else may have changed beside nothing.
            separates = tuple(dict.fromkeys((of_stand[0], *(each for each in told if each != "nothing"))))
            waveform = STAND_TESTS[of_stand[0]]
            return NextTest(waveform=waveform, frequency_Hz=None, amplitude_m=None, voltage_V=None, separates=separates)
        dampers = [
            self.first.changed(f.coordinates, f.values.tolist(), None) for f in (best, *reversed(named.values()))
        ]
        prepared = (*self.before.prepared, *self.after.prepared)
        voltages = [v for v in self._voltages() if v is not None]
        envelope = operating_envelope(Limits(), prepared, voltages)
        return separating_test(list(zip(told, dampers, strict=True)), envelope, self._temperatures()[0])

    def _motion_again(self) -> NextTest | None:
        """Return the test of the first state with the largest force, where no motion of it was run again."""
        own = averaged(self.before.prepared)
        if not own or any(c.before is not None for c in self.comparisons):
            return None
        test = max(own, key=lambda each: float(np.max(np.abs(each.prepared.folded))))
        return NextTest(
            waveform=f"the motion of {test.record.name} in {self.before.name}, run again",
            frequency_Hz=test.frequency,
            amplitude_m=2.0 * float(np.abs(test.displacement[1])),
            voltage_V=test.voltage,
            separates=("what changed", "what the model misses"),
        )

    def _same_gas(self, best: Fitted, candidate: Candidate, rival: Fitted) -> bool:
        zero = "load_cell_zero" in _added(rival, best)
        return candidate.name == "preload_offset" and zero and _is_gas(self.comparisons, best)

    # --- Tables

    def refitted(self, candidates: Sequence[Candidate]) -> list[Change]:
        """Return the quantities of some candidates fitted together, whether they changed or not."""
        if not candidates:
            return []
        kept = [c for c in self.best.candidates if c in candidates]
        start = [self.best.values_of(c) if c in kept else np.array(c.starts[0]) for c in candidates]
        fitted = self.search.regression.fit(candidates, np.concatenate(start), self.best.scatter)
        return [change for change in self._reported(fitted) if change.of == "damper"]

    def _reported(self, best: Fitted) -> list[Change]:
        if not best.candidates:
            return []
        errors = Uncertainty(self.search, best).errors
        whole = float(np.mean([c.difference @ c.difference for c in self.comparisons]))
        found = []
        for candidate in best.candidates:
            less = self.search.without(best, candidate)
            share = float(np.clip((less.mean_square - best.mean_square) / whole, 0.0, 1.0)) if whole > 0.0 else 0.0
            for name, parameter in candidate.key:
                mine = [
                    (c, float(x), float(e))
                    for c, x, e in zip(best.coordinates, best.values, errors, strict=True)
                    if (c.name, c.parameter) == (name, parameter)
                ]
                found.append(self._change(mine, share))
        unique = {(c.name, c.parameter): c for c in found}
        return list(unique.values())

    def _change(self, mine: Sequence[tuple[Coordinate, float, float]], share: float) -> Change:
        c = mine[0][0]
        at, start, to, low, high = self._values(mine)
        name, parameter, unit = c.name, c.parameter, self.control.own_unit(c.unit)
        if c.name == "temperature":
            parameter, unit = "temperature", "degC"
        visible = "beyond what the tests of one state differ by"
        return Change(
            name=name,
            parameter=parameter,
            of=c.of,
            unit=unit,
            from_=start,
            to=to,
            low95=low,
            high95=high,
            at_voltage_V=at,
            share=share,
            reason=f"adopted: it makes {100.0 * share:.3g} % of the difference, {visible}",
        )

    def _still(self, best: Fitted, reported: Sequence[Change]) -> list[Change]:
        """Return the numbers of laws of both states that may be as they were, where others of the same law are not."""
        by_key = {(change.name, change.parameter): change for change in reported}
        found = []
        for candidate in best.candidates:
            own = [by_key[key] for key in candidate.key if key in by_key]
            held = [change for change in own if _holds_what_was(change)]
            found += held if len(held) < len(own) and not candidate.absent else []
        return found

    def _values(
        self, mine: Sequence[tuple[Coordinate, float, float]]
    ) -> tuple[tuple[float, ...] | None, Numbers, Numbers, Numbers, Numbers]:
        """Return the voltages, and the value in the first state, in the second, and the ends of its interval.

        What no test shows, its error infinite, has neither a value in the second state nor an interval.
        """
        c, x, e = mine[0]
        if c.name == "temperature":
            start, to = self._temperatures()
            return None, start, to, to, to
        if c.of == "stand":
            return None, 0.0, x * c.scale, (x - LEVEL * e) * c.scale, (x + LEVEL * e) * c.scale
        if c.name in ELEMENT_COLUMNS:
            return self._element_values(mine)
        own = self.first.damper.effects.get(c.name, {}).get(c.parameter)
        nodes = self.first.damper.effects[c.name][NODE_VOLTAGES] if isinstance(own, tuple) else None
        at = cast("tuple[float, ...] | None", nodes)
        if not np.isfinite(e):
            return at, own, None, None, None
        if isinstance(own, tuple):
            ends = np.sort([values_by_control(c, own, x + s * LEVEL * e) for s in (-1.0, 0.0, 1.0)], axis=0)
            return at, own, tuple(ends[1].tolist()), tuple(ends[0].tolist()), tuple(ends[2].tolist())
        neutral = known_parameter(c.name, c.parameter).neutral
        start_value = own if own is not None else (neutral if np.isfinite(neutral) else None)
        low, to, high = sorted(parameter_value(c, x + s * LEVEL * e) for s in (-1.0, 0.0, 1.0))
        if abs(to - neutral) < GONE * (high - low):
            to = neutral  # a fit ends a hair inside its limits
        return None, start_value, to, low, high

    def _element_values(
        self, mine: Sequence[tuple[Coordinate, float, float]]
    ) -> tuple[tuple[float, ...] | None, Numbers, Numbers, Numbers, Numbers]:
        c = mine[0][0]
        column = list(ELEMENT_COLUMNS).index(c.name)
        voltages = self._voltages()
        groups = rows_per_voltage(self.first.damper.base)
        temperature = self._temperatures()[0]

        def at(values: Sequence[float]) -> list[float]:
            damper = self.first.changed([each for each, _, _ in mine], values, None)
            return [float(element_of(damper, v, temperature)[column]) for v in voltages]

        start = at([0.0] * len(mine))
        shown = [e if np.isfinite(e) else 0.0 for _, _, e in mine]
        after, one, other = (
            at([x + s * LEVEL * e for (_, x, _), e in zip(mine, shown, strict=True)]) for s in (0.0, -1.0, 1.0)
        )
        unseen = {c.node for c, _, e in mine if not np.isfinite(e)}
        known = [None not in unseen and (v is None or nearest_node(groups, v) not in unseen) for v in voltages]
        least, most = [*map(min, one, other)], [*map(max, one, other)]
        if c.name == "T0":  # a fit ends a hair inside its limit of none
            after = [0.0 if to < GONE * (high - low) else to for to, low, high in zip(after, least, most, strict=True)]
        columns = (after, least, most)
        to, low, high = (tuple(v if k else None for v, k in zip(column, known, strict=True)) for column in columns)
        if len(groups) < 2 or len(voltages) < 2:
            return None, start[0], to[0], low[0], high[0]
        return tuple(cast("list[float]", voltages)), tuple(start), to, low, high

    def _voltages(self) -> list[float | None]:
        """Return the control signals of the compared tests at which the first state has parameters."""
        groups = [voltage for voltage, _ in rows_per_voltage(self.first.damper.base)]
        known = sorted(
            {min(groups, key=lambda g: abs(g - c.voltage)) for c in self.comparisons if c.voltage is not None}  # type: ignore[operator]  # not None
        )
        return list(known) or [None]

    def _temperatures(self) -> tuple[float | None, float | None]:
        """Return the mean temperatures of the compared tests in both states [degC]."""
        before = [c.temperature for c in self.comparisons if c.temperature is not None]
        warmer = [c.warmer for c in self.comparisons if c.warmer is not None]
        if not before or not warmer:
            return (float(np.mean(before)) if before else None), None
        return float(np.mean(before)), float(np.mean(before) + np.mean(warmer))

    def _displacement_zero(self) -> list[Change]:
        """Return the shift of the mean displacement, where it is large: the zero of its sensor, or of the stroke."""
        shifts = np.array([c.displacement_zero for c in self.comparisons if c.before is not None])
        if not shifts.size:
            return []
        mean = float(np.mean(shifts))
        spread = float(np.std(shifts, ddof=1)) / np.sqrt(shifts.size) if shifts.size > 1 else 0.0
        if abs(mean) < max(ZERO_SHARE * max(c.amplitude for c in self.comparisons), 2.0 * LEVEL * spread):
            return []
        return [
            Change(
                name="displacement_zero", parameter="displacement_zero", of="stand", unit="m", from_=0.0, to=mean,
                low95=mean - LEVEL * spread, high95=mean + LEVEL * spread, share=0.0,
                reason="the displacement has another middle; forces are compared about the middle of each",
            )
        ]  # fmt: skip

    def _unchanged(self, best: Fitted) -> tuple[Unchanged, ...]:
        """List what would have shown a visible change, and has not changed visibly.

        No T0 that is not told from 0 where a branch holds the friction: none of the damper would seem to be there.
        """
        known = Uncertainty(self.search, best)
        branched = any(known_effect(name).place == "branch" for name in self.first.damper.effects)
        found: dict[tuple[str, str], Unchanged] = {}
        for candidate in filter(known.tells, self.search.candidates):
            if candidate.key[0] in found:
                continue
            (c,) = candidate.coordinates
            if_changed = known.if_changed(candidate)
            most = self.diagnose.visible / if_changed.force if if_changed.force > 0.0 else np.inf
            if most > SHOWN or LEVEL * if_changed.alone > most or abs(if_changed.value) > most:
                continue
            at, start, to, low, high = self._values([(c, if_changed.value, if_changed.error)])
            if branched and c.name == "T0" and any(not end for end in (low if isinstance(low, tuple) else (low,))):
                continue
            found[candidate.key[0]] = Unchanged(
                name=c.name, parameter=c.parameter, unit=self.control.own_unit(c.unit), from_=start, to=to,
                low95=low, high95=high, at_voltage_V=at,
            )  # fmt: skip
        return tuple(found.values())

    # --- Words

    def _reason(
        self, verdict: Verdict, listed: Sequence[Change], rivals: dict[str, list[str]], difference: Difference
    ) -> list[str]:
        of_damper = list(dict.fromkeys(c.name for c in listed if c.of == "damper"))
        of_stand = list(dict.fromkeys(c.name for c in listed if c.of == "stand"))
        size = f"the force differs by {_digits(difference.rms_N)} N r.m.s."
        peak = f"{_digits(100.0 * difference.share_of_peak, 2)} % of peak"
        left, noise = _digits(difference.left_N), _digits(difference.noise_N)
        told = [f"{size}, {peak}, of which {left} N are left, {noise} N of them noise"]
        if of_damper:
            told.append(f"of the damper: {', '.join(of_damper)}")
            told += [words for name in of_damper if (words := self._kind_of_friction(name))]
            told += self._gas_before(of_damper)
            told += self._by_law_told(of_damper)
        elif verdict == "unchanged":
            told.append("nothing of the damper changed visibly")
            if (hidden := self.search.hidden(self.best)) > self.diagnose.visible:
                told.append(
                    f"less than {100.0 * hidden:.2g} % of peak would not be seen, since the damper of "
                    f"{self.before.name} misses as much"
                )
            if (noise_share := difference.noise_N / self.first.force) > self.diagnose.visible:
                told.append(f"less than {100.0 * noise_share:.2g} % of peak would not be seen beneath the noise")
        if of_stand:
            told.append(f"of the stand: {', '.join(of_stand)}")
        if open_ := _may_be_as_before(listed):
            told.append(
                f"the interval of {' and '.join(open_)} holds what was before: by how much these tests do not tell"
            )
        told += self._rivals_told(rivals, named=verdict != "unexplained")
        told += self._left_told(verdict, listed, difference)
        temperatures = self._temperatures()
        if None not in temperatures and abs(temperatures[1] - temperatures[0]) > 0.5:  # type: ignore[operator]  # not None
            warm = f"the damper was at {temperatures[1]:.3g} degC instead of {temperatures[0]:.3g}"
            told.append(warm + self._by_temperature(temperatures[1] - temperatures[0]))  # type: ignore[operator]  # not None
        if len({row.temperature_degC for row in self.first.damper.base}) > 1 and temperatures[0] is not None:
            told.append(f"T0, C and k are those at {temperatures[0]:.3g} degC, the mean of the tests")
        return [*told, *self._tests_told()]

    def _by_temperature(self, warmer: float) -> str:
        """Say by how much T0 and C follow the temperature, where that is among the changes."""
        fall = {
            c.parameter.removeprefix("beta_"): float(x)
            for c, x in zip(self.best.coordinates, self.best.values, strict=True)
            if c.name == "temperature" and c.parameter.startswith("beta_")
        }
        words = [f"{name} changes by {100.0 * np.expm1(-beta * warmer):+.2g} %" for name, beta in fall.items()]
        return f", by which {' and '.join(words)}" if words else ""

    def _rivals_told(self, rivals: dict[str, list[str]], *, named: bool) -> Iterator[str]:
        """Say what cannot be told apart; where not all is `named`, that something is left is said apart."""
        for name, others in rivals.items():
            if name == NOTHING:
                too = " too" if self.best.candidates else ""
                yield f"{' or '.join(others)} may have changed{too}{', or what is left has no name' * named}"
            else:
                yield f"{name} cannot be told from {' or '.join(others)} by these tests"

    def _left_told(self, verdict: Verdict, listed: Sequence[Change], difference: Difference) -> Iterator[str]:
        """Say what of the difference has no name, and what the damper of the first state misses of its own tests."""
        if verdict == "unexplained":
            where, left = self._most_left(self.best)
            most = f", most of it {where}, {100.0 * left:.2g} % of peak" if left > self.diagnose.visible else ""
            yield f"what is left has no name{most}"
        elif verdict == "changed" and not self.search.leaves_nothing(self.best):
            yield f"{self._left_share(difference):.0%} of the difference (r.m.s. beyond noise) has no name"
        missed = _error_share(self.first.damper, self.before.prepared) or 0.0
        if listed and missed > LARGE_MODEL_ERROR:
            yield (
                f"the damper of {self.before.name} misses {100.0 * missed:.2g} % of the force in its own tests: the "
                "values are those of that model, and the intervals those of what changed in it"
            )

    def _kind_of_friction(self, name: str) -> str | None:
        """Say of a law that is newly there which friction it is, where its values tell; None of all others."""
        values = [(c, float(x)) for c, x in zip(self.best.coordinates, self.best.values, strict=True) if c.name == name]
        if not all(c.absent for c, _ in values):
            return None
        if name == "second_branch":
            return "second_branch is friction behind a spring of its own, as a seal's, beside T0 and k"
        fastest = max(float(np.max(np.abs(c.motion.velocity))) for c in self.comparisons)
        speed = next((c.start * float(np.exp(x)) for c, x in values if c.parameter == "v_s"), 0.0)
        if name == "stribeck_friction" and speed > fastest:
            return "stribeck_friction that falls off at no tested speed is dry friction beside the oil spring"
        return None

    def _by_law_told(self, of_damper: Sequence[str]) -> list[str]:
        """Say by how much the force of the knee law changes, slow and fast, at the first control signal."""
        if knee.EFFECT.name not in self.first.damper.effects or not {*ELEMENT_COLUMNS, knee.EFFECT.name} & {*of_damper}:
            return []
        fastest = max(float(np.max(np.abs(c.motion.velocity))) for c in self.comparisons)
        reached = [speed for speed in TRADE_SPEEDS if speed <= fastest] or [fastest]
        changed = self.first.changed(self.best.coordinates, self.best.values.tolist(), None)
        at = self._voltages()[0], self._temperatures()[0]
        told = []
        for speed in dict.fromkeys((reached[0], reached[-1])):
            either = np.array([speed, -speed])
            grown = steady_force(changed, *at, either) / steady_force(self.first.damper, *at, either) - 1.0
            rebound, compression = (f"{100.0 * share:+.1f} %" for share in grown.tolist())
            told.append(f"{rebound} in rebound and {compression} in compression at {speed:.3g} m/s")
        where = f" at {at[0]:.4g} {self.control.unit}" if len(self._voltages()) > 1 else ""
        return [f"by the law, without the gas, the force{where} changes by {', by '.join(told)}"]

    def _gas_before(self, of_damper: Sequence[str]) -> list[str]:
        """Say which gas of the first state a newly told constant force or stiffness adds to."""
        own = self.first.damper.effects
        new = [name for name in GAS_FORCES if name in of_damper and name not in own]
        if not new or "accumulator" not in own or "accumulator" in of_damper:
            return []
        force = float(np.mean(own["accumulator"]["F_g"]))
        adds = "adds" if len(new) == 1 else "add"
        return [f"{' and '.join(new)} {adds} to the gas of {self.before.name}, an accumulator with F_g = {force:.3g} N"]

    def _tests_told(self) -> list[str]:
        """Say how the tests were compared, and which are left out or go where no test of the first state came."""
        pairs = sum(c.before is not None for c in self.comparisons)
        told = [f"{counted(pairs, 'test')} compared cycle by cycle, {len(self.comparisons) - pairs} through the model"]
        told += self._misread()
        if farther := self._stroke_beyond():
            told.append(farther)
        for state in (self.before, self.after):
            aside = _not_averaged(state)
            moving = [test.record.name for test in aside if not test.constant]
            unlike = [test.record.name for test in aside if test.constant]
            for names, why in ((moving, "the control signal moves"), (unlike, "no cycle repeats")):
                if names:
                    told.append(f"{counted(len(names), 'test')} of {state.name} left out: {why} in {_first(names)}")
        compared = {c.after for c in self.comparisons}
        if out := sum(test.record.name not in compared for test in averaged(self.after.prepared)):
            told.append(
                f"{counted(out, 'test')} of {self.after.name} left out: {self.before.name} was not tested at such a "
                "control signal or temperature"
            )
        return told

    def _misread(self) -> list[str]:
        """Say where both states are the same recordings, or the second is the first with its two directions exchanged.

        Equation: F_h -> - (-1)^h F_h, what both signs turned make of a motion that is the same to either side
        """
        pairs = [c for c in self.comparisons if c.before is not None]
        apart = sum(float(c.difference @ c.difference) for c in pairs)
        if pairs and apart <= SAME_RECORDING**2 * sum(c.peak**2 for c in pairs):
            return [
                f"the tests of {self.after.name} are those of {self.before.name} once more: nothing else was measured"
            ]
        exchanged = 0.0
        for c in pairs:
            sides = np.where(np.arange(c.measured.size) % 2, 1.0, -1.0)
            left = stacked(sides * c.measured - c.reference)
            exchanged += float(left @ left)
        if not pairs or exchanged > EXCHANGED_LEAVES**2 * apart:
            return []
        size, rest = (_digits(float(np.sqrt(each / len(pairs)))) for each in (apart, exchanged))
        told = (
            f"with rebound and compression of {self.after.name} exchanged {rest} N of the {size} N are left: are the "
        )
        told += "signs of its files those of the others (`sign` in rig.files), or was the valve turned round?"
        return [told]

    def cycles(self) -> tuple[ComparedCycle, ...]:
        """Return the compared cycles over their phase, with the difference that the changes make."""
        found = []
        for c, made in zip(self.comparisons, self.best.differences, strict=True):
            points = c.motion.time.size - c.begin
            found.append(
                ComparedCycle(
                    c.before,
                    c.after,
                    c.voltage,
                    c.motion.displacement[c.begin :],
                    c.motion.velocity[c.begin :],
                    course(c.reference, points),
                    course(c.measured, points),
                    course(unstacked(made), points),
                )
            )
        return tuple(found)


def _holds_what_was(change: Change) -> bool:
    """Whether the interval of a changed quantity holds its value in the first state, at every control signal.

    What no test shows may be anything.
    """
    if change.to is None:
        return True
    nodes = range(len(change.at_voltage_V or (None,)))
    return all(holds_what_was(change, i) is True for i in nodes)  # of what no test shows none is held


def _is_determined(change: Change) -> bool:
    """Whether the interval of a quantity is no wider than `SHOWN` of itself, at every control signal."""
    ends = [np.asarray(each, dtype=float) for each in (change.low95, change.high95, change.from_) if each is not None]
    if len(ends) < 3:
        return False
    low, high, before = ends
    return bool(np.all(high - low <= SHOWN * np.maximum(np.abs(before), np.abs(high))))


def _is_little(changes: Sequence[Change], name: str) -> bool:
    """Whether a change makes next to nothing of the difference."""
    return all(change.share < LITTLE for change in changes if change.name == name)


def _may_be_as_before(changes: Sequence[Change], of: Sequence[Of] = ("damper",)) -> list[str]:
    """Return the names of changes of the damper, or of the stand too, whose intervals all hold what was before."""
    asked = [change for change in changes if change.of in of]
    differ = {change.name for change in asked if not _holds_what_was(change)}
    return list(dict.fromkeys(change.name for change in asked if change.name not in differ))


def _as_before(change: Change) -> Unchanged:
    """Return a quantity that is as it was."""
    return Unchanged(
        name=change.name, parameter=change.parameter, unit=change.unit, from_=change.from_, to=change.to,
        low95=change.low95, high95=change.high95, at_voltage_V=change.at_voltage_V,
    )  # fmt: skip


def _digits(value: float, count: int = 3) -> str:
    """Return a number to so many digits, without a power of ten."""
    return f"{float(f'{value:.{count}g}'):g}"


def _added(fitted: Fitted, best: Fitted) -> list[str]:
    mine = {c.name for c in best.candidates}
    return [c.name for c in fitted.candidates if c.name not in mine]
