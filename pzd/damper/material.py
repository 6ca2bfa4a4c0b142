"""T0, C and k as they are now: interpolated between the damper's base rows, held beyond them.

Over temperature first, at each voltage, then over voltage; the effects of the material multiply.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from pzd.compiled import compiled
from pzd.damper.compiled.columns import DRIVE, NEUTRAL, acting, column
from pzd.damper.compiled.kernels import follow_voltage
from pzd.damper.compiled.laws import arguments, functions
from pzd.damper.confounders import module_of
from pzd.damper.model import BaseRow, Damper
from pzd.record import Array

# ----------------------------------------------------------------------------------------------------


_SAME_VOLTAGE = 0.02  # of the largest voltage; labels of one voltage at two temperatures differ a little


def base_voltages(damper: Damper) -> Array:
    """(m,) voltages of the base rows [V], rising; one zero where the damper has no voltage."""
    return np.array([voltage for voltage, _ in by_voltage(damper.base)])


def material(damper: Damper, voltage: Array | float | None, temperature: Array | float | None) -> Array:
    """T0 [N], C [N s/m] and k [N/m] at an effective voltage and a temperature.

    Parameters
    ----------
    damper : the damper
    voltage : (n,) or a number, effective voltage [V]; None where the damper has a single one
    temperature : (n,) or a number [degC]; None where the damper has a single one

    Returns
    -------
    (n, 3), n = 1 for numbers

    Raises
    ------
    ValueError : when the damper depends on a voltage or temperature that is not given
    """
    groups = by_voltage(damper.base)
    if voltage is None and len(groups) > 1:
        raise ValueError("the damper depends on the voltage, and none is given")
    at_nodes = np.stack([_over_temperature(rows, temperature) for _, rows in groups])
    nodes = np.array([node for node, _ in groups])
    values = _over_voltage(nodes, at_nodes, np.atleast_1d(0.0 if voltage is None else voltage))
    at = None if voltage is None else np.atleast_1d(voltage)
    given = {
        effect.name: {p.name: column(damper, effect.name, p.name, at) for p in effect.parameters}
        for effect in acting("material")
        if effect.name in damper.effects
    }
    return values * material_factors(given, temperature, damper.reference_temperature_degC)


def by_voltage(rows: Sequence[BaseRow]) -> list[tuple[float, list[BaseRow]]]:
    """The rows of each voltage at whatever temperature, lowest voltage [V] first; 0 where there is none."""
    scale = max(abs(row.voltage_V or 0.0) for row in rows)
    groups: list[tuple[float, list[BaseRow]]] = []
    for row in sorted(rows, key=lambda r: (r.voltage_V or 0.0, r.temperature_degC or 0.0)):
        voltage = row.voltage_V or 0.0
        if groups and voltage - groups[-1][0] <= _SAME_VOLTAGE * scale:
            groups[-1][1].append(row)
        else:
            groups.append((voltage, [row]))
    return groups


def with_rows(damper: Damper, rows: Sequence[BaseRow]) -> Damper:
    """The damper with some of its base rows alone, its effects at their voltages.

    Parameters
    ----------
    damper : whose effects may have parameters by voltage
    rows : one or more of its base rows
    """
    if len(rows) == len(damper.base):
        return damper
    kept = {voltage for voltage, of_it in by_voltage(damper.base) if any(row in rows for row in of_it)}
    effects = {name: _at(values, kept) for name, values in damper.effects.items()}
    return damper.model_copy(update={"base": tuple(rows), "effects": effects})


def _at(values: dict[str, float | tuple[float, ...]], voltages: set[float]) -> dict[str, float | tuple[float, ...]]:
    """The parameters of an effect without those at other voltages."""
    nodes = values.get("at_voltage_V")
    if not isinstance(nodes, tuple):
        return values
    kept = [i for i, node in enumerate(nodes) if node in voltages]
    return {n: tuple(v[i] for i in kept) if isinstance(v, tuple) else v for n, v in values.items()}


def _over_temperature(rows: Sequence[BaseRow], temperature: Array | float | None) -> Array:
    rows = sorted(rows, key=lambda row: row.temperature_degC or 0.0)
    if temperature is None and len(rows) > 1:
        raise ValueError("the damper depends on the temperature, and none is given")
    at = np.array([row.temperature_degC or 0.0 for row in rows])
    columns = np.array([(row.T0_N, row.C_Ns_per_m, row.k_N_per_m) for row in rows])
    wanted = np.atleast_1d(at[0] if temperature is None else temperature)
    return np.stack([np.interp(wanted, at, column) for column in columns.T], axis=-1)


def _over_voltage(nodes: Array, at_nodes: Array, voltage: Array) -> Array:
    """Piecewise linear over the first axis of (m, n or 1, 3), held beyond its ends."""
    if nodes.size == 1:
        return np.broadcast_to(at_nodes[0], (max(voltage.size, at_nodes.shape[1]), 3))
    if at_nodes.shape[1] == 1:
        return np.stack([np.interp(voltage, nodes, column) for column in at_nodes[:, 0].T], axis=-1)
    inside = np.clip(voltage, nodes[0], nodes[-1])
    left = np.clip(np.searchsorted(nodes, inside, side="right") - 1, 0, nodes.size - 2)
    share = ((inside - nodes[left]) / (nodes[left + 1] - nodes[left]))[:, None]
    columns = np.arange(at_nodes.shape[1])
    below, above = at_nodes[left, columns], at_nodes[left + 1, columns]
    return np.asarray(below + share * (above - below))


_FACTORS = {"friction_factor": 0, "damping_factor": 1, "stiffness_factor": 2}
"""Laws of the material by the column of T0, C and k that they multiply."""


def material_factors(
    effects: Mapping[str, Mapping[str, Array]], temperature: Array | float | None, reference: float | None
) -> Array:
    """(n, 3) or (1, 3) product of the factors of every material effect on T0, C and k.

    Parameters
    ----------
    effects : parameters by effect and name, (1,) or (n,) each; those of other places are not looked at
    temperature : (n,) or a number [degC]; None where the damper has a single one: then nothing acts
    reference : at which the factors are 1 [degC]
    """
    factors = np.ones((1, 3))
    for effect in acting("material"):
        if effect.name not in effects or temperature is None:
            continue
        given = {
            **effects[effect.name],
            "temperature": np.atleast_1d(np.asarray(temperature, dtype=np.float64)),
            "reference": np.array([reference or 0.0]),
        }
        for name, law in functions(effect, module_of(effect)).items():
            factor = np.atleast_1d(law(**{argument: given[argument] for argument in arguments(law)}))
            factors = np.repeat(factors, max(factor.size // len(factors), 1), axis=0)
            factors[:, _FACTORS[name]] *= factor
    return factors


# ----------------------------------------------------------------------------------------------------
# The voltage as the valve feels it: supply, valve and actuator, one behind the other.


def drive_row(effects: Mapping[str, Mapping[str, float]]) -> Array:
    """(d,) the row of the drive of some effects, the others switched off."""
    return np.array([effects.get(name, {}).get(parameter, NEUTRAL[name, parameter]) for name, parameter in DRIVE])


def effective_voltage(voltage: Array, steps: Array, row: Array) -> Array:
    """Voltage as the valve feels it, at rest with the first sample.

    Parameters
    ----------
    voltage : (n,) control signal, linear between samples [V]
    steps : (n - 1,) or (1,) sampling intervals [s]
    row : (d,) parameters of the drive effects, see `drive_row`

    Returns
    -------
    (n,) effective voltage [V]
    """
    effective = np.empty_like(voltage)
    _follow(voltage, steps, row, np.full(len(DRIVE), voltage[0]), effective)
    return effective


@compiled
def _follow(voltage: Array, steps: Array, row: Array, state: Array, effective: Array) -> None:
    effective[0] = voltage[0]
    for i in range(1, voltage.size):
        effective[i] = follow_voltage(voltage[i - 1], voltage[i], steps[min(i - 1, steps.size - 1)], state, row)
