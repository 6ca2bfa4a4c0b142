"""The hypotheses of a diagnosis: which shapes what is left has, as rows, and the picture of the best."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from pzd.artefacts import Hypotheses, HypothesisPoint, HypothesisRow
from pzd.damper.model import Damper
from pzd.diagnose.fit.intervals import LEVEL
from pzd.diagnose.hypotheses.regression import PredictingShapes
from pzd.diagnose.hypotheses.residuals import ResidualOfTest, Residuals, groups_of, residuals_of
from pzd.diagnose.hypotheses.shapes import IN_ONE_UNIT, Shape
from pzd.diagnose.kept_back import Trials
from pzd.quantities import Control
from pzd.record import Array

MOST_ALONE = 5
"""Shapes told by themselves, the best of those that predict: what comes behind them is what resembles them."""
CLASSES = 25
"""Points of the picture for each voltage: a class holds as many samples as the next."""
MOST_VOLTAGES = 5
"""Voltages told apart in the picture."""


def hypotheses(trials: Trials, damper: Damper, control: Control, verdict: str = "unexplained") -> Hypotheses:
    """The shapes of what a damper leaves that predict tests kept back, beyond two standard errors.

    None is looked for under another verdict than `unexplained`.

    Parameters
    ----------
    trials : the tests, dealt into folds
    damper : that is handed on, about the middle of the stroke
    control : the control signal, for units
    verdict : of the diagnosis
    """
    if verdict != "unexplained":
        return Hypotheses()
    residuals = residuals_of(trials, damper)
    regression = residuals.regression
    alone = regression.alone()[:MOST_ALONE]
    if not alone:
        return Hypotheses(sought=True)
    together = regression.together(alone[0])
    rows = [_row(found, place, residuals, control) for place, found in enumerate(alone, 1)]
    rows += [_row(found, place, residuals, control) for place, found in enumerate(together, 2)]
    return Hypotheses(tuple(rows), tuple(_points(residuals, alone[0], control)), sought=True)


def _row(found: PredictingShapes, place: int, residuals: Residuals, control: Control) -> HypothesisRow:
    regression, reach = residuals.regression, residuals.tests[0].signals.half_stroke
    fitted = regression.fitted(found.candidates)
    shape, choice = found.candidates[-1].shape, fitted.choices[-1]
    others = [c.shape.name for c in found.candidates[:-1]]
    values, errors = (each[list(choice.columns)] for each in (fitted.solution, fitted.errors))
    before = regression.missed(()).criterion
    return HypothesisRow(
        place=place,
        shape=shape.name,
        beside=" + ".join(others) or None,
        coefficient=float(values[0]),
        coefficient_low95=float(values[0] - LEVEL * errors[0]),
        coefficient_high95=float(values[0] + LEVEL * errors[0]),
        unit=_unit(shape, control),
        second_coefficient=float(values[1]) if values.size > 1 else None,
        parameter=shape.parameter,
        parameter_value=choice.value,
        parameter_unit=shape.parameter_unit if shape.parameter else None,
        width_m=shape.width * reach if shape.width is not None else None,
        closes=found.closes,
        standard_errors=min(found.surer, 1e6),
        W_s_before=before or 0.0,
        W_s_after=found.missed.criterion or 0.0,
        physics=shape.physics,
        library=" or ".join(shape.library) or None,
        source=shape.source,
    )


def _unit(shape: Shape, control: Control) -> str:
    return f"{shape.unit.removesuffix('/V')}/{control.unit}" if shape.per_control else shape.unit


def _points(residuals: Residuals, best: PredictingShapes, control: Control) -> Iterator[HypothesisPoint]:
    """What is left over the argument of the best shape, class by class: component plus residual.

    Source: Larsen and McCleary 1972, Technometrics 14(3), partial residual plots
    """
    fitted = residuals.regression.fitted(best.candidates)
    shape, choice = best.candidates[0].shape, fitted.choices[0]
    waves = len(choice.columns) > 1
    of_shape = IN_ONE_UNIT[shape.unit.removesuffix("/V")]
    unit = "m" if waves else f"{of_shape} {control.unit}" if shape.per_control else of_shape
    groups = groups_of(residuals.tests, residuals.trials)
    if len(groups) > MOST_VOLTAGES:
        groups = {None: list(residuals.tests)}
    for voltage, tests in groups.items():
        columns = [_left_and_fitted(residuals, test, shape, choice.value, fitted.solution) for test in tests]
        argument, left, component = (np.concatenate(each) for each in zip(*columns, strict=True))
        for some in np.array_split(np.argsort(argument, kind="stable"), min(CLASSES, argument.size)):
            yield HypothesisPoint(
                shape=shape.name,
                argument="x" if waves else shape.name,
                unit=unit,
                voltage_V=voltage,
                value=float(argument[some].mean()),
                left_N=float(left[some].mean()),
                scatter_N=float(left[some].std()),
                samples=some.size,
                fitted_N=float(component[some].mean()),
            )


def _left_and_fitted(
    residuals: Residuals, test: ResidualOfTest, shape: Shape, value: float | None, solution: Array
) -> tuple[Array, Array, Array]:
    """(c,) argument of the shape, what is left, the shape's own part of it included, and that part, at what counts."""
    columns = next(found for tried, found in shape.columns(test.signals) if tried == value)
    q = len(residuals.keys)
    coefficients = solution[_places(residuals, shape, value)]
    component = columns @ coefficients
    beside = test.check.residual - residuals.tangents(test) @ solution[1 : 1 + q]
    left = beside - test.taken_up(beside - component, test.counts)
    argument = test.signals.x if columns.shape[1] > 1 else columns[:, 0]
    return argument[test.counts], left[test.counts], component[test.counts]


def _places(residuals: Residuals, shape: Shape, value: float | None) -> Sequence[int]:
    """Where the columns of a shape stand, at one value of what is searched."""
    candidate = next(c for c in residuals.regression.candidates if c.shape.name == shape.name)
    return list(next(choice for choice in candidate.choices if choice.value == value).columns)
