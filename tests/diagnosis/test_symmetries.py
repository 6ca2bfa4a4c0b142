"""A rig mirrored, scaled in force or started at another time is the same rig: its verdict and parameters follow."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest
from campaign import damper_of, sines
from test_naming import TRUTHS, TWO
from whole_diagnosis import diagnosed

from pzd.artefacts import Diagnosed, ParameterRow
from pzd.damper.effects import library
from pzd.record import Record

SIDED = {"alpha", "F_0"}
"""Parameters that say in which direction: they change their sign with it."""
OF_INTERVAL = 0.05
"""Share of its 95 % interval by which the search may end beside the same optimum."""
MOVES: dict[str, tuple[Callable[[Record], Record], Callable[[str, str], float], float]] = {
    "mirrored": (
        lambda r: replace(
            r, displacement=-r.displacement, velocity=-r.velocity, acceleration=-r.acceleration, force=-r.force
        ),
        lambda name, unit: -1.0 if name in SIDED else 1.0,
        1.0,
    ),
    "3.7 times as strong": (
        lambda r: replace(r, force=3.7 * r.force),
        lambda name, unit: 3.7 if unit.startswith(("N", "kg")) else 1.0,
        3.7,
    ),
    "a fifth as strong": (
        lambda r: replace(r, force=0.2 * r.force),
        lambda name, unit: 0.2 if unit.startswith(("N", "kg")) else 1.0,
        0.2,
    ),
    "an hour later": (lambda r: replace(r, time=r.time + 3600.0), lambda name, unit: 1.0, 1.0),
}
"""How the rig is changed; by what a parameter of that name and unit is multiplied then; and by what T0, C and k."""


def follows(moved: Diagnosed, found: Diagnosed, factor: Callable[[str, str], float], force: float) -> None:
    here, there = found.diagnosis, moved.diagnosis
    assert (there.verdict, there.effects, there.rivals) == (here.verdict, here.effects, here.rivals)
    for effect, values in here.parameters.items():
        for parameter in library()[effect].parameters:
            name, value, other = parameter.name, values[parameter.name], there.parameters[effect][parameter.name]
            times = factor(name, parameter.unit)
            near(other.value, times * np.array(value.value), abs(times) * wide(value.high95, value.low95))
    for row, other in zip(found.parameters, moved.parameters, strict=True):
        same_row(other, row, force)


def same_row(other: ParameterRow, row: ParameterRow, force: float) -> None:
    for column in ("T0_N", "C_Ns_per_m", "k_N_per_m"):
        value, low, high = (getattr(row, column + end) for end in ("", "_low95", "_high95"))
        if low is None:  # the tests do not show it, such as C behind an open relief valve
            assert (getattr(other, column), getattr(other, f"{column}_low95")) == (value, None) == (None, None)
            continue
        near(getattr(other, column), force * value, force * (high - low))
    assert other.status == row.status


def wide(high: float | Sequence[float] | None, low: float | Sequence[float] | None) -> np.ndarray:
    return np.array(high, dtype=np.float64) - np.array(low, dtype=np.float64)


def near(value: object, expected: object, width: object) -> None:
    beside = np.abs(np.array(value, dtype=np.float64) - np.array(expected, dtype=np.float64))
    assert np.all(beside <= OF_INTERVAL * np.array(width)), (value, expected, width)


@pytest.fixture(scope="module")
def sided(generator_for: Callable[[str], np.random.Generator]) -> tuple[tuple[Record, ...], Diagnosed]:
    """A small rig whose damper is softer in one direction, and what is said of it."""
    damper, tests = damper_of((0.0,), asymmetry=TRUTHS["asymmetry"]), ((1.0, 0.02), (2.0, 0.03), (2.0, 0.02))
    records = sines(damper, generator_for("sided"), (0.0,), tests=tests, cycles=5)
    return records, diagnosed(records)


@pytest.mark.parametrize(
    "move", ["mirrored", "3.7 times as strong", *(pytest.param(name, marks=pytest.mark.ci) for name in [*MOVES][2:])]
)
def test_a_sided_effect_changes_sides_with_the_rig_and_nothing_else(
    sided: tuple[tuple[Record, ...], Diagnosed], move: str
) -> None:
    records, found = sided
    change, factor, force = MOVES[move]
    assert found.diagnosis.effects == ("asymmetry",)
    follows(diagnosed(tuple(map(change, records))), found, factor, force)


@pytest.mark.ci
@pytest.mark.parametrize("effect", [None, *TRUTHS])
def test_every_verdict_follows_its_rig(rng: np.random.Generator, effect: str | None) -> None:
    hidden = {} if effect is None else {effect: TRUTHS[effect]}
    records = sines(damper_of(TWO, **hidden), rng, TWO, jitter=0.01)
    found = diagnosed(records)
    for change, factor, force in MOVES.values():
        follows(diagnosed(tuple(map(change, records))), found, factor, force)
