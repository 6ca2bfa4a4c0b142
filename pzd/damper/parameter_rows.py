"""Parameters of a damper at a voltage and a temperature, as the rows of numbers that compiled loops read.

Order: T0, C and k from the damper's base rows, over temperature first and then over voltage, times the effects of the
material; the effective voltage behind the effects of the drive; rows of the element, of the parallel forces and of the
drive; rows at any voltage, linear between the nodes of a damper. Beyond the outermost values all are constant.
"""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pzd.compiled import compiled
from pzd.damper.compiled.columns import (
    BESIDE,
    DRIVE,
    NEUTRAL,
    PARALLEL,
    STROKE_AND_FLOW,
    Column,
    acting,
    column,
    columns_of,
    value_of,
)
from pzd.damper.compiled.kernels import T0, C, K, Row, follow_voltage, interpolate, row_of
from pzd.damper.confounders import module_of
from pzd.damper.effect import NODE_VOLTAGES, EffectValues, arguments, functions
from pzd.damper.element import STIFFEST
from pzd.damper.model import BaseRow, Damper
from pzd.record import CONSTANT_SHARE, Array

MATERIAL_FACTORS = {"friction_factor": T0, "damping_factor": C, "stiffness_factor": K}
"""Laws of the material by the column of T0, C and k that they multiply."""

# --- T0, C and k over voltage and temperature ---


def bingham_parameters(damper: Damper, voltage: Array | float | None, temperature: Array | float | None) -> Array:
    """Compute T0 [N], C [N s/m] and k [N/m] at an effective voltage and a temperature.

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

    Examples
    --------
    >>> from pzd.damper.model import BaseRow, Damper
    >>> rows = (BaseRow(voltage_V=u, T0_N=300.0 + u, C_Ns_per_m=2700.0, k_N_per_m=2e5) for u in (0.0, 100.0))
    >>> bingham_parameters(Damper(base=tuple(rows)), 50.0, None).tolist()
    [[350.0, 2700.0, 200000.0]]
    """
    groups = rows_per_voltage(damper.base)
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


def rows_per_voltage(rows: Sequence[BaseRow]) -> list[tuple[float, list[BaseRow]]]:
    """Group base rows by voltage, lowest voltage [V] first; 0 where there is none.

    Labels of one level scatter by as much as a constant voltage may: those at two temperatures differ a little.
    """
    scale = max(abs(row.voltage_V or 0.0) for row in rows)
    groups: list[tuple[float, list[BaseRow]]] = []
    for row in sorted(rows, key=lambda r: (r.voltage_V or 0.0, r.temperature_degC or 0.0)):
        voltage = row.voltage_V or 0.0
        if groups and voltage - groups[-1][0] <= CONSTANT_SHARE * scale:
            groups[-1][1].append(row)
        else:
            groups.append((voltage, [row]))
    return groups


def nearest_condition(rows: Sequence[BaseRow], voltage: float | None, temperature: float | None) -> int:
    """Return the index of the base row nearest in voltage [V], and of that voltage nearest in temperature [degC]."""
    _, nearest = min(rows_per_voltage(rows), key=lambda group: abs(group[0] - (voltage or 0.0)))
    row = min(nearest, key=lambda r: abs((r.temperature_degC or 0.0) - (temperature or 0.0)))
    return next(i for i, each in enumerate(rows) if each is row)


def base_voltages(damper: Damper) -> Array:
    """Return the (m,) voltages of the base rows [V], rising; one zero where the damper has no voltage."""
    return np.array([voltage for voltage, _ in rows_per_voltage(damper.base)])


def with_rows(damper: Damper, rows: Sequence[BaseRow]) -> Damper:
    """Return the damper with some of its base rows alone, its effects at their voltages.

    Parameters
    ----------
    damper : whose effects may have one parameter value per voltage
    rows : one or more of its base rows
    """
    if len(rows) == len(damper.base):
        return damper
    kept = {voltage for voltage, group in rows_per_voltage(damper.base) if any(row in rows for row in group)}
    effects = {name: _at_voltages(values, kept) for name, values in damper.effects.items()}
    return damper.model_copy(update={"base": tuple(rows), "effects": effects})


def _at_voltages(
    values: dict[str, float | tuple[float, ...]], voltages: set[float]
) -> dict[str, float | tuple[float, ...]]:
    """Return the parameters of an effect without those at other voltages."""
    nodes = values.get(NODE_VOLTAGES)
    if not isinstance(nodes, tuple):
        return values
    kept = [i for i, node in enumerate(nodes) if node in voltages]
    return {n: tuple(v[i] for i in kept) if isinstance(v, tuple) else v for n, v in values.items()}


def _over_temperature(rows: Sequence[BaseRow], temperature: Array | float | None) -> Array:
    """Interpolate the base rows of one voltage over temperature: (n, 3) or (1, 3)."""
    rows = sorted(rows, key=lambda row: row.temperature_degC or 0.0)
    if temperature is None and len(rows) > 1:
        raise ValueError("the damper depends on the temperature, and none is given")
    nodes = np.array([row.temperature_degC or 0.0 for row in rows])
    columns = np.array([(row.T0_N, row.C_Ns_per_m, row.k_N_per_m) for row in rows])
    if len(rows) > 1:
        columns = np.minimum(columns, (np.inf, np.inf, STIFFEST))
    wanted = np.atleast_1d(nodes[0] if temperature is None else temperature)
    return np.stack([np.interp(wanted, nodes, column) for column in columns.T], axis=-1)


def _over_voltage(nodes: Array, at_nodes: Array, voltage: Array) -> Array:
    """Interpolate over the first axis of (m, n or 1, 3) values at (m,) nodes."""
    if nodes.size > 1:
        at_nodes = np.minimum(at_nodes, (np.inf, np.inf, STIFFEST))  # between two infinite ones nothing is linear
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


def material_factors(
    effects: Mapping[str, Mapping[str, Array]], temperature: Array | float | None, reference: float | None
) -> Array:
    """Compute the (n, 3) or (1, 3) product of the factors of every material effect on T0, C and k.

    Parameters
    ----------
    effects : parameters by effect and name, (1,) or (n,) each; effects of other places are ignored
    temperature : (n,) or a number [degC]; None where the damper has a single one: all factors are 1
    reference : temperature at which the factors are 1 [degC]
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
            factors[:, MATERIAL_FACTORS[name]] *= factor
    return factors


# --- Effective voltage: supply, valve and actuator, one behind the other ---


def drive_row(effects: Mapping[str, Mapping[str, float]]) -> Array:
    """Return the (d,) row of the drive for some effects, the others switched off."""
    return np.array(_values(DRIVE, effects))


def drive_row_of(damper: Damper) -> Array:
    """Return the (d,) row of a damper's drive.

    Raises
    ------
    ValueError : when a parameter of the drive has one value per voltage
    """
    return np.array([value_of(damper, *column) for column in DRIVE])


def effective_voltage(voltage: Array, steps: Array, row: Array) -> Array:
    """Compute the voltage behind the effects of the drive, which is at rest at the first sample.

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
    """Fill the (n,) effective voltage; `state` is what each effect gave last."""
    effective[0] = voltage[0]
    for i in range(1, voltage.size):
        effective[i] = follow_voltage(voltage[i - 1], voltage[i], steps[min(i - 1, steps.size - 1)], state, row)


# --- Rows of a damper ---


def element_rows(damper: Damper, effective: Array | None, temperature: Array | float | None) -> Array:
    """Return the (n, r) rows of the element with its stroke and flow effects, (1, r) where they are constant."""
    base = bingham_parameters(damper, effective, temperature)
    extra = columns_of(damper, STROKE_AND_FLOW, effective)
    rows = np.hstack([np.broadcast_to(part, (max(len(base), len(extra)), part.shape[1])) for part in (base, extra)])
    return rows[:1] if np.all(rows == rows[0]) else rows


def parallel_rows(damper: Damper, effective: Array | None) -> Array | None:
    """Return the (n, m) or (1, m) rows of the parallel effects; None without any."""
    return columns_of(damper, PARALLEL, effective) if acts_beside(damper.effects) else None


def acts_beside(effects: Container[str]) -> bool:
    """Whether one of some effects is a force beside the element, by their names."""
    return any(name in effects for name, _ in BESIDE)


def constant_rows(
    friction: float, damping: float, stiffness: float, effects: Mapping[str, Mapping[str, float]]
) -> tuple[Array, Array | None]:
    """Return the (1, r) and (1, m) rows of the element and the parallel effects at constant voltage and temperature."""
    row = np.array([[friction, damping, stiffness, *_values(STROKE_AND_FLOW, effects)]])
    return row, np.array([_values(PARALLEL, effects)]) if acts_beside(effects) else None


def _values(columns: Sequence[Column], effects: Mapping[str, Mapping[str, float]]) -> list[float]:
    """Return the values of columns, neutral where the effect is missing."""
    return [effects.get(name, {}).get(parameter, NEUTRAL[name, parameter]) for name, parameter in columns]


# --- Rows at any voltage, linear between the nodes of a damper ---


NodeValue = float | tuple[float, ...] | Array
"""One value at every voltage, or one for each node."""


@dataclass(frozen=True, eq=False)
class DamperNodes:
    """A damper at one temperature: all its rows at the voltages between which they are linear."""

    voltages: Array
    """(m,) rising nodes [V]."""
    rows: Array
    """(m, r) parameter rows of the element."""
    parallel: Array
    """(m, b) rows of the parallel effects, columns as `columns.PARALLEL`."""
    drive: Array
    """(d,) row of the drive, columns as `columns.DRIVE`."""


def nodes_of(damper: Damper, temperature: float | None) -> DamperNodes:
    """Return the rows of a damper at one temperature [degC] and at all its voltages."""
    listed = [values[NODE_VOLTAGES] for values in damper.effects.values() if NODE_VOLTAGES in values]
    voltages = np.unique(np.concatenate([base_voltages(damper), *(np.atleast_1d(v) for v in listed)]))
    effects = {name: _interpolated(values, voltages) for name, values in damper.effects.items()}
    return nodes_with(voltages, bingham_parameters(damper, voltages, temperature), effects, drive_row_of(damper))


def _interpolated(values: EffectValues, voltages: Array) -> dict[str, float | Array]:
    """Return the parameters of an effect at (m,) voltages: (m,) where it has one value per voltage."""
    own = np.atleast_1d(values.get(NODE_VOLTAGES, 0.0))
    return {
        name: np.interp(voltages, own, value) if isinstance(value, tuple) else value
        for name, value in values.items()
        if name != NODE_VOLTAGES
    }


def nodes_with(
    voltages: Array, base: Array, effects: Mapping[str, Mapping[str, NodeValue]], drive: Array
) -> DamperNodes:
    """Assemble the rows of a damper at some voltages.

    Parameters
    ----------
    voltages : (m,) rising [V]
    base : (m, 3) or (1, 3) T0 [N], C [N s/m] and k [N/m] there
    effects : values by effect and parameter, (m,) where they differ by voltage
    drive : (d,) row of the drive, see `drive_row`
    """
    rows = np.empty((voltages.size, 3 + len(STROKE_AND_FLOW)))
    rows[:, :3] = base
    _fill_columns(rows[:, 3:], STROKE_AND_FLOW, effects)
    parallel = np.empty((voltages.size, len(PARALLEL)))
    _fill_columns(parallel, PARALLEL, effects)
    return DamperNodes(voltages, rows, parallel, drive)


def _fill_columns(rows: Array, columns: tuple[Column, ...], effects: Mapping[str, Mapping[str, NodeValue]]) -> None:
    """Fill (m, c) rows with the values of c columns, neutral where the effect is missing."""
    rows[:] = [NEUTRAL[column] for column in columns]
    for place, (name, parameter) in enumerate(columns):
        if name in effects:
            rows[:, place] = effects[name].get(parameter, NEUTRAL[name, parameter])


@compiled
def row_at(voltages: Array, rows: Array, voltage: float) -> Row:
    """Interpolate the parameter row at an effective voltage [V] between the (m,) nodes."""
    last = voltages.size - 1
    if last == 0 or voltage <= voltages[0]:
        return row_of(rows[0])
    if voltage >= voltages[last]:
        return row_of(rows[last])
    i = np.searchsorted(voltages, voltage, side="right") - 1
    share = (voltage - voltages[i]) / (voltages[i + 1] - voltages[i])
    return interpolate(row_of(rows[i]), row_of(rows[i + 1]), share)


def rows_along(voltages: Array, rows: Array, effective: Array) -> Array:
    """Interpolate parameter rows along an effective voltage.

    Parameters
    ----------
    voltages : (k,) rising nodes [V]
    rows : (k, r) rows at the nodes
    effective : (n,) effective voltage [V]

    Returns
    -------
    (n, r), or (1, r) where they are the same at every node
    """
    if np.all(rows == rows[0]):
        return rows[:1].copy()
    along = np.empty((effective.size, rows.shape[1]))
    _fill_rows(voltages, np.ascontiguousarray(rows), effective, along)
    return along


@compiled
def _fill_rows(voltages: Array, rows: Array, effective: Array, along: Array) -> None:
    """Fill the (n, r) rows; the search starts at the last interval, as a voltage varies little per sample."""
    last, i = voltages.size - 1, 0
    for n in range(effective.size):
        voltage = min(max(effective[n], voltages[0]), voltages[last])
        while i > 0 and voltage < voltages[i]:
            i -= 1
        while i < last - 1 and voltage >= voltages[i + 1]:
            i += 1
        share = (voltage - voltages[i]) / (voltages[i + 1] - voltages[i])
        for c in range(rows.shape[1]):
            a, b = rows[i, c], rows[i + 1, c]
            along[n, c] = a if a == b else a + (b - a) * share  # equal infinities stand
