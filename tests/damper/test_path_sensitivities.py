"""Derivatives along the path: against differences of an exact path, the scaling law, and finer sampling."""

from __future__ import annotations

import numpy as np
import pytest
from test_path import FLOWS

from pzd.damper.compiled.columns import STROKE_AND_FLOW
from pzd.damper.compose import integrated_sensitivities
from pzd.damper.effect import ELEMENT
from pzd.damper.element import element_force_sensitivities
from pzd.damper.motion import Motion
from pzd.damper.parameter_rows import constant_rows
from pzd.damper.path import Variables, march, march_sensitivities
from pzd.diagnosis.fit.likelihood import SIMULATION_TOLERANCE
from pzd.record import Array

STEP = 1e-3
TIME = np.arange(3000) * STEP
BASE = (300.0, 2700.0, 2e5)
CONSTANT = [effects for effects in FLOWS if all("at_voltage_V" not in values for values in effects.values())]
SMALL = 1e-4
T0_C_AND_COMPLIANCE = Variables(np.arange(3), np.eye(3)[np.newaxis], np.zeros(3))


def motion(step: float = STEP) -> tuple[Array, Array]:
    """Displacement [m] and speed [m/s] of three tones that do not repeat."""
    t = np.arange(round(3.0 / step)) * step
    tones = ((0.02, 1.1, 0.3), (0.003, 5.7, 1.0), (0.001, 12.3, 2.0))
    x = np.sum([a * np.sin(2 * np.pi * f * t + p) for a, f, p in tones], axis=0)
    v = np.sum([2 * np.pi * f * a * np.cos(2 * np.pi * f * t + p) for a, f, p in tones], axis=0)
    return x, v


def rows_of(effects: dict, moving: bool) -> Array:
    """(1, r) the row of a damper, or (n, r) rows of one whose T0 quadruples and k doubles to and fro."""
    row, _ = constant_rows(*BASE, effects)
    other, _ = constant_rows(4.0 * BASE[0], 0.9 * BASE[1], 2.0 * BASE[2], effects)
    if not moving:
        return row
    rows, share = np.repeat(row, TIME.size, axis=0), 0.5 + 0.5 * np.sin(2 * np.pi * 1.3 * TIME)
    rows[:, :3] += share[:, None] * (other[:, :3] - row[:, :3])
    return rows


def columns_of(effects: dict) -> list[int]:
    """The places of T0, C, k and of the parameters of some effects."""
    own = [STROKE_AND_FLOW.index((name, key)) for name, values in effects.items() for key in values]
    return [0, 1, 2, *(len(ELEMENT) + place for place in own)]


def relative(rows: Array, columns: list[int]) -> Array:
    """(n, c) derivatives of columns by the logarithm of each; for k, of 1/k by the logarithm of k."""
    along = rows[:, columns].copy()
    along[:, columns.index(2)] = -1.0 / along[:, columns.index(2)]
    return along


def scaled(rows: Array, column: int, by: float) -> Array:
    """The rows with one column in another proportion."""
    changed = rows.copy()
    changed[:, column] *= by
    return changed


@pytest.mark.parametrize("moving", [False, True], ids=["constant", "moving"])
@pytest.mark.parametrize("effects", [{}, *CONSTANT], ids=lambda e: "+".join(e) or "plain")
def test_sensitivities_are_the_differences_of_an_exact_path(effects: dict, moving: bool) -> None:
    rows, columns, (x, v), steps = rows_of(effects, moving), columns_of(effects), motion(), np.array([STEP])
    along = np.stack([relative(rows, columns) * (np.arange(len(columns)) == j) for j in range(len(columns))], axis=1)
    variables = Variables(np.array(columns), along, np.zeros(len(columns)))
    force, found = march_sensitivities(x, v, steps, rows, 50.0, SIMULATION_TOLERANCE, variables)
    np.testing.assert_array_equal(force, march(x, v, steps, rows, 50.0, SIMULATION_TOLERANCE))
    for j, column in enumerate(columns):
        more, less = (march(x, v, steps, scaled(rows, column, 1.0 + by), 50.0, 1e-11) for by in (SMALL, -SMALL))
        exact = (more - less) / (2.0 * SMALL)
        assert np.linalg.norm(found[:, j] - exact) < 0.02 * np.linalg.norm(exact), column


@pytest.mark.parametrize("effects", [{}, {"orifice_quadratic": {"q": 3000.0}}, {"asymmetry": {"alpha": 0.2}}], ids=str)
def test_a_damper_of_twice_all_forces_gives_twice_the_force(effects: dict) -> None:
    """Euler's theorem: F is homogeneous of degree one in T0, C, k and q."""
    rows, (x, v) = rows_of(effects, False), motion()
    columns = [0, 1, 2, *(c for c in columns_of(effects)[3:] if "orifice_quadratic" in effects)]
    along = relative(rows, columns)[:, np.newaxis]
    force, slopes = march_sensitivities(
        x, v, np.array([STEP]), rows, 0.0, 1e-9, Variables(np.array(columns), along, np.zeros(1))
    )
    assert np.max(np.abs(slopes[:, 0] - force)) < 1e-3 * np.max(np.abs(force))


def test_sensitivities_of_the_element_without_effects_are_those_of_the_closed_form_to_order_two() -> None:
    rows, errors = rows_of({}, False), []
    for parts in (1, 2, 4):
        step, (x, v) = STEP / parts, motion(STEP / parts)
        _, found = march_sensitivities(x, v, np.array([step]), rows, 0.0, 1e-9, T0_C_AND_COMPLIANCE)
        _, exact = element_force_sensitivities(x, step, *BASE, 0.0, v)
        errors.append(np.linalg.norm(found - exact, axis=0) / np.linalg.norm(exact, axis=0))
    assert np.all(errors[0] < 2e-4)
    assert np.all(errors[0][1:] > 3.5 * errors[1][1:])
    assert np.all(errors[1][1:] > 3.5 * errors[2][1:])


def test_while_the_element_sticks_the_force_depends_on_k_alone() -> None:
    """While the oil sticks dF/d(1/k) is -k^2 times the way that the rod has gone, and T0 and C change nothing."""
    x = 1e-4 * np.sin(2 * np.pi * TIME)  # 20 N of 300
    v = 2e-4 * np.pi * np.cos(2 * np.pi * TIME)
    _, slopes = march_sensitivities(x, v, np.array([STEP]), rows_of({}, False), 0.0, 1e-9, T0_C_AND_COMPLIANCE)
    np.testing.assert_array_equal(slopes[:, :2], 0.0)
    np.testing.assert_allclose(slopes[:, 2], -(BASE[2] ** 2) * (x - x[0]), rtol=1e-6, atol=1e-2)


@pytest.mark.parametrize("effects", [{}, {"orifice_quadratic": {"q": 3000.0}}, {"asymmetry": {"alpha": 0.2}}], ids=str)
def test_the_initial_force_affects_the_force_until_the_element_has_slipped(effects: dict) -> None:
    """By the closed form where it holds, by the march elsewhere: both go with what the variables make of that force."""
    t = np.arange(300) * STEP
    x, v = 2e-3 * np.sin(2 * np.pi * 2 * t), 8e-3 * np.pi * np.cos(2 * np.pi * 2 * t)
    motion, rows, initial = Motion(t, x, v, np.zeros_like(t)), rows_of(effects, False), np.array([0.0, -7.0])
    along = np.array([[[1.0, 0.0], [0.0, 2.0]]])
    held, moved = (
        integrated_sensitivities(
            rows, Variables(np.array([0, 1]), along, slopes), motion, np.array([STEP]), 50.0, 1e-9
        )[1]
        for slopes in (np.zeros(2), initial)
    )
    more, less = (march(x, v, np.array([STEP]), rows, 50.0 + by, 1e-12) for by in (0.05, -0.05))
    by_force = (more - less) / 0.1
    np.testing.assert_allclose((moved - held)[:, 1], -7.0 * by_force, atol=2e-3)
    np.testing.assert_allclose(moved[:, 0], held[:, 0], atol=1e-12)
    assert by_force[10] == pytest.approx(1.0, abs=1e-6)
    assert by_force[-1] < 0.01
