"""The `rig.virtual` entries of configs/paper.yaml as text, from the calibrated valve."""

from __future__ import annotations

from collections.abc import Iterator

from pzd.damper.model import BaseRow, Damper
from pzd.damper.values import value_of
from pzd.paper.published import LARGE_GAP, SMALL_GAP
from pzd.paper.valve import Valve, stand_damper


def rounded(damper: Damper) -> Damper:
    """The damper in the digits that a config is written with: 0.1 N, 1 N s/m, 0.001."""
    rows = tuple(
        row.model_copy(update={"T0_N": round(row.T0_N, 1), "C_Ns_per_m": round(row.C_Ns_per_m)}) for row in damper.base
    )
    return Damper(base=rows).with_effect("shear_thinning", {"n": round(_index(damper), 3)})


def written(valve: Valve) -> str:
    """The damper of both settings as YAML, in the digits of the config."""
    return "\n".join(line for setting in (SMALL_GAP, LARGE_GAP) for line in _entry(setting, valve))


def _entry(setting: str, valve: Valve) -> Iterator[str]:
    damper = rounded(stand_damper(valve, setting))
    yield f"    - setting: {setting}"
    yield "      damper:"
    yield "        base:"
    yield from (_row(row) for row in damper.base)
    yield "        effects:"
    yield f"          shear_thinning: {{n: {_index(damper):g}}}"


def _row(row: BaseRow) -> str:
    fields = ", ".join(f"{name}: {value:.7g}" for name, value in row.model_dump().items())
    return f"          - {{{fields}}}"


def _index(damper: Damper) -> float:
    return value_of(damper, "shear_thinning", "n")
