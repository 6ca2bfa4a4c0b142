"""Noise is part of the gap: what is said to be noise alone never exceeds what is left."""

from __future__ import annotations

import numpy as np
import pytest
from campaign import damper_of, sine

from pzd.damper.model import BaseRow, Damper
from pzd.diagnosis.data import Split, prepare
from pzd.diagnosis.fit.prediction import predict
from pzd.diagnosis.gap import ResidualCheck, check_residual, held_out_criterion
from pzd.signals.nuisance import NuisanceConfig

QUIET = 0.3 / 1500.0
"""Noise of 0.3 N on a peak of 1500 N."""
NOBODY = Split((), (), "records")


def checked(
    true: Damper, assumed: Damper, rng: np.random.Generator, rate: float, cycles: float, frequency: float = 1.0
) -> ResidualCheck:
    record = sine(true, 0.0, frequency, 0.02, rng, noise=QUIET, colour=0.0, rate=rate, cycles=cycles)
    (prepared,) = prepare([record])
    given = predict(assumed, prepared, NuisanceConfig().delay_s)
    return check_residual(given, prepared, np.ones(prepared.record.time.size, np.bool_), NuisanceConfig())


def rigid(friction: float, **effects: dict[str, float]) -> Damper:
    row = BaseRow(voltage_V=0.0, T0_N=friction, C_Ns_per_m=2500.0, k_N_per_m=1e8)
    return Damper(base=(row,), effects=dict(effects))


@pytest.mark.parametrize("rate", [200.0, 1000.0])
@pytest.mark.parametrize("cycles", [2.6, 8.0])
def test_the_noise_floor_is_no_larger_than_what_is_left_by_the_damper_itself(
    rng: np.random.Generator, rate: float, cycles: float
) -> None:
    """Few cycles scatter more than they leave, and what chance does beside jumps of dry friction is no noise at all."""
    for effects in ({}, {"preload_offset": {"F_0": 300.0}}):
        true = rigid(300.0, **effects)
        for _ in range(3):
            gap = held_out_criterion([checked(true, true, rng, rate, cycles)], NOBODY)
            assert 0.5 * gap.after < gap.noise_floor <= gap.after


def test_what_the_model_misses_is_not_told_as_noise(rng: np.random.Generator) -> None:
    judged = checked(damper_of((0.0,), preload_offset={"F_0": 300.0}), damper_of((0.0,)), rng, 1000.0, 8.0)
    gap = held_out_criterion([judged], NOBODY)
    # What remains is the offset that the test may have of its own, 3.5 times 0.5 % of its peak: a hundredth of 300 N.
    assert gap.noise_floor < 0.05 * gap.after


@pytest.mark.parametrize("rate", [200.0, 1000.0])
def test_what_a_test_explains_of_itself_is_no_more_than_there_is(rng: np.random.Generator, rate: float) -> None:
    """Of a force 2 ms late; where it jumps, its slope times the delay says anything up to the jump and back."""
    for frequency in (0.5, 2.0):
        late = rigid(300.0, sensor_delay={"tau": 0.002})
        judged = checked(late, rigid(300.0), rng, rate, 8.0, frequency)
        residual, nuisances = judged.residual[judged.wanted], judged.nuisances[judged.wanted]
        left = judged.cleared[judged.wanted]
        assert left @ left < residual @ residual
        assert nuisances @ nuisances <= residual @ residual


@pytest.mark.parametrize("rate", [200.0, 500.0])
@pytest.mark.parametrize("delay", [0.0005, 0.001])
def test_a_delay_that_any_test_may_have_is_no_gap_where_a_rigid_damper_jumps(
    rng: np.random.Generator, rate: float, delay: float
) -> None:
    judged = checked(rigid(300.0, sensor_delay={"tau": delay}), rigid(300.0), rng, rate, 8.0)
    assert judged.power < (3e-4 * judged.peak) ** 2
    assert np.min(judged.probability["harmonics"]) > 1e-4
