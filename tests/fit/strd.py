"""The nonlinear regressions of the NIST Statistical Reference Datasets: models here, numbers in nist/NAME.dat.

Source: National Institute of Standards and Technology, StRD, nonlinear regression (public domain). A file has the two
starting points, the certified optimum to eleven digits with standard deviations, and the data.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pzd.fit.least_squares import MOST_EVALUATIONS, Optimum, minimise
from pzd.record import Array

FOLDER = Path(__file__).parent / "nist"
FIRST_PARAMETER, FIRST_DATA = 40, 60
"""Lines of every file at which its parameters and its data begin, counted from 0."""
EQUAL_DIGITS = 6.0
"""Digits that are asked for, in every parameter."""
OFFSET = 1e-7
"""Largest relative offset of an optimum of which six digits are claimed.

Reason: the largest standard deviation of a certified parameter is 2.4 times the parameter (ENSO)."""


def _exponentials(x: Array, b: Array) -> Array:
    return b[0] * np.exp(-b[1] * x) + b[2] * np.exp(-b[3] * x) + b[4] * np.exp(-b[5] * x)


def _gauss(x: Array, b: Array) -> Array:
    peaks = b[2] * np.exp(-((x - b[3]) ** 2) / b[4] ** 2) + b[5] * np.exp(-((x - b[6]) ** 2) / b[7] ** 2)
    return b[0] * np.exp(-b[1] * x) + peaks


def _cubics(x: Array, b: Array) -> Array:
    return (b[0] + b[1] * x + b[2] * x**2 + b[3] * x**3) / (1 + b[4] * x + b[5] * x**2 + b[6] * x**3)


def _seasons(x: Array, b: Array) -> Array:
    angle = 2.0 * np.pi * x
    year = b[0] + b[1] * np.cos(angle / 12) + b[2] * np.sin(angle / 12)
    first = b[4] * np.cos(angle / b[3]) + b[5] * np.sin(angle / b[3])
    return year + first + b[7] * np.cos(angle / b[6]) + b[8] * np.sin(angle / b[6])


MODELS: dict[str, Callable[[Array, Array], Array]] = {
    "Bennett5": lambda x, b: b[0] * (b[1] + x) ** (-1 / b[2]),
    "BoxBOD": lambda x, b: b[0] * (1 - np.exp(-b[1] * x)),
    "Chwirut1": lambda x, b: np.exp(-b[0] * x) / (b[1] + b[2] * x),
    "Chwirut2": lambda x, b: np.exp(-b[0] * x) / (b[1] + b[2] * x),
    "DanWood": lambda x, b: b[0] * x ** b[1],
    "ENSO": _seasons,
    "Eckerle4": lambda x, b: b[0] / b[1] * np.exp(-0.5 * ((x - b[2]) / b[1]) ** 2),
    "Gauss1": _gauss,
    "Gauss2": _gauss,
    "Gauss3": _gauss,
    "Hahn1": _cubics,
    "Kirby2": lambda x, b: (b[0] + b[1] * x + b[2] * x**2) / (1 + b[3] * x + b[4] * x**2),
    "Lanczos1": _exponentials,
    "Lanczos2": _exponentials,
    "Lanczos3": _exponentials,
    "MGH09": lambda x, b: b[0] * (x**2 + x * b[1]) / (x**2 + x * b[2] + b[3]),
    "MGH10": lambda x, b: b[0] * np.exp(b[1] / (x + b[2])),
    "MGH17": lambda x, b: b[0] + b[1] * np.exp(-x * b[3]) + b[2] * np.exp(-x * b[4]),
    "Misra1a": lambda x, b: b[0] * (1 - np.exp(-b[1] * x)),
    "Misra1b": lambda x, b: b[0] * (1 - (1 + b[1] * x / 2) ** (-2)),
    "Misra1c": lambda x, b: b[0] * (1 - (1 + 2 * b[1] * x) ** (-0.5)),
    "Misra1d": lambda x, b: b[0] * b[1] * x / (1 + b[1] * x),
    "Nelson": lambda x, b: b[0] - b[1] * x[0] * np.exp(-b[2] * x[1]),
    "Rat42": lambda x, b: b[0] / (1 + np.exp(b[1] - b[2] * x)),
    "Rat43": lambda x, b: b[0] / (1 + np.exp(b[1] - b[2] * x)) ** (1 / b[3]),
    "Roszman1": lambda x, b: b[0] - b[1] * x - np.arctan(b[2] / (x - b[3])) / np.pi,
    "Thurber": _cubics,
}
"""Model of each data set: response over predictor and parameters; they take complex parameters."""


@dataclass(frozen=True, eq=False)
class Regression:
    """A data set with its certified optimum."""

    name: str
    starts: tuple[Array, Array]
    certified: Array
    """(p,) parameters."""
    deviations: Array
    """(p,) their standard deviations."""
    sum_of_squares: float
    predictor: Array
    response: Array

    def residuals(self, b: Array) -> Array:
        """Response less model."""
        return self.response - MODELS[self.name](self.predictor, b)

    def jacobian(self, b: Array) -> Array:
        """Derivatives of the residuals, by a complex step: exact to rounding."""
        step = 1e-100
        moved = [self.residuals(b + 1j * step * unit).imag / step for unit in np.eye(b.size)]
        return np.column_stack(moved)

    def fitted(self, start: int, evaluations: int = MOST_EVALUATIONS) -> Optimum:
        """Fit from one of the two starting points."""
        with np.errstate(all="ignore"):  # a step may try what no number holds
            begin = self.starts[start]
            return minimise(self.residuals, begin, self.jacobian, evaluations=evaluations, largest_offset=OFFSET)

    def digits(self, found: Array) -> float:
        """Digits in which the worst of the parameters equals the certified one."""
        return float(-np.log10(np.max(np.abs(found / self.certified - 1.0)) + 1e-16))


def regression(name: str) -> Regression:
    """Read a data set."""
    lines = (FOLDER / f"{name}.dat").read_text(encoding="ascii").splitlines()
    rows = [line.split("=")[1].split() for line in lines[FIRST_PARAMETER:FIRST_DATA] if re.match(r"\s*b\d+ =", line)]
    first, second, certified, deviations = np.array(rows, dtype=np.float64).T
    of_squares = next(line for line in lines if line.startswith("Residual Sum of Squares"))
    data = np.array([line.split() for line in lines[FIRST_DATA:]], dtype=np.float64).T
    response, predictor = (np.log(data[0]), data[1:]) if name == "Nelson" else (data[0], data[1])
    return Regression(name, (first, second), certified, deviations, float(of_squares.split()[-1]), predictor, response)
