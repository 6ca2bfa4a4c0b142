"""The runs of a sweep: every combination of values, and in each the same random draws."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from pzd.config import Normal, SweepConfig
from pzd.record import Array
from pzd.schema.yamltree import Scalar, written

LEAST_PROBABILITY = 1e-9
"""A quasi-random number may be 0, where a normal distribution has no value."""


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
        """What this run sets in the config, as `--set` takes it."""
        return tuple(f"{key}={written(value)}" for key, value in (*self.over, *self.drawn))

    @property
    def described(self) -> str:
        """What this run differs in, in words."""
        scattered = (f"{name} {z:+.3g} sd" for name, z in self.damper)
        return ", ".join((*self.overrides, *scattered))


def quantities(sweep: SweepConfig) -> tuple[str, ...]:
    """What is drawn, in the order of the columns."""
    return (*sweep.drawn, *(f"damper.{name}" for name in sweep.damper))


def with_indices(sweep: SweepConfig) -> bool:
    """Whether Sobol indices can say which of the quantities decides: there are two or more."""
    return len(quantities(sweep)) > 1


def tasks(sweep: SweepConfig, seed: int) -> tuple[Task, ...]:
    """Every run of a sweep, in order: combination by combination, and draw by draw.

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
    """(runs, d) probabilities at which the d drawn quantities are taken in one combination; (1, 0) without any.

    Equation: rows A, then B, then for every quantity A with its column taken from B         Source: Saltelli 2010
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
