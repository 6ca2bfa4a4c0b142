"""Nuisance parameters of a test: offset, gain and delay of the force, which differ from test to test."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from pzd.record import Array, Mask
from pzd.schema.model import Frozen
from pzd.signals.jumps import gradient_within_stretches, jump_timing_error

FIRST_TIMING_COLUMN = 2
"""Index of the first column of timing (delay, instant of the voltage); those before it are of size (offset, gain)."""
NUISANCE_LIMIT = 3.5
"""Largest nuisance of a test, in standard deviations of its prior: chance exceeds it in one of two thousand tests; a
larger one is a gap of the model. What all tests share shows in the fits, whatever this allows."""


class NuisanceConfig(Frozen):
    """Standard deviations of what differs from test to test without being an effect; the means are zero.

    They are those of any stand: what the tests of this one show is estimated within them, see `pzd.fit.spread`.
    """

    offset: float = Field(default=0.005, ge=0.0, le=0.5)
    """Offset of the force, as a share of the test's peak force."""
    delay_s: float = Field(default=0.0005, ge=0.0, le=0.1)
    """Delay of the force."""
    gain: float = Field(default=0.02, ge=0.0, le=0.5)
    """Gain of the force, as a share of it."""


NO_NUISANCE = NuisanceConfig(offset=0.0, delay_s=0.0, gain=0.0)
"""Nothing differs from test to test."""


def nuisance_forces(
    residual: Array,
    predicted: Array,
    rate: float,
    variance: float,
    config: NuisanceConfig,
    timing: Array,
    calm: NDArray[np.bool_],
    counted: Mask,
) -> tuple[Array, Array]:
    """Compute the part of a residual that offset, gain and delay of the test explain within their priors.

    Equation: min_b |r - A b|^2 / s^2 + |b|^2, |b_i| <= 3.5, A = [sd_o peak, sd_g F, -sd_d dF/dt, sd_t dF/dt_U]
                                                                    Source: Gaussian prior, truncated

    Parameters
    ----------
    residual : (m,) measured less predicted force [N]
    predicted : (m,) force [N]
    rate : sampling rate [Hz]
    variance : of the noise [N^2]
    config : standard deviations of the priors
    timing : (m, 1) force by one standard deviation of the instant of the voltage [N]; (m, 0) without
    calm : (m,) the samples that enter the estimate, those beside no jump
    counted : (n,) which samples of the record these m are

    Returns
    -------
    (m,) force by offset and gain, and (m,) by timing [N]; beside a jump, where the slope of the force is that of one
    sample, the second is not meaningful
    """
    columns = np.hstack([nuisance_columns(predicted, rate, config, counted), timing])
    weight = max(variance, 1e-12 * float(np.max(np.abs(predicted))) ** 2)
    kept = columns[calm]
    normal = kept.T @ kept / weight + np.eye(columns.shape[1])
    estimate = np.linalg.solve(normal, kept.T @ residual[calm] / weight)
    within = np.clip(estimate, -NUISANCE_LIMIT, NUISANCE_LIMIT)
    within *= reducing_share(residual[calm], kept @ within)
    of_size, of_timing = slice(FIRST_TIMING_COLUMN), slice(FIRST_TIMING_COLUMN, None)
    return columns[:, of_size] @ within[of_size], columns[:, of_timing] @ within[of_timing]


def reducing_share(residual: Array, explained: Array) -> float:
    """Return the share, 0 to 1, of an explanation (m,) of a residual (m,) that leaves least of it.

    A bounded estimate may be bounded away from where it helps; an explanation that may only reduce never grows.

    Equation: min over 0 <= s <= 1 of |r - s e|^2

    Examples
    --------
    >>> reducing_share(np.array([1.0, 1.0]), np.array([4.0, 4.0]))
    0.25
    >>> reducing_share(np.array([1.0, 1.0]), np.array([-1.0, -1.0]))
    0.0
    """
    power = float(explained @ explained)
    return float(np.clip(residual @ explained / power, 0.0, 1.0)) if power > 0.0 else 1.0


DELAYS_TRIED = 29
"""Delays that are compared, over all that the prior admits: a quarter of its deviation apart."""


def likely_delay(
    measured: Array, delayed: Callable[[float], Array], variance: float, config: NuisanceConfig, calm: NDArray[np.bool_]
) -> float:
    """Return the most likely delay of a test [s], by shifts of the force as a whole.

    Where a force jumps, as that of a rigid damper at a reversal, a delay of more than a sample is no change along its
    slope. A damper of dry friction alone shows its delay nowhere but at its jumps: these count, but for the sample in
    which they fall.

    Equation: min_d min_b |F - A_d b - F(t - d)|^2 / s^2 + |b|^2 + (d / sd_d)^2, A_d = [sd_o peak, sd_g F(t - d)]

    Parameters
    ----------
    measured : (m,) force [N]
    delayed : gives the predicted force (m,) at a delay [s]
    variance : of the noise [N^2]
    config : standard deviations of the priors
    calm : (m,) the samples beside no jump of the measured force, from which offset and gain are estimated
    """
    if config.delay_s == 0.0:
        return 0.0
    peak, force = float(np.max(np.abs(measured))), measured[calm]
    beside = np.flatnonzero(~calm)
    weight = max(variance, 1e-12 * peak**2)
    shares = np.linspace(-NUISANCE_LIMIT, NUISANCE_LIMIT, DELAYS_TRIED)
    costs = np.empty(shares.size)
    for i, share in enumerate(shares):
        whole = delayed(share * config.delay_s)
        predicted = whole[calm]
        columns = np.column_stack([np.full(force.size, config.offset * peak), config.gain * predicted])
        left, pulled = force - predicted, columns.T @ (force - predicted) / weight
        own = np.linalg.solve(columns.T @ columns / weight + np.eye(2), pulled)
        costs[i] = float(left @ left) / weight - float(own @ pulled) + share**2
        if beside.size:
            cleared = measured - own[0] * config.offset * peak - own[1] * config.gain * whole
            late = (cleared - whole - jump_timing_error(cleared, whole))[beside]
            costs[i] += float(late @ late) / weight
    best = int(np.clip(np.argmin(costs), 1, shares.size - 2))
    bend = costs[best - 1] - 2.0 * costs[best] + costs[best + 1]
    between = 0.5 * (costs[best - 1] - costs[best + 1]) / bend if bend > 0.0 else 0.0
    return float(config.delay_s * (shares[best] + np.clip(between, -1.0, 1.0) * (shares[1] - shares[0])))


def nuisance_columns(predicted: Array, rate: float, config: NuisanceConfig, counted: Mask | None = None) -> Array:
    """Return the force (m, 3) [N] by one standard deviation of offset, of gain and of delay.

    Parameters
    ----------
    predicted : (m,) force [N]
    rate : sampling rate [Hz]
    config : standard deviations of the priors
    counted : (n,) which samples of the record these m are; None for all
    """
    slope = np.gradient(predicted) if counted is None else gradient_within_stretches(predicted, counted)
    peak = float(np.max(np.abs(predicted)))
    offset = np.full(predicted.size, config.offset * peak)
    return np.column_stack([offset, config.gain * predicted, -config.delay_s * slope * rate])
