"""Jumps: what is recorded beside one is chance, and neither a gap nor evidence."""

from __future__ import annotations

import numpy as np
from campaign import TABLE_2, damper_of, sine

from pzd.damper.compose import respond
from pzd.damper.motion import Motion
from pzd.diagnosis.data import prepare
from pzd.diagnosis.fit.prediction import predict
from pzd.diagnosis.gap import check_residual, visible_gap
from pzd.record import Record, sliced
from pzd.signals.jumps import jumps
from pzd.signals.nuisance import NuisanceConfig


def test_a_step_is_a_jump_of_its_own_size_at_the_two_samples_beside_it() -> None:
    force = np.where(np.arange(400) < 170, -250.0, 250.0) + 1e-3 * np.sin(np.arange(400))
    found = jumps(force)
    assert np.flatnonzero(found).tolist() == [169, 170]
    assert np.allclose(found[[169, 170]], 500.0, atol=0.01)


def test_a_smooth_force_under_noise_has_next_to_no_jumps(rng: np.random.Generator) -> None:
    time = np.arange(4000) / 1000.0
    found = jumps(1000.0 * np.sin(2 * np.pi * time) + 10.0 * rng.standard_normal(time.size))
    # Gaussian bends exceed six standard deviations once in 500 million samples; the scatter is known to 2 %.
    assert not np.any(found)


def test_the_true_damper_with_a_large_jump_at_every_reversal_leaves_no_gap(rng: np.random.Generator) -> None:
    friction = {"F_s": 0.4 * TABLE_2[0.0][0], "v_s": 0.015}
    damper = damper_of((0.0,), stribeck_friction=friction)
    record = sine(damper, 0.0, 1.03, 0.03, rng, noise=0.005, rate=500.0)
    (prepared,) = prepare((record,))
    wanted = np.ones(prepared.record.time.size, dtype=np.bool_)
    with_jump, without = (predict(d, prepared, NuisanceConfig().delay_s) for d in (damper, damper_of((0.0,))))
    assert visible_gap([check_residual(with_jump, prepared, wanted, NuisanceConfig())]) < 0.001
    assert visible_gap([check_residual(without, prepared, wanted, NuisanceConfig())]) > 0.01


def test_so_does_one_whose_test_does_not_repeat_and_has_more_jumps_than_a_cycle(rng: np.random.Generator) -> None:
    """Two tones without a common period, a hundred reversals, each between samples of 500 Hz."""
    damper = damper_of((0.0,), stribeck_friction={"F_s": 0.4 * TABLE_2[0.0][0], "v_s": 0.015})
    time = np.arange(0.0, 40.0, 1.0 / 4000.0)
    tones = tuple(zip((0.02, 0.012), 2.0 * np.pi * np.array([0.83, 1.57]), strict=True))
    x, v, a = (
        np.asarray(sum(size * rate**n * wave(rate * time + 0.3) for size, rate in tones))
        for n, wave in ((0, np.sin), (1, np.cos), (2, lambda at: -np.sin(at)))
    )
    force = respond(damper, Motion(time, x, v, a, np.zeros(time.size)))
    force += 0.002 * np.max(force) * rng.standard_normal(time.size)
    fine = Record("two-tone", None, time, x, v, a, force, np.zeros(time.size))
    (prepared,) = prepare((sliced(fine, np.arange(time.size) % 8 == 3),))
    assert prepared.cycles is None
    assert np.count_nonzero(np.diff(np.sign(v))) > 80
    check = check_residual(
        predict(damper, prepared, NuisanceConfig().delay_s),
        prepared,
        np.ones(prepared.record.time.size, dtype=np.bool_),
        NuisanceConfig(),
    )
    assert check.probability["smooth"][0] > 1e-3
    assert visible_gap([check]) < 0.001
