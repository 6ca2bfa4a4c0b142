"""What may differ from test to test without being an effect: offset, gain and delay of the force."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from pzd.record import Array, Mask
from pzd.schema.model import Frozen
from pzd.signals.jumps import slope_within

TIMED = 2
"""Columns from this one on say when a force comes; those before it, how large it is."""
AT_MOST = 3.5
"""Offset, gain, delay and the instant of the voltage explain at most so many standard deviations of a test: chance
goes further in one of two thousand; more is a gap. What all tests share shows in the fits, whatever this allows."""


class NuisanceConfig(Frozen):
    """What may differ from test to test without being an effect: standard deviations, zero mean."""

    offset: float = Field(default=0.005, ge=0.0, le=0.5)
    """Offset of the force, as a share of the test's peak force."""
    delay_s: float = Field(default=0.0005, ge=0.0, le=0.1)
    """Delay of the force."""
    gain: float = Field(default=0.02, ge=0.0, le=0.5)
    """Gain of the force, as a share of it."""


def nuisance(
    residual: Array,
    predicted: Array,
    rate: float,
    variance: float,
    config: NuisanceConfig,
    timing: Array,
    calm: NDArray[np.bool_],
    counted: Mask,
) -> tuple[Array, Array]:
    """The part of a residual that offset, gain and delay of the test explain within their priors.

    Equation: min_b |r - A b|^2 / s^2 + |b|^2, |b_i| <= 3.5, A = [sd_o peak, sd_g F, -sd_d dF/dt, sd_t dF/dt_U]
                                                                    Source: Gaussian prior, truncated

    Parameters
    ----------
    residual : (m,) measured less predicted force [N]
    predicted : (m,) force [N]
    rate : sampling rate [Hz]
    variance : of the noise [N^2]
    config : standard deviations of the priors
    timing : (m, 1) what one standard deviation of the voltage's instant makes of the force [N]; (m, 0) without
    calm : (m,) the samples that count, those beside no jump
    counted : (n,) which samples of the record these m are

    Returns
    -------
    (m,) force by offset and gain, and (m,) by when it comes [N]; beside a jump, where the slope of the force is that of
    one sample, the second may be far from anything that a delay does
    """
    columns = np.hstack([columns_of(predicted, rate, config, counted), timing])
    weight = max(variance, 1e-12 * float(np.max(np.abs(predicted))) ** 2)
    kept = columns[calm]
    normal = kept.T @ kept / weight + np.eye(columns.shape[1])
    estimate = np.linalg.solve(normal, kept.T @ residual[calm] / weight)
    within = np.clip(estimate, -AT_MOST, AT_MOST)
    return columns[:, :TIMED] @ within[:TIMED], columns[:, TIMED:] @ within[TIMED:]


def columns_of(predicted: Array, rate: float, config: NuisanceConfig, counted: Mask | None = None) -> Array:
    """(m, 3) force [N] that one standard deviation of offset, gain and delay makes of a predicted force.

    Parameters
    ----------
    predicted : (m,) force [N]
    rate : sampling rate [Hz]
    config : standard deviations of the priors
    counted : (n,) which samples of the record these m are; None for all
    """
    slope = np.gradient(predicted) if counted is None else slope_within(predicted, counted)
    peak = float(np.max(np.abs(predicted)))
    return np.column_stack(
        [
            np.full(predicted.size, config.offset * peak),
            config.gain * predicted,
            -config.delay_s * slope * rate,
        ]
    )
