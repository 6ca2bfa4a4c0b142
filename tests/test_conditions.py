"""Grouping into conditions: a level carries no digits of noise, and no two conditions have the same level."""

from __future__ import annotations

import numpy as np
import pytest

from pzd.record import Array, Record, conditions

TIME = np.arange(2000) * 1e-3


def record(name: str, voltage: Array, temperature: Array | None = None) -> Record:
    x = 0.01 * np.sin(2.0 * np.pi * TIME)
    return Record(name, None, TIME, x, x, x, x, voltage, temperature)


@pytest.mark.parametrize("unit", [1.0, 1e3])
def test_noise_gives_a_level_no_digits(unit: float, rng: np.random.Generator) -> None:
    levels = (0.0, 0.75, 2.25)
    noisy = [record(f"{u}", unit * (u + 0.003 * rng.standard_normal(TIME.size))) for u in levels]
    found, _ = conditions(noisy)
    assert [each.voltage for each in found] == [unit * u for u in levels]


def test_a_level_without_noise_keeps_its_digits() -> None:
    found, _ = conditions([record(f"{u}", np.full(TIME.size, u)) for u in (0.123456789, 1.5)])
    assert [each.voltage for each in found] == [0.123456789, 1.5]


def test_two_conditions_never_have_the_same_level() -> None:
    """Of two that warm by 8 degC the medians lie 0.04 degC apart when all samples are pooled."""
    still, way = np.full(TIME.size, 75.0), np.linspace(-4.0, 4.0, TIME.size)
    warming = [record("a", still, 24.98 + way), record("b", still, 25.02 + way)]
    found, _ = conditions(warming, temperature_within=0.01)
    assert len({each.temperature for each in found}) == 2


def test_records_are_split_at_the_widest_gap(rng: np.random.Generator) -> None:
    """Two tests at each of three voltages, each pair warmer than the last: no pair is parted."""
    levels = [(0.0, 25.88), (0.0, 25.9), (75.0, 27.7), (75.0, 27.88), (150.0, 29.94), (150.0, 30.6)]
    records = [record(f"{u}-{T}", np.full(TIME.size, u), np.full(TIME.size, T)) for u, T in levels]
    for order in (records, [records[i] for i in rng.permutation(len(records))]):
        found, _ = conditions(order)
        assert [(each.voltage, len(each.records)) for each in found] == [(0.0, 2), (75.0, 2), (150.0, 2)]


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_evenly_spaced_temperatures_are_split_alike_from_either_end(sign: float) -> None:
    still = np.full(TIME.size, 75.0)
    found, _ = conditions([record(f"{T}", still, np.full(TIME.size, sign * T)) for T in (20.0, 21.0, 22.0, 23.0)])
    assert [len(each.records) for each in found] == [2, 2]


@pytest.mark.parametrize("kind", ["mains", "chopped", "noise"])
def test_a_current_that_ripples_about_a_level_is_constant_and_has_that_level(
    kind: str, rng: np.random.Generator
) -> None:
    """A driver chops its current: the median of two values is one of them, and by chance which."""
    ripple = {
        "mains": 0.06 * np.sin(2.0 * np.pi * 60.0 * TIME),
        "chopped": np.where((TIME * 90.0) % 1.0 < 0.5, 0.06, -0.06),
        "noise": 0.05 * rng.standard_normal(TIME.size),
    }[kind]
    records = [record(f"{u}{side}", u * (1.0 + side * ripple)) for u in (0.5, 1.0) for side in (1.0, -1.0)]
    found, moving = conditions([record("0", np.zeros(TIME.size)), *records])
    assert [each.voltage for each in found] == pytest.approx([0.0, 0.5, 1.0], rel=5e-3)
    assert moving == ()


@pytest.mark.parametrize(
    "course",
    [1.0 + 0.05 * np.sin(2.0 * np.pi * TIME), np.linspace(0.95, 1.05, TIME.size), np.where(TIME < 1.0, 0.9, 1)],
)
def test_a_current_that_swings_no_faster_than_a_damper_moves_is_not_constant(course: Array) -> None:
    assert conditions([record("a", course)])[1]
