"""A damper of a series, or one of those that the tests leave possible: its parameters moved, at all conditions alike.

Equation: p exp(s z) for a scatter of the standard deviation s from damper to damper, p + u z for an uncertainty of the
standard error u, z of the standard normal distribution
"""

from __future__ import annotations

from collections.abc import Mapping
from math import exp

import numpy as np

from pzd.artefacts import Diagnosed
from pzd.config import Scatter
from pzd.damper.competing_forms import known
from pzd.damper.model import PHYSICAL, BaseRow, Damper
from pzd.diagnose.fit.intervals import LEVEL
from pzd.schema.errors import ConfigError, DataError

OF_BASE = {"T0": "T0_N", "C": "C_Ns_per_m", "k": "k_N_per_m"}
"""Columns of the Bingham parameters, by their symbol."""


def check_scatter(asked: Mapping[str, Scatter], diagnosed: Diagnosed) -> None:
    """Check that a damper has what is to scatter, and intervals where they are asked for.

    Parameters
    ----------
    asked : names as in `sweep.damper`
    diagnosed : the damper handed on

    Raises
    ------
    ConfigError : when it has no such parameter
    DataError : when the tests leave no interval for it
    """
    there = [
        *OF_BASE,
        *(f"{e}.{p}" for e, values in diagnosed.damper.effects.items() for p in values if p[:3] != "at_"),
    ]
    unknown = [name for name in asked if name not in there]
    if unknown:
        raise ConfigError(
            f"sweep.damper: the damper handed on by diagnose has no such parameter; there is {', '.join(there)} "
            f"(got {', '.join(unknown)})"
        )
    scattered(diagnosed, asked, dict.fromkeys(asked, 0.0))


def scattered(diagnosed: Diagnosed, asked: Mapping[str, Scatter], scores: Mapping[str, float]) -> Diagnosed:
    """The damper handed on with some of its parameters moved.

    Parameters
    ----------
    diagnosed : with the intervals of its parameters
    asked : by name, the standard deviation as a share, or `interval`
    scores : by name, how many standard deviations the parameter is moved by

    Raises
    ------
    DataError : when the tests leave no interval for a parameter that is to move in it
    """
    damper = diagnosed.damper
    for name, z in scores.items():
        effect, _, parameter = name.rpartition(".")
        damper = (
            _with_effect(damper, diagnosed, effect, parameter, asked[name], z)
            if effect
            else _with_base(damper, diagnosed, name, asked[name], z)
        )
    return Diagnosed(diagnosed.diagnosis, damper, damper, diagnosed.parameters)


def _with_base(damper: Damper, diagnosed: Diagnosed, symbol: str, how: Scatter, z: float) -> Damper:
    column = OF_BASE[symbol]
    low, high = PHYSICAL[column]
    intervals = {
        (row.voltage_V, row.temperature_degC): (getattr(row, f"{column}_low95"), getattr(row, f"{column}_high95"))
        for row in diagnosed.parameters
    }

    def moved(row: BaseRow) -> BaseRow:
        ends = intervals.get((row.voltage_V, row.temperature_degC), (None, None))
        value = _moved(getattr(row, column), how, ends, z, symbol)
        return row.model_copy(update={column: float(np.clip(value, low, high))})

    return damper.model_copy(update={"base": tuple(moved(row) for row in damper.base)})


def _with_effect(damper: Damper, diagnosed: Diagnosed, effect: str, name: str, how: Scatter, z: float) -> Damper:
    value, parameter = damper.effects[effect][name], known()[effect].parameter(name)
    told = diagnosed.diagnosis.parameters.get(effect, {}).get(name)
    values = np.atleast_1d(np.asarray(value, dtype=np.float64))
    lows, highs = (
        _listed(told.low95 if told else None, values.size),
        _listed(told.high95 if told else None, values.size),
    )
    label = f"{effect}.{name}"
    moved = [
        float(np.clip(_moved(x, how, ends, z, label), parameter.low, parameter.high))
        for x, ends in zip(values.tolist(), zip(lows, highs, strict=True), strict=True)
    ]
    given = {**damper.effects[effect], name: tuple(moved) if isinstance(value, tuple) else moved[0]}
    return damper.model_copy(update={"effects": {**damper.effects, effect: given}})


def _listed(end: float | tuple[float, ...] | None, count: int) -> list[float | None]:
    """One end of an interval for each of so many values."""
    return [*end] if isinstance(end, tuple) else [end] * count


def _moved(value: float, how: Scatter, ends: tuple[float | None, float | None], z: float, label: str) -> float:
    if isinstance(how, float):
        return value * exp(how * z)
    low, high = ends
    if low is None or high is None:
        raise DataError(f"sweep.damper.{label}: the tests leave no interval for it; give a share, as in {label}: 0.05")
    return value + z * (high - low) / (2.0 * LEVEL)
