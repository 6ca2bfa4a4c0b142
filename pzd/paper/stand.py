"""The `rig.virtual` entries of configs/paper.yaml as text, from the calibrated valve."""

from __future__ import annotations

from collections.abc import Iterator

from pzd.damper.model import BaseRow, Damper
from pzd.paper.published import LARGE_GAP, SMALL_GAP
from pzd.paper.valve import Valve, stand_damper


def rounded(damper: Damper) -> Damper:
    """The damper in the digits that a config is written with: 0.1 N, 1 N s/m, 0.001."""
    rows = tuple(
        row.model_copy(update={"T0_N": round(row.T0_N, 1), "C_Ns_per_m": round(row.C_Ns_per_m)}) for row in damper.base
    )
    thinning = damper.effects["shear_thinning"]
    indices = [round(n, 3) for n in _listed(thinning["n"])]
    return Damper(base=rows, effects={"shear_thinning": {**thinning, "n": tuple(indices)}})


def written(valve: Valve) -> str:
    """The damper of both settings as YAML, in the digits of the config."""
    return "\n".join(line for setting in (SMALL_GAP, LARGE_GAP) for line in _entry(setting, valve))


def _entry(setting: str, valve: Valve) -> Iterator[str]:
    damper = rounded(stand_damper(valve, setting))
    yield f"    - setting: {setting}"
    yield "      damper:"
    yield "        base:"
    yield from (_row(row) for row in damper.base)
    thinning = damper.effects["shear_thinning"]
    n, at = (", ".join(f"{value:g}" for value in _listed(thinning[key])) for key in ("n", "at_voltage_V"))
    yield "        effects:"
    yield f"          shear_thinning: {{n: [{n}], at_voltage_V: [{at}]}}"


def _row(row: BaseRow) -> str:
    fields = ", ".join(f"{name}: {value:.7g}" for name, value in row.model_dump().items())
    return f"          - {{{fields}}}"


def _listed(value: float | tuple[float, ...]) -> tuple[float, ...]:
    return value if isinstance(value, tuple) else (value,)
