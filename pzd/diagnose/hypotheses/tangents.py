"""What T0, C, k and the parameters of adopted effects could take up of a residual, to first order."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from pzd.damper.competing_forms import known
from pzd.damper.model import BaseRow, Damper
from pzd.diagnose.data.cleaning import Prepared
from pzd.diagnose.fit.prediction import predicted_force
from pzd.diagnose.search.evidence import nearest_row
from pzd.record import Array

STEP = 0.01
"""Relative step of a difference: large against the tolerance of the path, small against what bends the force."""
LEAST_FRICTION = 0.01
"""T0 moves by this share of the largest T0 at least, where it is next to nothing."""

Key = tuple[str, str, int]
"""Effect (or `base`), parameter, and base row, -1 where one value serves all."""


@dataclass(frozen=True)
class _Moved:
    """A damper with one parameter moved."""

    key: Key
    damper: Damper
    step: float
    """By how much, as a share of the parameter's own size."""


def tangents(damper: Damper, prepared: Prepared, force: Array) -> dict[Key, Array]:
    """(n,) change of the force [N] for a relative change by one of each parameter that a test depends on.

    Parameters
    ----------
    damper : that is handed on, about the middle of the stroke
    prepared : the test
    force : (n,) that the damper gives in it [N]
    """
    rows: Sequence[int] = [nearest_row(damper.base, prepared)] if prepared.constant else range(len(damper.base))
    found = {}
    for moved in (*_base_moved(damper, rows), *_effects_moved(damper, rows)):
        found[moved.key] = (predicted_force(moved.damper, prepared) - force) / moved.step
    return found


def _base_moved(damper: Damper, rows: Sequence[int]) -> Iterator[_Moved]:
    least = LEAST_FRICTION * max(row.T0_N for row in damper.base)
    for i in rows:
        row = damper.base[i]
        moved = {
            "T0_N": row.T0_N + STEP * max(row.T0_N, least, 1.0),
            "C_Ns_per_m": row.C_Ns_per_m * (1.0 + STEP),
            "k_N_per_m": row.k_N_per_m * (1.0 + STEP),
        }
        for name, value in moved.items():
            base: list[BaseRow] = list(damper.base)
            base[i] = row.model_copy(update={name: value})
            yield _Moved(("base", name, i), damper.model_copy(update={"base": tuple(base)}), STEP)


def _effects_moved(damper: Damper, rows: Sequence[int]) -> Iterator[_Moved]:
    for effect, values in damper.effects.items():
        for parameter in known()[effect].parameters:
            value = values[parameter.name]
            place = -1 if isinstance(value, float) else rows[0] if len(rows) == 1 else len(damper.base)
            moved = tuple((1.0 + STEP) * each for each in value) if isinstance(value, tuple) else (1.0 + STEP) * value
            changed = {**damper.effects, effect: {**values, parameter.name: moved}}
            yield _Moved((effect, parameter.name, place), damper.model_copy(update={"effects": changed}), STEP)
