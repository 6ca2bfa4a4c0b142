"""Hypotheses on an unexplained gap: shapes that the residual has, and the effect file of the best one.

A hypothesis is reported and never adopted: that a shape fits does not say that the physics is this one.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from pzd.artefacts import Hypotheses, HypothesisPoint, HypothesisRow
from pzd.damper.model import Damper
from pzd.diagnosis.cross_validation import CrossValidation
from pzd.diagnosis.hypotheses.regression import PredictingShapes, RecordResidual, Residuals, residuals_of
from pzd.diagnosis.hypotheses.shapes import IN_ONE_UNIT, SHAPES, Shape
from pzd.fit.intervals import LEVEL
from pzd.quantities import Control
from pzd.record import Array
from pzd.schema.errors import ConfigError

MOST_ALONE = 5
"""Most shapes reported by themselves, the best of those that predict: what comes behind them is what resembles them."""
CLASSES = 25
"""Classes of the partial residual plot for each voltage, of equal numbers of samples."""
MOST_VOLTAGES = 5
"""Most voltages shown separately in the plot."""


def hypotheses(
    validation: CrossValidation, damper: Damper, control: Control, verdict: str = "unexplained"
) -> Hypotheses:
    """Find the shapes of the residual that predict held-out tests beyond two standard errors.

    Under another verdict than `unexplained` none is looked for.

    Parameters
    ----------
    validation : cross-validation of the tests
    damper : adopted damper, about the middle of the stroke
    control : the control signal, for units
    verdict : of the diagnosis
    """
    if verdict != "unexplained":
        return Hypotheses()
    residuals = residuals_of(validation, damper)
    regression = residuals.regression
    alone = regression.alone()[:MOST_ALONE]
    if not alone:
        return Hypotheses(sought=True)
    together = regression.together(alone[0])
    rows = [_row(found, place, residuals, control) for place, found in enumerate(alone, 1)]
    rows += [_row(found, place, residuals, control) for place, found in enumerate(together, 2)]
    return Hypotheses(tuple(rows), tuple(_points(residuals, alone[0], control)), sought=True)


def _row(found: PredictingShapes, place: int, residuals: Residuals, control: Control) -> HypothesisRow:
    """Return the row of the last shape of a set, fitted beside the others."""
    regression, half_stroke = residuals.regression, residuals.tests[0].signals.half_stroke
    fitted = regression.fitted(found.candidates)
    shape, choice = found.candidates[-1].shape, fitted.choices[-1]
    others = [c.shape.name for c in found.candidates[:-1]]
    values, errors = (each[list(choice.columns)] for each in (fitted.solution, fitted.errors))
    before = regression.held_out_error(()).criterion
    return HypothesisRow(
        place=place,
        shape=shape.name,
        beside=" + ".join(others) or None,
        coefficient=float(values[0]),
        coefficient_low95=float(values[0] - LEVEL * errors[0]),
        coefficient_high95=float(values[0] + LEVEL * errors[0]),
        unit=f"{shape.unit.removesuffix('/V')}/{control.unit}" if shape.per_control else shape.unit,
        second_coefficient=float(values[1]) if values.size > 1 else None,
        parameter=shape.parameter,
        parameter_value=choice.value,
        parameter_unit=shape.parameter_unit if shape.parameter else None,
        width_m=shape.width * half_stroke if shape.width is not None else None,
        closes=found.closes,
        standard_errors=min(found.standard_errors, 1e6),
        W_s_before=before or 0.0,
        W_s_after=found.error.criterion or 0.0,
        physics=shape.physics_of(float(values[0])),
        library=" or ".join(shape.library_of(float(values[0]))) or None,
        source=shape.source,
    )


def _points(residuals: Residuals, best: PredictingShapes, control: Control) -> Iterator[HypothesisPoint]:
    """Yield the partial residuals over the argument of the best shape, averaged in classes: component plus residual.

    Source: Larsen and McCleary 1972, Technometrics 14(3), partial residual plots
    """
    fitted = residuals.regression.fitted(best.candidates)
    shape, choice = best.candidates[0].shape, fitted.choices[0]
    wave = len(choice.columns) > 1
    of_shape = IN_ONE_UNIT[shape.unit.removesuffix("/V")]
    unit = "m" if wave else f"{of_shape} {control.unit}" if shape.per_control else of_shape
    groups = residuals.by_voltage()
    if len(groups) > MOST_VOLTAGES:
        groups = {None: list(residuals.tests)}
    for voltage, tests in groups.items():
        columns = [_partial_residual(residuals, test, shape, choice.value, fitted.solution) for test in tests]
        argument, left, component = (np.concatenate(each) for each in zip(*columns, strict=True))
        for some in np.array_split(np.argsort(argument, kind="stable"), min(CLASSES, argument.size)):
            yield HypothesisPoint(
                shape=shape.name,
                argument="x" if wave else shape.name,
                unit=unit,
                voltage_V=voltage,
                value=float(argument[some].mean()),
                left_N=float(left[some].mean()),
                scatter_N=float(left[some].std()),
                samples=some.size,
                fitted_N=float(component[some].mean()),
            )


def _partial_residual(
    residuals: Residuals, test: RecordResidual, shape: Shape, value: float | None, solution: Array
) -> tuple[Array, Array, Array]:
    """Return (c,) argument, partial residual and component of a shape at the samples of the regression."""
    columns = next(found for tried, found in shape.columns(test.signals) if tried == value)
    q = len(residuals.keys)
    candidate = next(c for c in residuals.regression.candidates if c.shape.name == shape.name)
    choice = next(choice for choice in candidate.choices if choice.value == value)
    component = columns @ solution[list(choice.columns)]
    beside = test.check.residual - residuals.tangents(test) @ solution[1 : 1 + q]
    left = beside - test.nuisance_part(beside - component, test.counts)
    argument = test.signals.x if columns.shape[1] > 1 else columns[:, 0]
    return argument[test.counts], left[test.counts], component[test.counts]


# --- Effect file of a hypothesis: a parallel force that the next diagnosis can be forced to adopt


OF_THE_CONTROL = "U "
"""Prefix of the names of shapes in proportion to the control signal."""
AT = {"x": 0.01, "v": 0.1, "a": 1.0}
"""Arguments of the reference number in the file [m, m/s, m/s2]."""


@dataclass(frozen=True)
class Proposal:
    """An effect file, and why the hypotheses before it have none."""

    name: str
    text: str
    row: HypothesisRow
    passed_over: tuple[str, ...]


def proposal_of(rows: Sequence[HypothesisRow], run: str, largest_control: float) -> Proposal:
    """Write the effect file of the best hypothesis that can have one.

    Parameters
    ----------
    rows : hypotheses by themselves, the best first
    run : run that the file names as its origin
    largest_control : largest magnitude of the control signal [its unit]

    Raises
    ------
    ConfigError : when none can be written, with the reason for each
    """
    passed_over: list[str] = []
    for row in rows:
        base_name = row.shape.removeprefix(OF_THE_CONTROL)
        by_control = base_name != row.shape
        shape = next((shape for shape in SHAPES if shape.name == base_name), None)
        if row.library and not by_control:
            passed_over.append(f"{row.shape}: is {row.library} of the library, which diagnose.force takes")
        elif shape is None or shape.law is None:
            why = "is no function of x, v and a, as the force beside the element in an effect file is"
            passed_over.append(f"{row.shape}: {why}")
        else:
            name = _identifier(base_name)
            text = _effect_file(row, shape, name, run, largest_control if by_control else None)
            return Proposal(name, text, row, tuple(passed_over))
    listed = "; ".join(passed_over) or "diagnose told none"
    raise ConfigError(f"{run}: there is no hypothesis that an effect file can hold ({listed})")


def _identifier(shape: str) -> str:
    """Turn a shape into an identifier: |x| v becomes abs_x_v."""
    words = shape.partition("/")[0]
    for symbol, word in (("2 pi ", ""), ("|x|", "abs_x"), ("|v|", "abs_v"), ("|a|", "abs_a"), ("^", "")):
        words = words.replace(symbol, word)
    name = "_".join(words.split())
    return name if name.isidentifier() else f"hypothesis_{name}"


def _effect_file(row: HypothesisRow, shape: Shape, name: str, run: str, largest_control: float | None) -> str:
    """Return the text of an effect file; coefficients that scale with the control signal are at its largest."""
    import ast

    scale, more = (1.0, "") if largest_control is None else (largest_control, ", with_friction=True")
    values = [scale * value for value in (row.coefficient, row.second_coefficient) if value is not None]
    # Not C, which the element has; and no two effects of a place share columns.
    symbols = ("c",) if len(values) == 1 else ("c_sin", "c_cos")
    printed = f"{symbols[0]} {shape.name}"
    if len(values) > 1:
        printed = f"c_sin sin(2 pi x/lambda) + c_cos cos(2 pi x/lambda), lambda = {row.parameter_value:.4g} m"
    laws = (shape.law or "").format(parameter=row.parameter_value, width=row.width_m).split(";")
    body = " + ".join(f"{symbol} * {law}" for symbol, law in zip(symbols, laws, strict=True))
    letters = {node.id for node in ast.walk(ast.parse(body)) if isinstance(node, ast.Name)}
    taken = [letter for letter in AT if letter in letters]
    arguments = ", ".join(f"{letter}: float" for letter in (*taken, *symbols))
    given = {letter: AT[letter] for letter in taken} | dict(zip(symbols, values, strict=True))
    expected = float(eval(body, {"math": math, **given}))  # noqa: S307  # a law of `SHAPES`, with numbers
    imports = "import math\n\n" if "math" in letters else ""
    parameters = "\n".join(
        f'        Parameter("{symbol}", "{shape.unit}", 0.0, -1.0e12, 1.0e12, "coefficient", '
        f"Search(lambda s: {abs(value)!r}, ({math.copysign(1.0, value)!r},)){more}),"
        for symbol, value in zip(symbols, values, strict=True)
    )
    return f'''"""A hypothesis on what the diagnosis of {run} left: {row.physics}.

Law: {printed}. On tests kept back it would close {row.closes:.0%} of what is left there.
It is no name: that the shape fits does not say that the physics is this one.
"""

from __future__ import annotations

{imports}from pzd.damper.effect import Effect, Parameter, Search

EFFECT = Effect(
    name="{name}",
    place="parallel",
    law="{printed}",
    parameters=(
{parameters}
    ),
    source="hypothesis of pzd diagnose; {row.source}",
    tests=(({given!r}, {expected!r}),),
    never_named="a hypothesis that no benchmark has tried",
)


def law({arguments}) -> float:
    """Force [N] beside the element; x [m], v [m/s] and a [m/s2] of the rod."""
    return {body}
'''
