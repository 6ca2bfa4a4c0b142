"""The runs of a sweep: what each differs in, and one of them done in memory, from the config to rows of results.

Order: every combination of the values under `over`, and in each the same quasi-random draws. A run takes the stages
that its values leave alone from the base run, and executes the others.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from math import exp
from pathlib import Path

import numpy as np

from pzd.artefacts import Artefact, Diagnosed, Identified, Rides
from pzd.artefacts.csv_rows import Estimate
from pzd.config import Normal, RunConfig, Scatter, SweepConfig, validated
from pzd.damper.confounders import known
from pzd.damper.model import PHYSICAL, BaseRow, Damper
from pzd.fit.intervals import LEVEL
from pzd.parallel.chunks import TRIES
from pzd.pipeline.command import Opened, opened
from pzd.pipeline.execution import InMemory, unaffected
from pzd.pipeline.stages import Stage, stages
from pzd.quantities import BINGHAM
from pzd.record import Array
from pzd.schema.errors import ConfigError, DataError, UserError
from pzd.schema.model import Frozen
from pzd.schema.yamltree import Scalar, written
from pzd.simulate.study.plan import PLAIN_SUFFIX

# --- Which runs there are ---

LEAST_PROBABILITY = 1e-9
"""Least probability of a draw: a quasi-random number may be 0, where a normal distribution has no value."""


@dataclass(frozen=True)
class Task:
    """One run of a sweep."""

    number: int
    """Place in the sweep, from 1."""
    over: tuple[tuple[str, Scalar], ...]
    """Keys of the config with their values in this combination."""
    drawn: tuple[tuple[str, float], ...]
    """Keys of the config with the values drawn."""
    damper: tuple[tuple[str, float], ...]
    """Parameters of the damper, each with how many standard deviations it lies from its value."""

    @property
    def overrides(self) -> tuple[str, ...]:
        """Values that this run sets in the config, as `--set` takes them."""
        return tuple(f"{key}={written(value)}" for key, value in (*self.over, *self.drawn))

    @property
    def described(self) -> str:
        """Difference from the base run in words."""
        scattered = (f"{name} {z:+.3g} sd" for name, z in self.damper)
        return ", ".join((*self.overrides, *scattered))


def quantities(sweep: SweepConfig) -> tuple[str, ...]:
    """Return the names of what is drawn, in the order of the columns."""
    return (*sweep.drawn, *(f"damper.{name}" for name in sweep.damper))


def with_indices(sweep: SweepConfig) -> bool:
    """Tell whether there are two quantities or more, so that Sobol indices can say which decides."""
    return len(quantities(sweep)) > 1


def tasks(sweep: SweepConfig, seed: int) -> tuple[Task, ...]:
    """Return every run of a sweep: combination by combination, and draw by draw.

    Parameters
    ----------
    sweep : the config's block
    seed : of the draws
    """
    shares = design(sweep, seed)
    combinations = itertools.product(*([(key, value) for value in values] for key, values in sweep.over.items()))
    pairs = itertools.product(combinations, shares)
    return tuple(_task(sweep, number, over, row) for number, (over, row) in enumerate(pairs, start=1))


def design(sweep: SweepConfig, seed: int) -> Array:
    """Compute the probabilities at which the drawn quantities are taken in one combination.

    Equation: rows A, then B, then for every quantity A with its column taken from B         Source: Saltelli 2010

    Returns
    -------
    (runs, d) of the d quantities; (1, 0) without any

    >>> unit = {"uniform": (0.0, 1.0)}
    >>> design(SweepConfig(drawn={"a": unit, "b": unit}, draws=4), seed=1).shape
    (16, 2)
    """
    from scipy.stats.qmc import Sobol

    count = len(quantities(sweep))
    if not count:
        return np.empty((1, 0))
    generator = np.random.default_rng(seed)
    if not with_indices(sweep):
        return _inside(Sobol(count, rng=generator).random(sweep.draws))
    both = _inside(Sobol(2 * count, rng=generator).random(sweep.draws))
    a, b = both[:, :count], both[:, count:]
    mixed = [np.where(np.arange(count) == i, b, a) for i in range(count)]
    return np.concatenate([a, b, *mixed])


def _inside(shares: Array) -> Array:
    return np.clip(shares, LEAST_PROBABILITY, 1.0 - LEAST_PROBABILITY)


def _task(sweep: SweepConfig, number: int, over: tuple[tuple[str, Scalar], ...], shares: Array) -> Task:
    from scipy.special import ndtri

    drawn, split = [], len(sweep.drawn)
    for (key, how), share in zip(sweep.drawn.items(), shares[:split].tolist(), strict=True):
        if isinstance(how, Normal):
            mean, deviation = how.normal
            drawn.append((key, float(mean + deviation * ndtri(share))))
        else:
            low, high = how.uniform
            drawn.append((key, low + (high - low) * share))
    scores = [float(ndtri(share)) for share in shares[split:].tolist()]
    return Task(number, over, tuple(drawn), tuple(zip(sweep.damper, scores, strict=True)))


# --- Scatter of the damper: its parameters moved, at all conditions alike ---

BASE_COLUMNS = {quantity.symbol: quantity.column for quantity in BINGHAM}
"""Columns of the Bingham parameters, by their symbol."""


def check_scatter(asked: Mapping[str, Scatter], diagnosed: Diagnosed) -> None:
    """Check that a damper has what is to scatter, and intervals where they are asked for.

    Parameters
    ----------
    asked : names as in `sweep.damper`
    diagnosed : the adopted damper

    Raises
    ------
    ConfigError : when it has no such parameter
    DataError : when the tests leave no interval for it
    """
    effects = diagnosed.damper.effects.items()
    there = [*BASE_COLUMNS, *(f"{e}.{p}" for e, values in effects for p in values if not p.startswith("at_"))]
    unknown = [name for name in asked if name not in there]
    if unknown:
        raise ConfigError(
            f"sweep.damper: the damper that diagnose adopted has no such parameter; there is {', '.join(there)} "
            f"(got {', '.join(unknown)})"
        )
    scattered(diagnosed, asked, dict.fromkeys(asked, 0.0))


def scattered(diagnosed: Diagnosed, asked: Mapping[str, Scatter], scores: Mapping[str, float]) -> Diagnosed:
    """Move parameters of the adopted damper, as from damper to damper of a series or within their intervals.

    Equation: p exp(s z) for a scatter of standard deviation s, p + u z for an uncertainty of standard error u, z of
    the standard normal distribution

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
    column = BASE_COLUMNS[symbol]
    low, high = PHYSICAL[column]
    intervals = {(row.voltage_V, row.temperature_degC): Estimate.of(row, column)[1:] for row in diagnosed.parameters}

    def moved(row: BaseRow) -> BaseRow:
        ends = intervals.get((row.voltage_V, row.temperature_degC), (None, None))
        value = _moved(getattr(row, column), how, ends, z, symbol)
        return row.model_copy(update={column: float(np.clip(value, low, high))})

    return damper.model_copy(update={"base": tuple(moved(row) for row in damper.base)})


def _with_effect(damper: Damper, diagnosed: Diagnosed, effect: str, name: str, how: Scatter, z: float) -> Damper:
    value, parameter = damper.effects[effect][name], known()[effect].parameter(name)
    fitted = diagnosed.diagnosis.parameters.get(effect, {}).get(name)
    values = np.atleast_1d(np.asarray(value, dtype=np.float64))
    intervals = [estimate[1:] for estimate in fitted.estimates] if fitted else [(None, None)] * values.size
    label = f"{effect}.{name}"
    moved = [
        float(np.clip(_moved(x, how, ends, z, label), parameter.low, parameter.high))
        for x, ends in zip(values.tolist(), intervals, strict=True)
    ]
    given = {**damper.effects[effect], name: tuple(moved) if isinstance(value, tuple) else moved[0]}
    return damper.model_copy(update={"effects": {**damper.effects, effect: given}})


def _moved(value: float, how: Scatter, ends: tuple[float | None, float | None], z: float, label: str) -> float:
    if isinstance(how, float):
        return value * exp(how * z)
    low, high = ends
    if low is None or high is None:
        raise DataError(f"sweep.damper.{label}: the tests leave no interval for it; give a share, as in {label}: 0.05")
    return value + z * (high - low) / (2.0 * LEVEL)


# --- One run ---


class RunResult(Frozen):
    """Result of one run."""

    task: int
    rows: tuple[dict[str, Scalar], ...] = ()
    """Its rows of the table of results."""
    failure: str | None = None
    """Why there are none."""


@dataclass(frozen=True)
class BaseRun:
    """The config that all runs of a sweep begin with, and where its results stand."""

    config: Path
    runs: Path
    overrides: tuple[str, ...]

    @property
    def absolute(self) -> BaseRun:
        """With absolute paths, for a process that works in another folder."""
        return replace(self, config=self.config.absolute(), runs=self.runs.absolute())

    @property
    def opened(self) -> Opened:
        """The config, read once in each process."""
        return _opened(self)


@cache
def _opened(base: BaseRun) -> Opened:
    return opened(base.config, base.runs, base.overrides)


@cache
def _read(base: BaseRun, folder: str) -> Artefact:
    """Read the artefact in a folder of the base run, once in each process."""
    (kind,) = (stage.makes for stage in stages(base.opened.config) if stage.folder == folder)
    return base.opened.run.read(kind)


def config_of(given: Opened, task: Task) -> RunConfig:
    """Return the config of one run.

    Raises
    ------
    ConfigError : when a value is wrong
    """
    return validated(given.document.overridden(task.overrides))


def shared_stages(given: Opened, some: Sequence[Task]) -> tuple[Stage, ...]:
    """Return the stages whose results are those of the base run in all of some runs."""
    shared = stages(given.config)
    for task in some:
        shared = shared[: len(unaffected(given.config, config_of(given, task)))]
    return shared


def outcomes(base: BaseRun, chunk: Sequence[Task]) -> tuple[RunResult, ...]:
    """Do some runs, one after another; one that fails is reported, and the others go on."""
    return tuple(_outcome(base, task) for task in chunk)


def _outcome(base: BaseRun, task: Task) -> RunResult:
    failure = ""
    for _ in range(TRIES):
        try:
            return RunResult(task=task.number, rows=tuple(_rows(base, task)))
        except UserError as error:
            return RunResult(task=task.number, failure="; ".join(error.messages))
        except Exception as error:  # noqa: BLE001  # whatever it is, it is reported, and the other runs go on
            failure = f"{type(error).__name__}: {error}"
    return RunResult(task=task.number, failure=failure)


def _rows(base: BaseRun, task: Task) -> Iterator[dict[str, Scalar]]:
    given = base.opened
    config = config_of(given, task)
    sweep = config.sweep
    if sweep is None:
        raise ValueError("a task of a config without a sweep")
    shared = unaffected(given.config, config)
    if task.damper:  # another damper: what lies behind diagnose is made anew
        shared = tuple(stage for stage in shared if stage.name not in ("table", "simulate", "report"))
    read = {stage.folder: _read(base, stage.folder) for stage in shared}
    chain = InMemory(config, given.run, stages(config), lambda _: None, artefacts=read, described=False)
    if sweep.until == "simulate":
        chain.through("diagnose")
        chain.artefacts[Diagnosed.folder] = scattered(chain.of(Diagnosed), sweep.damper, dict(task.damper))
    chain.through(sweep.until)
    yield from ROWS[sweep.until](chain)


def _of_identify(chain: InMemory) -> Iterator[dict[str, Scalar]]:
    yield from (row.model_dump() for row in chain.of(Identified).rows)


def _of_diagnose(chain: InMemory) -> Iterator[dict[str, Scalar]]:
    found = chain.of(Diagnosed).diagnosis
    gap, prediction = found.gap, found.prediction
    yield {
        "verdict": found.verdict,
        "effects": " ".join(found.effects),
        "confidence": found.confidence,
        "gap_before": gap.before if gap else None,
        "gap_after": gap.after if gap else None,
        "W_s_plain": prediction.W_s_plain if prediction else None,
        "W_s": prediction.W_s if prediction else None,
    }


def _of_simulate(chain: InMemory) -> Iterator[dict[str, Scalar]]:
    rides = chain.of(Rides)
    weighted = {(row.case, row.point): row.a_w_m_per_s2 for row in rides.weighted}
    for row in rides.summary:
        if not row.case.endswith(PLAIN_SUFFIX):
            yield {**row.model_dump(), "a_w_m_per_s2": weighted.get((row.case, row.point))}


ROWS: Mapping[str, Callable[[InMemory], Iterator[dict[str, Scalar]]]] = {
    "identify": _of_identify,
    "diagnose": _of_diagnose,
    "simulate": _of_simulate,
}
"""Rows of a run for the table of results, labels before measures, by the stage whose results are gathered."""
