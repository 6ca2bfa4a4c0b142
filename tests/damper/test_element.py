"""The exact Bingham element against solvers of other kinds, limits in closed form, and the published rows."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from pzd.damper.element import element_force, element_force_sensitivities, element_forces

STEP = 1e-3


def multisine(rng: np.random.Generator, samples: int = 1500) -> np.ndarray:
    """A few sines of random phase, up to 12 Hz."""
    time = np.arange(samples) * STEP
    return sum(
        a * np.sin(2 * np.pi * f * time + rng.uniform(0, 2 * np.pi))
        for f, a in ((1.0, 0.02), (3.7, 0.006), (12.0, 0.001))
    )


def piece_of(F: float, T0: float, C: float, k: float, speed: float, left: float) -> tuple[float, float]:
    """Force and time used in the regime that the motion leads into, by DOP853 up to the next event."""
    sticks = abs(F) < T0 * (1 - 1e-13) or (abs(F) <= T0 * (1 + 1e-13) and F * speed <= 0)
    side = float(np.sign(F))

    def rate(_, y) -> list[float]:
        return [k * speed] if sticks else [k * speed - k / C * (y[0] - side * T0)]

    def above(_, y) -> float:
        return y[0] - T0

    def below(_, y) -> float:
        return y[0] + T0

    above.terminal = below.terminal = True
    run = solve_ivp(rate, (0.0, left), [F], "DOP853", rtol=1e-13, atol=1e-10, events=[above, below])
    return run.y[0, -1], run.t[-1]


def restarted(x: np.ndarray, T0: float, C: float, k: float) -> np.ndarray:
    """The same element by DOP853, restarted at every sample and at every change of regime."""
    force = [0.0]
    for before, after in itertools.pairwise(x):
        speed, F, left = (after - before) / STEP, force[-1], STEP
        while left > STEP * 1e-12:
            F, used = piece_of(F, T0, C, k, speed, left)
            if used < 1e-15:  # stands on an edge: step over it
                F = np.sign(F) * T0 * (1 + 1e-12 * np.sign(F * speed))
                used = 1e-16
            left -= used
        force.append(F)
    return np.array(force)


def test_agrees_with_an_event_restarted_high_order_solver_to_1e_9(rng: np.random.Generator) -> None:
    for _ in range(2):
        T0, C, k = 400 * rng.uniform(0.5, 2), 2500 * rng.uniform(0.5, 2), 4e5 * rng.uniform(0.5, 2)
        x = multisine(rng, 400)
        ours = element_force(x, STEP, T0, C, k)
        assert np.max(np.abs(ours - restarted(x, T0, C, k))) <= 1e-9 * np.max(np.abs(ours))


@pytest.mark.parametrize("bent", [False, True], ids=["linear", "parabola"])
@pytest.mark.parametrize("column", [0, 1, 2])
def test_sensitivities_are_the_limit_of_central_differences(rng: np.random.Generator, column: int, bent: bool) -> None:
    x, values = multisine(rng), np.array([400.0, 2500.0, 4e5])
    velocity = np.gradient(x, STEP) if bent else None
    size = 1.0 / values[2] if column == 2 else values[column]  # the third is by 1/k
    ahead, behind = values.copy(), values.copy()
    ahead[column], behind[column] = values[column] * (1.0 + 1e-6), values[column] * (1.0 - 1e-6)
    if column == 2:
        ahead[2], behind[2] = 1.0 / (size * (1.0 + 1e-6)), 1.0 / (size * (1.0 - 1e-6))
    difference = element_force(x, STEP, *ahead, 0.0, velocity) - element_force(x, STEP, *behind, 0.0, velocity)
    _, slopes = element_force_sensitivities(x, STEP, *values, 0.0, velocity)
    expected = difference / (2e-6 * size)
    assert np.max(np.abs(slopes[:, column] - expected)) <= 1e-6 * np.max(np.abs(expected))


def test_many_elements_at_once_give_the_force_of_each(rng: np.random.Generator) -> None:
    x = np.cumsum(rng.standard_normal(500)) * 1e-3
    elements = np.column_stack([rng.uniform(100, 1000, 20), rng.uniform(500, 5000, 20), rng.uniform(1e5, 1e6, 20)])
    each = [element_force(x, 2e-3, *element) for element in elements]
    np.testing.assert_array_equal(element_forces(x, 2e-3, elements), each)


def test_steady_slip_gives_friction_plus_viscous_force() -> None:
    x = 0.2 * STEP * np.arange(3000)
    assert element_force(x, STEP, 301.0, 2720.0, 1.99e5)[-1] == pytest.approx(301.0 + 2720.0 * 0.2, rel=1e-12)


def test_a_sticking_element_is_a_spring() -> None:
    x = 1e-4 * np.sin(np.linspace(0, 20, 500))
    np.testing.assert_allclose(element_force(x, STEP, 301.0, 2720.0, 1.99e5), 1.99e5 * x, rtol=0, atol=1e-9)


def test_without_friction_the_element_is_a_maxwell_element() -> None:
    time, C, k, omega = np.arange(8000) * 1e-4, 2500.0, 4e5, 2 * np.pi * 3
    force = element_force(0.02 * np.sin(omega * time), 1e-4, 0.0, C, k)
    transfer = 1j * omega * C / (1 + 1j * omega * C / k) * 0.02
    late = time > 0.4
    steady = (transfer * np.exp(1j * omega * time)).imag
    np.testing.assert_allclose(force[late], steady[late], atol=1e-5 * np.abs(transfer))


def test_refining_a_straight_path_changes_nothing() -> None:
    x = np.interp(np.arange(0, 401) / 400, np.linspace(0, 1, 5), [0.0, 0.01, -0.01, 0.002, 0.0])
    coarse = element_force(x, 4 * STEP, 400.0, 2500.0, 4e5)
    fine = element_force(np.interp(np.arange(1601) / 4, np.arange(401), x), STEP, 400.0, 2500.0, 4e5)
    np.testing.assert_allclose(fine[::4], coarse, rtol=0, atol=1e-9)


def test_the_error_of_a_sampled_sine_falls_with_the_square_of_the_step() -> None:
    def force(rate: int) -> np.ndarray:
        time = np.arange(rate + 1) / rate
        return element_force(0.03 * np.sin(4 * np.pi * time), 1 / rate, 301.0, 2720.0, 1.99e5)[:: rate // 250]

    truth = force(64000)
    errors = [np.max(np.abs(force(rate) - truth)) for rate in (500, 1000, 2000)]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all((orders > 1.7) & (orders < 2.3)), orders


PEAKS = [
    ("T1", 0.022, 1.0, [(820, 9200, 5.81e5, 2085), (1985, 16400, 7.78e5, 4232), (3410, 13700, 1.11e6, 5298)]),
    ("T2", 0.030, 2.0, [(301, 2720, 1.99e5, 1311), (356, 3300, 3.58e5, 1592), (796, 3040, 3.75e5, 1936)]),
]


@pytest.mark.parametrize(("table", "amplitude", "frequency", "rows"), PEAKS)
def test_the_published_parameters_give_the_peaks_computed_ahead(table, amplitude, frequency, rows) -> None:
    time = np.arange(int(3e3 / frequency)) * STEP
    for T0, C, k, peak in rows:
        force = element_force(amplitude * np.sin(2 * np.pi * frequency * time), STEP, T0, C, k)
        assert np.max(force[time > 1.5 / frequency]) == pytest.approx(peak, abs=1.5), table


def test_the_element_never_gives_energy_back(rng: np.random.Generator) -> None:
    for _ in range(3):
        x = multisine(rng)
        force = element_force(x, STEP, 400.0, 2500.0, 4e5)
        work = np.concatenate([[0.0], np.cumsum(0.5 * (force[1:] + force[:-1]) * np.diff(x))])
        assert np.min(work - 0.5 * force**2 / 4e5) > -1e-3


@pytest.mark.parametrize("every", [2, 7])
@pytest.mark.parametrize("samples", [1, 2, 57, 60])
def test_every_nth_force_is_that_of_the_whole_path(rng: np.random.Generator, every: int, samples: int) -> None:
    displacement = 0.01 * np.cumsum(rng.standard_normal(samples))
    given = (displacement, 1e-3, 300.0, 2000.0, 2e5, 50.0)
    force, slopes = element_force_sensitivities(*given)
    kept, kept_slopes = element_force_sensitivities(*given, every=every)
    assert np.array_equal(kept, force[::every])
    assert np.array_equal(kept_slopes, slopes[::every])
    assert np.array_equal(element_force(*given, every=every), force[::every])


# --- The limits of the law ---


def smooth_motion(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A few sines of random phase and their speed, and the speed at the end of each step as the element takes it."""
    time, phases = np.arange(3000) * STEP, rng.uniform(0, 2 * np.pi, 2)
    tones = [(0.02, 2 * np.pi * 1.1, phases[0]), (0.004, 2 * np.pi * 4.3, phases[1])]
    x = np.sum([a * np.sin(w * time + p) for a, w, p in tones], axis=0)
    v = np.sum([a * w * np.cos(w * time + p) for a, w, p in tones], axis=0)
    return x, v, np.diff(x) / STEP + 0.5 * np.diff(v)


def test_a_rigid_damper_is_friction_and_a_viscous_force_of_the_rod(rng: np.random.Generator) -> None:
    for _ in range(3):
        x, v, speed = smooth_motion(rng)
        T0, C = rng.uniform(0, 1000), rng.uniform(0, 5000)
        force = element_force(x, STEP, T0, C, np.inf, 0.0, v)
        np.testing.assert_allclose(force[1:], T0 * np.sign(speed) + C * speed, rtol=1e-12, atol=1e-9)


def test_a_rigid_damper_holds_any_force_up_to_friction_at_rest() -> None:
    x = np.array([0.0, 0.0, 0.0, 0.002, 0.002, 0.002])
    for begun in (-300.0, -20.0, 0.0, 299.0):
        force = element_force(x, STEP, 300.0, 50.0, np.inf, begun)
        np.testing.assert_allclose(force, [begun, begun, begun, 400.0, 300.0, 300.0])


def test_a_rigid_damper_turns_with_the_rod_inside_a_step() -> None:
    """The speed goes from -0.6 to 0.4 m/s: at the end of the step the force is that of the way back."""
    x, v = np.array([0.0, -0.1 * STEP]), np.array([-0.6, 0.4])
    assert element_force(x, STEP, 300.0, 1000.0, np.inf, -900.0, v)[1] == pytest.approx(300.0 + 400.0, rel=1e-12)


def test_without_damping_the_element_is_elasto_plastic(rng: np.random.Generator) -> None:
    """F goes with k dx and is cut off at T0, sample by sample, between reversals."""
    x = np.cumsum(np.repeat(rng.choice([-1.0, 1.0], 30), 20)) * 1e-4
    force, expected = element_force(x, STEP, 300.0, 0.0, 2e5), [0.0]
    for dx in np.diff(x):
        expected.append(float(np.clip(expected[-1] + 2e5 * dx, -300.0, 300.0)))
    np.testing.assert_allclose(force, expected, atol=1e-9)


def test_rigid_and_without_damping_it_is_dry_friction(rng: np.random.Generator) -> None:
    x, v, speed = smooth_motion(rng)
    force = element_force(x, STEP, 250.0, 0.0, np.inf, 0.0, v)
    np.testing.assert_allclose(force[1:], 250.0 * np.sign(speed))


def test_a_stiff_damper_goes_to_the_rigid_one_linearly_in_the_compliance(rng: np.random.Generator) -> None:
    """But for the reversals, F(1/k) - F(0) is 1/k times the sensitivity of the rigid damper, -C^2 d2x/dt2."""
    x, v, speed = smooth_motion(rng)
    rigid, slopes = element_force_sensitivities(x, STEP, 300.0, 1500.0, np.inf, 0.0, v)
    np.testing.assert_allclose(slopes[1:, 2], -(1500.0**2) * np.diff(v) / STEP, rtol=1e-9, atol=1e-3)
    np.testing.assert_allclose(slopes[1:, 0], np.sign(speed))
    np.testing.assert_allclose(slopes[1:, 1], speed, rtol=1e-9, atol=1e-12)
    for k in (1e7, 1e8, 1e9):
        away = element_force(x, STEP, 300.0, 1500.0, k, 0.0, v) - rigid
        assert np.median(np.abs(away - slopes[:, 2] / k)) < 1e-3 * np.median(np.abs(away))


def test_a_damper_without_damping_is_the_limit_of_those_that_hardly_damp(rng: np.random.Generator) -> None:
    x, v, speed = smooth_motion(rng)
    limit, slopes = element_force_sensitivities(x, STEP, 300.0, 0.0, 2e5, 0.0, v)
    away = [np.max(np.abs(element_force(x, STEP, 300.0, C, 2e5, 0.0, v) - limit)) for C in (1.0, 0.1, 0.01)]
    np.testing.assert_allclose(np.array(away), away[0] * np.array([1.0, 0.1, 0.01]), rtol=0.05)
    flowing = np.abs(limit[1:]) == 300.0
    np.testing.assert_allclose(slopes[1:, 1][flowing], speed[flowing], rtol=1e-9)
    assert np.all(np.isfinite(slopes))


@pytest.mark.parametrize("stiffness", [1e3, 1e5, 1e8, 1e12, np.inf])
@pytest.mark.parametrize("damping", [0.0, 1e-3, 1.0, 1e4, 1e7])
@pytest.mark.parametrize("friction", [0.0, 1e-3, 300.0])
def test_force_and_sensitivities_are_finite_everywhere(
    rng: np.random.Generator, friction: float, damping: float, stiffness: float
) -> None:
    x = np.concatenate([np.zeros(5), multisine(rng, 300), np.full(5, 0.01)])
    for velocity in (None, np.gradient(x, STEP)):
        force, slopes = element_force_sensitivities(x, STEP, friction, damping, stiffness, 0.0, velocity)
        assert np.all(np.isfinite(force))
        assert np.all(np.isfinite(slopes))
