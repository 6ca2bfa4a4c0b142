"""Branches: closed forms, distinction from their neighbours, and independence of sampling and frame."""

from __future__ import annotations

import numpy as np
import pytest

from pzd.damper.compose import (
    branch_forces,
    parallel_force_along,
    parallel_force_change,
    respond,
    static_force,
    steady_force,
)
from pzd.damper.confounders import module_of
from pzd.damper.effect import arguments
from pzd.damper.effects import library, nameable
from pzd.damper.model import BaseRow, Damper
from pzd.damper.motion import Motion
from pzd.damper.parameter_rows import constant_rows, parallel_rows
from pzd.rig.stand.frame import force_in_frame

PLAIN = Damper(
    base=(
        BaseRow(voltage_V=0.0, T0_N=300.0, C_Ns_per_m=2700.0, k_N_per_m=2e6),
        BaseRow(voltage_V=150.0, T0_N=1300.0, C_Ns_per_m=2500.0, k_N_per_m=4e6),
    )
)
SLIPS, STIFFNESS = 100.0, 5e4
SHELF = SLIPS / STIFFNESS
BRANCH = PLAIN.with_effect("second_branch", {"T0_2": SLIPS, "k_2": STIFFNESS})
BY_VOLTAGE = {"T0_2": (60.0, 250.0), "k_2": (9e4, 4e4), "at_voltage_V": (0.0, 150.0)}


def sine(amplitude: float, frequency: float = 1.5, samples: int = 2000, voltage: float | np.ndarray = 0.0) -> Motion:
    """Three cycles of a sine about zero."""
    time = np.linspace(0.0, 3.0 / frequency, 3 * samples + 1)
    omega = 2.0 * np.pi * frequency
    x, v = amplitude * np.sin(omega * time), amplitude * omega * np.cos(omega * time)
    return Motion(time, x, v, -(omega**2) * x, np.broadcast_to(voltage, time.shape).copy())


def beside(motion: Motion, damper: Damper = BRANCH) -> np.ndarray:
    """(n,) what the branch adds to the force [N]."""
    return respond(damper, motion) - respond(PLAIN, motion)


def lost(motion: Motion, force: np.ndarray) -> float:
    """Work over the last cycle [J]."""
    last = slice(2 * (motion.time.size - 1) // 3, None)
    return float(np.trapezoid(force[last], motion.displacement[last]))


def test_inside_its_shelf_a_branch_is_a_spring_and_dissipates_nothing() -> None:
    motion = sine(0.9 * SHELF)
    np.testing.assert_allclose(beside(motion), STIFFNESS * motion.displacement, rtol=0, atol=1e-9)


@pytest.mark.parametrize("frequency", [0.1, 10.0])
@pytest.mark.parametrize("amplitude", [1.5, 4.0, 20.0])
def test_beyond_its_shelf_a_branch_dissipates_four_times_its_force_times_the_slip_at_any_speed(
    amplitude: float, frequency: float
) -> None:
    """Masing's loop: each half cycle winds it through 2 T0_2/k_2 and slips through the rest of 2 A."""
    motion = sine(amplitude * SHELF, frequency)
    force = beside(motion)
    assert np.max(np.abs(force)) == pytest.approx(SLIPS, rel=1e-12)
    assert lost(motion, force) == pytest.approx(4.0 * SLIPS * (amplitude - 1.0) * SHELF, rel=1e-5)


@pytest.mark.parametrize("branch", ["second_branch", "bouc_wen"])
@pytest.mark.parametrize("alpha", [-0.6, 0.1, 0.6])
def test_a_damper_that_is_harder_in_one_direction_is_so_in_its_branches_too(branch: str, alpha: float) -> None:
    """A third of the friction in a branch: both directions differ by 2 alpha of the whole, not of two thirds of it."""
    values = {"second_branch": {"T0_2": 150.0, "k_2": 5e4}, "bouc_wen": {"F_h": 150.0, "x_h": 2e-3, "sigma": 1.0}}
    damper = PLAIN.with_effect(branch, values[branch])
    uneven = damper.with_effect("asymmetry", {"alpha": alpha})
    v = np.array([-0.4, -0.1, -1e-3, 1e-3, 0.1, 0.4])
    expected = (1.0 + alpha * np.sign(v)) * steady_force(damper, 0.0, None, v)
    np.testing.assert_allclose(steady_force(uneven, 0.0, None, v), expected, rtol=1e-9)
    motion = sine(0.04, frequency=0.02)
    slipping = np.abs(motion.displacement) < 0.5 * 0.04
    slipping[: motion.time.size // 3] = False
    even = respond(damper, motion)[slipping]
    factor = 1.0 + alpha * np.sign(motion.velocity[slipping])
    np.testing.assert_allclose(respond(uneven, motion)[slipping], factor * even, rtol=1e-4)


def test_a_small_amplitude_distinguishes_a_branch_from_a_rounded_yield_and_a_lash() -> None:
    """Inside the shelf a rounded yield loses as much as its speed says, and behind a lash nothing pulls at all."""
    motion = sine(0.9 * SHELF)
    slippery = Damper(base=(BaseRow(T0_N=SLIPS, C_Ns_per_m=1.0, k_N_per_m=1e7),))
    rounded = respond(slippery.with_effect("rounded_yield", {"w_s": 0.01}), motion)
    assert lost(motion, rounded) > 0.5 * SLIPS * 4.0 * 0.9 * SHELF
    loose = respond(slippery.with_effect("lash", {"delta": 2.0 * SHELF}), motion)
    assert np.max(np.abs(loose)) == 0.0
    assert abs(lost(motion, beside(motion))) < 1e-6 * SLIPS * SHELF


def test_one_speed_at_two_amplitudes_distinguishes_a_branch_from_a_rounded_yield() -> None:
    """Where the force comes up to half its way behind a reversal: at the same travel, not at the same speed."""
    fast = 0.2

    def half_way(amplitude: float, damper: Damper, plain: Damper) -> tuple[float, float]:
        motion = sine(amplitude, fast / (2.0 * np.pi * amplitude), 20000)
        force = respond(damper, motion) - respond(plain, motion)
        rising = slice(round(1.75 * 20000), round(2.0 * 20000))
        i = rising.start + int(np.argmax(force[rising] >= 0.5 * SLIPS))
        return float(motion.displacement[i] + amplitude), float(motion.velocity[i])

    shelf = [half_way(amplitude, BRANCH, PLAIN) for amplitude in (0.01, 0.03)]
    assert shelf[1][0] == pytest.approx(shelf[0][0], rel=1e-3)
    assert shelf[1][0] == pytest.approx(1.5 * SHELF, rel=1e-3)
    assert shelf[0][1] > 1.5 * shelf[1][1]
    rigid = Damper(base=(BaseRow(T0_N=SLIPS, C_Ns_per_m=1e-3, k_N_per_m=1e9),))
    nothing = Damper(base=(BaseRow(T0_N=0.0, C_Ns_per_m=1e-3, k_N_per_m=1e9),))
    rounded = [half_way(a, rigid.with_effect("rounded_yield", {"w_s": 0.02}), nothing) for a in (0.01, 0.03)]
    assert rounded[1][1] == pytest.approx(rounded[0][1], rel=2e-2)
    assert rounded[1][0] > 2.0 * rounded[0][0]


def zigzag(corners: np.ndarray, parts: int) -> Motion:
    """Speeds linear between (n,) corners, each interval sampled so often: every displacement is a parabola."""
    time = np.arange(corners.size) * 0.01
    fine = np.linspace(0.0, time[-1], (corners.size - 1) * parts + 1)
    v = np.interp(fine, time, corners)
    x = np.concatenate([[0.0], np.cumsum(0.5 * (v[1:] + v[:-1]) * np.diff(fine))])
    return Motion(fine, x, v, np.zeros_like(v))


def test_a_step_is_cut_where_the_rod_reverses(rng: np.random.Generator) -> None:
    """Against the same motion in steps a four hundredth as long, whose ends lie beside the turns."""
    corners = rng.normal(0.0, 0.2, 400)
    whole, fine = zigzag(corners, 1), zigzag(corners, 400)
    row = row_of_branch(SLIPS, STIFFNESS)
    assert np.sum(np.diff(np.sign(corners)) != 0.0) > 100
    np.testing.assert_allclose(branch_forces(whole, row), branch_forces(fine, row)[::400], rtol=0, atol=1e-9 * SLIPS)


def row_of_branch(slips: float, stiffness: float) -> np.ndarray:
    """(1, m) row of what stands beside the element: this branch alone."""
    _, row = constant_rows(1.0, 1.0, 1.0, {"second_branch": {"T0_2": slips, "k_2": stiffness}})
    assert row is not None
    return row


def test_where_its_parameters_move_the_error_falls_with_the_square_of_the_step() -> None:
    damper, samples, most = PLAIN.with_effect("second_branch", BY_VOLTAGE), (90, 270, 810), 21870

    def force(count: int) -> np.ndarray:
        motion = sine(0.02, 3.0, count, 75.0 + 70.0 * np.sin(np.linspace(0.3, 40.3, 3 * count + 1)))
        rows = parallel_rows(damper, motion.voltage)
        assert rows is not None
        return branch_forces(motion, rows)

    truth = force(most)
    errors = [float(np.sqrt(np.mean((force(count) - truth[:: most // count]) ** 2))) for count in samples]
    assert errors[0] < 2e-3 * 250.0
    assert errors[2] < 2.0 / 81.0 * errors[0]


def test_at_steady_slip_a_branch_is_a_dry_friction_and_at_rest_it_has_no_force() -> None:
    speeds = np.array([-0.3, -0.0, 0.0, 0.3])
    damper = PLAIN.with_effect("second_branch", BY_VOLTAGE)
    for voltage, slips in ((0.0, 60.0), (75.0, 155.0), (150.0, 250.0)):
        more = steady_force(damper, voltage, None, speeds) - steady_force(PLAIN, voltage, None, speeds)
        np.testing.assert_allclose(more, slips * np.copysign(1.0, speeds), rtol=1e-12)
        assert static_force(damper, voltage) == 0.0
    time = np.arange(2000) * 1e-3
    even = Motion(time, 0.1 * time, np.full(2000, 0.1), np.zeros(2000), np.full(2000, 75.0))
    assert respond(damper, even)[-1] == pytest.approx(float(steady_force(damper, 75.0, None, 0.1)), rel=1e-9)


def test_behind_a_frame_a_branch_follows_the_extension_of_the_damper() -> None:
    """Inside its shelf as a spring beside the element is; a frame that gives takes part of the travel."""
    motion, never = sine(0.01), {"T0_2": 1e6, "k_2": 8000.0}
    spring, branch = PLAIN.with_effect("gas_spring", {"k_g": 8000.0}), PLAIN.with_effect("second_branch", never)
    behind = force_in_frame(branch, motion, 2e6)
    np.testing.assert_allclose(behind, force_in_frame(spring, motion, 2e6), rtol=0, atol=1e-6)
    assert np.max(np.abs(behind - respond(branch, motion))) > 1.0


def test_the_rate_is_the_derivative_of_the_deflection_by_the_travel() -> None:
    """The half-car books by it what is stored and what slips."""
    for effect in (effect for effect in library().values() if effect.place == "branch"):
        laws = module_of(effect)
        given = {p.name: p.neutral or 100.0 for p in effect.parameters}
        to, by = ({n: given[n] for n in arguments(f) if n in given} for f in (laws.advance, laws.rate))
        for side in (-1.0, 1.0):
            for deflection in (0.0, 0.5e-3, laws.advance(0.0, side * np.inf, **to)):
                moved = laws.advance(deflection, side * 1e-9, **to) - deflection
                assert moved / (side * 1e-9) == pytest.approx(laws.rate(deflection, side, **by), abs=1e-6)


def test_two_travels_to_one_side_are_their_sum_and_a_step_may_be_cut_anywhere(rng: np.random.Generator) -> None:
    for effect in (effect for effect in library().values() if effect.place == "branch"):
        advance = module_of(effect).advance
        given = {p.name: p.neutral or 100.0 for p in effect.parameters}
        values = {name: given[name] for name in arguments(advance) if name in given}
        for before, first, second in rng.normal(0.0, 2e-3, (100, 3)):
            deflection, same_way = advance(0.0, before, **values), abs(first) * np.sign(second)
            ended = advance(deflection, same_way + second, **values)
            assert advance(advance(deflection, same_way, **values), second, **values) == pytest.approx(ended, abs=1e-14)


def test_no_verdict_names_a_branch() -> None:
    assert "second_branch" in library()
    assert "second_branch" not in nameable()


@pytest.mark.parametrize("moved", ["gas_spring", "second_branch", "zero"])
def test_the_change_of_the_parallel_forces_is_the_difference_of_two(moved: str) -> None:
    """Whether branches move, or only what has no memory, or the zero from which the displacement counts."""
    effects = {"gas_spring": {"k_g": 3000.0}, "second_branch": {"T0_2": SLIPS, "k_2": STIFFNESS}}
    changed = {**effects, **({} if moved == "zero" else {moved: {n: 1.1 * v for n, v in effects[moved].items()}})}
    rows = tuple(constant_rows(300.0, 2700.0, 2e6, each)[1] for each in (effects, changed))
    motion = sine(0.01, samples=200)
    motions = motion, motion.centred_on(0.002 if moved == "zero" else 0.0)
    assert rows[0] is not None
    assert rows[1] is not None
    one, other = (parallel_force_along(m, r) for m, r in zip(motions, (rows[0], rows[1]), strict=True))
    change = parallel_force_change(motions, (rows[0], rows[1]))
    assert np.max(np.abs(other - one)) > 1.0
    assert change == pytest.approx(other - one, abs=1e-9)
