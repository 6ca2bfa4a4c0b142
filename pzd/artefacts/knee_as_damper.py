"""The damper of one setting that has the knee law, from the rows that identify found."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pzd.artefacts.knee import KneeRow
from pzd.damper.fitted_laws.knee import NO_KNEE
from pzd.damper.model import BaseRow, Damper


def knee_damper(rows: Sequence[KneeRow]) -> Damper:
    """The damper of one setting with the knee law: a base row a condition, the knee and the gas as effects beside it.

    Gas force and gas spring are left out where the interval of every condition holds zero. Effects know no temperature:
    where a voltage was tested at several, theirs are the mean; T0, C and k are of each.

    Parameters
    ----------
    rows : of one setting, at least one
    """
    zero = float(np.mean([row.zero_m for row in rows]))
    voltages = sorted({row.voltage_V for row in rows}, key=lambda v: -np.inf if v is None else v)
    parts = [[row for row in rows if row.voltage_V == voltage] for voltage in voltages]
    effects = {
        "knee": [_mean([_knee(row) for row in part]) for part in parts],
        "preload_offset": [_mean([{"F_0": _gas_force(row, zero)} for row in part]) for part in parts],
        "gas_spring": [_mean([{"k_g": row.gas_spring_N_per_m} for row in part]) for part in parts],
    }
    shown = {
        "knee": True,
        "preload_offset": any(row.gas_force_N_low95 * row.gas_force_N_high95 > 0.0 for row in rows),
        "gas_spring": any(row.gas_spring_N_per_m_low95 * row.gas_spring_N_per_m_high95 > 0.0 for row in rows),
    }
    given = [voltage for voltage in voltages if voltage is not None]
    return Damper(
        base=tuple(
            BaseRow(
                voltage_V=row.voltage_V,
                temperature_degC=row.temperature_degC,
                T0_N=row.friction_N,
                C_Ns_per_m=0.5 * (row.rebound_bleed_Ns_per_m + row.compression_bleed_Ns_per_m),
                k_N_per_m=row.k_N_per_m,
            )
            for row in rows
        ),
        effects={name: _by_voltage(values, given) for name, values in effects.items() if shown[name]},
        zero_m=zero,
    )


def _knee(row: KneeRow) -> dict[str, float]:
    """The parameters of the law `knee`; a direction without one goes on with its bleed."""
    rebound, compression = row.rebound_bleed_Ns_per_m, row.compression_bleed_Ns_per_m
    return {
        "beta": (rebound - compression) / (rebound + compression),
        "F_reb": NO_KNEE if row.rebound_knee_force_N is None else row.rebound_knee_force_N,
        "C_reb": rebound if row.rebound_blow_off_Ns_per_m is None else row.rebound_blow_off_Ns_per_m,
        "F_comp": NO_KNEE if row.compression_knee_force_N is None else row.compression_knee_force_N,
        "C_comp": compression if row.compression_blow_off_Ns_per_m is None else row.compression_blow_off_Ns_per_m,
    }


def _gas_force(row: KneeRow, zero: float) -> float:
    """F_0 at another zero of the displacement [N]."""
    return row.gas_force_N + row.gas_spring_N_per_m * (zero - row.zero_m)


def _mean(values: Sequence[dict[str, float]]) -> dict[str, float]:
    return {name: float(np.mean([each[name] for each in values])) for name in values[0]}


def _by_voltage(values: Sequence[dict[str, float]], voltages: Sequence[float]) -> dict[str, float | tuple[float, ...]]:
    """One number each, or lists beside `at_voltage_V` where there are several voltages."""
    if len(values) == 1:
        return dict(values[0])
    lists = {name: tuple(each[name] for each in values) for name in values[0]}
    return {**lists, "at_voltage_V": tuple(voltages)}
