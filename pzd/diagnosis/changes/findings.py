"""Search for what changed between two states, and the size of what it leaves of the difference."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from pzd.artefacts.changes import Difference
from pzd.damper.effects.accumulator import POLYTROPIC
from pzd.damper.model import Damper
from pzd.damper.parameter_rows import nearest_condition, rows_per_voltage
from pzd.diagnosis.changes.candidates import FirstState, Response, candidates
from pzd.diagnosis.changes.compared_tests import comparisons_of, error_in_own_tests
from pzd.diagnosis.changes.pairs import Comparison, has_average_cycle
from pzd.diagnosis.changes.regression import Fitted, Likelihood, Regression
from pzd.diagnosis.changes.selection import Search
from pzd.diagnosis.changes.state import State
from pzd.diagnosis.cleaned_records import CleanedRecord
from pzd.diagnosis.config import DiagnoseConfig
from pzd.diagnosis.fit.prediction import comparable_samples, predicted_force
from pzd.fit.intervals import LEVEL
from pzd.identification.config import IdentifyConfig
from pzd.quantities import Control
from pzd.record import mid_stroke
from pzd.signals.measures import criterion

GAS_LENGTHS = (1.0, 100.0)
"""Shortest and longest gas column, in half strokes, whose force and stiffness change together as those of a gas do.

Reason: shorter than the stroke it could not be compressed, and one of a hundred half strokes hardens by a hundredth."""


def findings_between(
    before: State, after: State, diagnose: DiagnoseConfig, identify: IdentifyConfig, control: Control
) -> Findings:
    """Compare two states of a damper and search for what changed; the arguments are those of `changes_between`."""
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
    return swapped if is_gas(search.regression.comparisons, swapped) else best


def is_gas(comparisons: Sequence[Comparison], fitted: Fitted) -> bool:
    """Whether force and stiffness beside the element changed in the proportion of a gas column.

    Equation: dF_0 = - dk_g L / n, L the length of the gas column, n the exponent of the gas
    """
    changed = {c.parameter: x * c.scale for c, x in zip(fitted.coordinates, fitted.values, strict=True)}
    if "F_0" not in changed or "k_g" not in changed or changed["k_g"] == 0.0:
        return False
    length = -POLYTROPIC * changed["F_0"] / changed["k_g"]
    half_stroke = max(c.amplitude for c in comparisons)
    return bool(GAS_LENGTHS[0] * half_stroke <= length <= GAS_LENGTHS[1] * half_stroke)


@dataclass(frozen=True, eq=False)
class Findings:
    """The changes that were fitted between two states, and what they leave of the difference."""

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
        """Pairs of tests whose difference of force is fitted."""
        return self.search.regression.comparisons

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

    def left_share(self, difference: Difference) -> float:
        """Return what is left of a difference as a share of it, both r.m.s. beyond the noise."""
        whole = difference.rms_N**2 - difference.noise_N**2
        return beyond_noise(difference) / float(np.sqrt(whole)) if whole > 0.0 else 0.0

    def leaves_visible(self, best: Fitted) -> bool:
        """Whether a fit leaves more beyond the noise than counts as nothing.

        Taken for granted where a test is compared through the model, since what that misses counts as noise.
        """
        if any(c.before is None for c in self.comparisons):
            return True
        return beyond_noise(self.difference(best)) >= self.diagnose.visible * self.first.force

    def may_be_seen(self, best: Fitted) -> bool:
        """Whether what a fit leaves may be seen: where the model stands for every test, beyond what that may miss.

        Of a difference that is hardly visible itself the error of the model makes up any share, and it is not the same
        in every test: up to an interval of it is chance.
        """
        if any(c.before is not None for c in self.comparisons):
            return True
        beyond = [left - missed - (self.diagnose.visible * c.peak) ** 2 for c, left, missed in self.left_of_tests(best)]
        return sum(beyond) > 0.0

    def left_of_tests(self, best: Fitted) -> Iterator[tuple[Comparison, float, float]]:
        """Yield every comparison with what is left of it beyond noise and its own offset, gain and delay [N^2].

        And with what the first damper may miss of it, as far as an interval goes [N^2].
        """
        likelihood = self.search.regression.likelihood
        own = likelihood.own_of_tests(best.residuals, best.scatter)
        for i, (r, o, c) in enumerate(zip(best.residuals, own, self.comparisons, strict=True)):
            left = float((r - o) @ (r - o) - np.sum(c.variance))
            yield c, left, LEVEL**2 * float(np.sum(likelihood.missed_by_model(i)))

    def most_left(self, best: Fitted) -> tuple[str, float]:
        """Return the condition at which most is left, and how much (r.m.s., share of peak).

        Beyond noise, what the model may miss, and each test's own offset, gain and delay; nothing where there is one
        condition alone.
        """
        rows, squares = self.first.damper.base, dict[int, list[float]]()
        for c, left, missed in self.left_of_tests(best):
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

    def voltages(self) -> list[float | None]:
        """Return the control signals of the compared tests at which the first state has parameters."""
        groups = [voltage for voltage, _ in rows_per_voltage(self.first.damper.base)]
        known = sorted(
            {min(groups, key=lambda g: abs(g - c.voltage)) for c in self.comparisons if c.voltage is not None}  # type: ignore[operator]  # not None
        )
        return list(known) or [None]

    def temperatures(self) -> tuple[float | None, float | None]:
        """Return the mean temperatures of the compared tests in both states [degC]."""
        before = [c.temperature for c in self.comparisons if c.temperature is not None]
        warmer = [c.warmer for c in self.comparisons if c.warmer is not None]
        if not before or not warmer:
            return (float(np.mean(before)) if before else None), None
        return float(np.mean(before)), float(np.mean(before) + np.mean(warmer))


def beyond_noise(difference: Difference) -> float:
    """Return what is left of a difference beyond the noise, r.m.s. [N]."""
    return float(np.sqrt(max(difference.left_N**2 - difference.noise_N**2, 0.0)))


# --- Tests that have no average cycle


def not_averaged(state: State) -> list[CleanedRecord]:
    """Return the tests in which the control signal moves, or no cycle repeats."""
    return [test for test in state.cleaned if not has_average_cycle(test)]


def error_share(damper: Damper, tests: Sequence[CleanedRecord]) -> float | None:
    """Compute the error of a damper in tests as they were run, as a share of the force (r.m.s.); None without one."""
    if not tests:
        return None
    masks = [comparable_samples(test) for test in tests]
    measured = np.concatenate([test.record.force[mask] for test, mask in zip(tests, masks, strict=True)])
    made = np.concatenate([predicted_force(damper, test)[mask] for test, mask in zip(tests, masks, strict=True)])
    return float(np.sqrt(criterion(measured - made, measured))) if measured.any() else None
