"""The hysteresis of Bouc and Wen: against another solver, its dissipation, and its distinction from its neighbours."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from pzd.damper.compose import respond
from pzd.damper.effects.bouc_wen import advance, rate
from pzd.damper.model import BaseRow, Damper
from pzd.damper.motion import Motion

SOFT = Damper(base=(BaseRow(T0_N=0.0, C_Ns_per_m=1e-3, k_N_per_m=1e9),))
"""Nearly nothing, so that what stands beside it is seen alone."""
F_H, X_H = 150.0, 2.0e-3


def sine(amplitude: float, frequency: float, samples: int = 2000, cycles: int = 3) -> Motion:
    """A sine about zero."""
    time = np.linspace(0.0, cycles / frequency, cycles * samples + 1)
    w = 2.0 * np.pi * frequency
    x, v = amplitude * np.sin(w * time), amplitude * w * np.cos(w * time)
    return Motion(time, x, v, -(w**2) * x, None)


def force_of(motion: Motion, sigma: float = 0.5) -> np.ndarray:
    """(n,) force of the hysteresis alone [N]."""
    return beside(motion, "bouc_wen", {"F_h": F_H, "x_h": X_H, "sigma": sigma})


def beside(motion: Motion, effect: str, values: dict[str, float]) -> np.ndarray:
    """(n,) what an effect adds [N]."""
    return respond(SOFT.with_effect(effect, values), motion) - respond(SOFT, motion)


def lost(motion: Motion, force: np.ndarray) -> float:
    """Work over the last cycle [J]."""
    last = slice(2 * (motion.time.size - 1) // 3, None)
    return float(np.trapezoid(force[last], motion.displacement[last]))


@pytest.mark.parametrize("sigma", [0.5, 1.0, 4.0])
def test_bouc_and_wen_converges_to_another_solver_with_the_square_of_the_step(sigma: float) -> None:
    """dz/dt = A v - gamma |v| |z| z - beta v z^2 with z in newtons, on two tones."""
    A = F_H / X_H
    gamma, beta = (share * A / F_H**2 for share in (sigma, 1.0 - sigma))
    tones = ((4.0e-3, 1.0), (1.5e-3, 3.7))

    def motion(time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        w = [2.0 * np.pi * f for _, f in tones]
        x = sum(a * np.sin(omega * time) for (a, _), omega in zip(tones, w, strict=True))
        return x, sum(a * omega * np.cos(omega * time) for (a, _), omega in zip(tones, w, strict=True))

    def slope(t: float, z: np.ndarray) -> np.ndarray:
        v = motion(np.array(t))[1]
        return np.asarray(A * v - gamma * abs(v) * abs(z) * z - beta * v * z * z)

    coarse = np.arange(301) * 4e-3
    truth = solve_ivp(slope, (0.0, 1.2), [0.0], "DOP853", coarse, rtol=1e-11, atol=1e-9, max_step=1e-3).y[0]
    errors = []
    for parts in (1, 4, 16):
        time = np.linspace(0.0, 1.2, 300 * parts + 1)
        x, v = motion(time)
        force = force_of(Motion(time, x, v, np.zeros_like(x), None), sigma)[::parts]
        errors.append(float(np.max(np.abs(force - truth))))
    assert errors[0] < 1e-3 * F_H
    assert errors[1] < errors[0] / 16.0
    assert errors[2] < 1e-6 * F_H


def test_two_travels_to_one_side_are_their_sum(rng: np.random.Generator) -> None:
    for deflection, first, second in zip(
        rng.uniform(-1.2, 1.2, 200) * X_H, *(rng.exponential(X_H, (2, 200))), strict=True
    ):
        sigma, side = float(rng.uniform(0.5, 6.0)), float(rng.choice([-1.0, 1.0]))
        between = advance(deflection, side * first, X_H, sigma)
        ended = advance(deflection, side * (first + second), X_H, sigma)
        assert advance(between, side * second, X_H, sigma) == pytest.approx(ended, abs=1e-12 * X_H)


@pytest.mark.parametrize("sigma", [0.5, 1.0, 4.0])
def test_the_rate_is_the_derivative_of_the_deflection_by_the_travel(sigma: float) -> None:
    for side in (-1.0, 1.0):
        for z in (-0.9, -0.3, 0.2, 0.7):
            step = side * 1e-6 * X_H
            moved = advance(z * X_H, step, X_H, sigma) - z * X_H
            assert moved / step == pytest.approx(rate(z * X_H, side, X_H, sigma), rel=1e-4)


@pytest.mark.parametrize("frequency", [0.1, 10.0])
@pytest.mark.parametrize("sigma", [0.5, 2.0])
def test_a_small_loop_of_bouc_and_wen_dissipates_with_the_fourth_power_of_its_amplitude_at_any_speed(
    sigma: float, frequency: float
) -> None:
    """sigma F_h A^4/x_h^3 to lowest order: where `second_branch` is a spring and loses nothing."""
    branch = {"T0_2": F_H, "k_2": F_H / X_H}
    for share in (0.02, 0.04):
        motion = sine(share * X_H, frequency, 20000)
        assert lost(motion, force_of(motion, sigma)) == pytest.approx(sigma * F_H * X_H * share**4, rel=0.02)
        assert abs(lost(motion, beside(motion, "second_branch", branch))) < 1e-3 * sigma * F_H * X_H * share**4


def test_a_wide_loop_of_bouc_and_wen_dissipates_the_closed_form() -> None:
    """Each half cycle is short of F_h by 3/2 x_h while it unwinds straight, and by ln 2 x_h while it winds up."""
    motion = sine(50.0 * X_H, 1.0, 20000)
    force = force_of(motion)
    assert np.max(np.abs(force)) == pytest.approx(F_H, rel=1e-9)
    assert lost(motion, force) == pytest.approx(F_H * X_H * (200.0 - 2.0 * (1.5 + np.log(2.0))), rel=1e-6)


def test_one_speed_at_two_amplitudes_distinguishes_bouc_and_wen_from_a_rounded_yield() -> None:
    """How far from zero force the rod is, and how fast, where the force has come up to half of what it reaches."""
    fast = 0.2
    rigid = Damper(base=(BaseRow(T0_N=F_H, C_Ns_per_m=1e-3, k_N_per_m=1e9),))
    rounded = rigid.with_effect("rounded_yield", {"w_s": 0.02})

    def half_way(amplitude: float, damper: Damper) -> tuple[float, float]:
        motion = sine(amplitude, fast / (2.0 * np.pi * amplitude), 20000)
        force = respond(damper, motion)
        rising = slice(round(1.75 * 20000), round(2.0 * 20000))
        i = rising.start + int(np.argmax(force[rising] >= 0.5 * F_H))
        return float(motion.displacement[i] + amplitude), float(motion.velocity[i])

    smooth = SOFT.with_effect("bouc_wen", {"F_h": F_H, "x_h": X_H, "sigma": 0.5})
    way, speed = zip(*(half_way(amplitude, smooth) for amplitude in (0.02, 0.06)), strict=True)
    assert way[1] == pytest.approx(way[0], rel=1e-3)
    assert way[1] == pytest.approx((1.0 + np.arctanh(0.5)) * X_H, rel=2e-3)
    assert speed[0] > 1.5 * speed[1]
    way, speed = zip(*(half_way(amplitude, rounded) for amplitude in (0.02, 0.06)), strict=True)
    assert speed[1] == pytest.approx(speed[0], rel=2e-2)
    assert way[1] > 2.0 * way[0]
