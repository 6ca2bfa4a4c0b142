"""Which law is handed on: both predict whole tests that were kept back from their fits."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np

from pzd.artefacts import LawRow, PredictedRow
from pzd.artefacts.knee import LawName
from pzd.identify.knee.data import Tests
from pzd.identify.knee.fit import REFIT, KneeFit, descend
from pzd.identify.knee.rows import Labels
from pzd.identify.misfit import VISIBLE
from pzd.record import Array
from pzd.signals.criterion import criterion

FOLDS = 5
"""The tests of a condition are kept back in so many turns, or one by one where they are fewer."""
ERRORS = 2.0
"""Standard errors of the mean difference beyond which it is no chance; as in diagnose."""
FEWEST = 3
"""Tests from which a standard error is worth anything."""


def kept_back(labels: Labels, tests: Tests, knee: KneeFit, bingham: KneeFit) -> list[tuple[PredictedRow, Array]]:
    """Every test of a condition predicted by both laws, each fitted without it; none where the test is alone.

    Parameters
    ----------
    labels : of the condition
    tests : of the condition
    knee, bingham : the optima over all of them, where the refits begin

    Returns
    -------
    the rows, each with (4,) sums over its samples [N2]: the squared errors of Bingham and of the knee, the squares of
    the measured force, and of what is too small to see
    """
    count = len(tests.tests)
    if count < 2:
        return []
    order = np.argsort([float(np.max(np.abs(test.record.velocity))) for test in tests.tests], kind="stable")
    found = {}
    for fold in range(min(FOLDS, count)):
        out = order[fold::FOLDS].tolist()
        rest = tests.some([i for i in range(count) if i not in out])
        fits = [descend(rest, fit.form, fit.curve, fit.gas, REFIT) for fit in (bingham, knee)]
        for i in out:
            one = tests.some([i])
            left = [one.measured - fit.predicted(one) for fit in fits]
            unseen = np.full(one.measured.size, VISIBLE * one.peak)
            squares = np.array([float(r @ r) for r in (*left, one.measured, unseen)])
            found[i] = _predicted(labels, one, left), squares
    return [found[i] for i in range(count)]


def _predicted(labels: Labels, one: Tests, left: Sequence[Array]) -> PredictedRow:
    return PredictedRow(
        record=one.tests[0].record.name,
        setting=labels[0],
        voltage_V=labels[1],
        temperature_degC=labels[2],
        W_s_bingham=criterion(left[0], one.measured),
        W_s_knee=criterion(left[1], one.measured),
    )


def law_row(
    asked: Literal["bingham", "knee", "auto"],
    setting: str | None,
    found: Sequence[tuple[PredictedRow, Array]],
    conditions: int,
) -> LawRow:
    """The law of one setting, and why.

    Equation: knee where mean d > 2 s_d / sqrt(n), d_i = W_s,i of Bingham less that of the knee, and where all tests
    together are missed visibly less                                            Source: paired differences

    Parameters
    ----------
    asked : what the config asks for
    setting : of the rig
    found : its tests, kept back in turn, with the squares of `kept_back`
    conditions : how many of the setting the knee law was fitted to
    """
    count = len(found)
    if not conditions:
        return _law(setting, "bingham", count, None, "the knee law needs tests at a constant control signal")
    squares = np.sum([each for _, each in found], axis=0) if found else None
    pooled = None if squares is None else (float(squares[0] / squares[2]), float(squares[1] / squares[2]))
    told = f"{count} tests kept back are predicted with W_s {pooled[1]:.3g} by the knee law" if pooled else ""
    told += f", {pooled[0]:.3g} by Bingham's" if pooled else ""
    if asked == "knee":
        return _law(setting, "knee", count, pooled, f"as the config asks for; {told or 'no test could be kept back'}")
    if count < FEWEST:
        why = (
            f"{count} tests could be kept back, and {FEWEST} are needed to choose a law; record several in a condition"
        )
        return _law(setting, "bingham", count, pooled, why)
    apart = np.array([row.W_s_bingham - row.W_s_knee for row, _ in found])
    mean, error = float(apart.mean()), float(np.std(apart, ddof=1) / np.sqrt(count))
    visible = squares is not None and float(squares[0] - squares[1]) > float(squares[3])
    measure = f"mean difference {mean:.2g}, its standard error {error:.2g}"
    measure += "" if visible or mean <= 0.0 else f", less than {VISIBLE:.2%} of peak"
    law: LawName = "knee" if mean > ERRORS * error and visible else "bingham"
    return _law(setting, law, count, pooled, f"{told}; {measure}")


def _law(setting: str | None, law: LawName, tests: int, pooled: tuple[float, float] | None, reason: str) -> LawRow:
    bingham, knee = pooled or (None, None)
    return LawRow(setting=setting, law=law, tests=tests, W_s_bingham=bingham, W_s_knee=knee, reason=reason)
