"""Simulated forces, residuals and their Jacobian at a point of the search."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import cast

import numpy as np
from numpy.typing import NDArray

from pzd.damper import parameter_rows
from pzd.damper.compiled.kernels import K
from pzd.damper.compose import (
    constant_value,
    integrated_sensitivities,
    parallel_force_along,
    parallel_force_change,
    sensors_of,
)
from pzd.damper.confounders import known
from pzd.damper.effect import ELEMENT
from pzd.damper.path import Variables
from pzd.diagnosis.fit.likelihood import SIMULATION_TOLERANCE, Sensors, WeightedRecord
from pzd.diagnosis.fit.problem import Budget, Point, Problem, Unknown
from pzd.record import Array

# --- Parameters as the kernels take them


@dataclass(frozen=True, eq=False)
class KernelInputs:
    """Parameters of a damper as the kernels take them, along the motion of one observation."""

    at_nodes: Array
    """(k, r) parameter rows of the element at the nodes; without nodes (1, r), or (m, r) along the motion."""
    parallel: Array | None
    """(1, b) or (m, b) rows of the parallel forces; None without any."""
    sensors: Sensors
    """Parameters of the effects of the sensor, by effect and name."""
    displacement_zero: float
    """Zero of the displacement [m]."""
    nodes: Array | None = None
    """(k,) voltages [V]; None without nodes."""
    effective_voltage: Array | None = None
    """(m,) effective voltage [V], at which the rows are interpolated between the nodes."""

    @cached_property
    def rows(self) -> Array:
        """(1, r) or (m, r) parameter rows of the element."""
        return self._interpolated(self.at_nodes)

    def _interpolated(self, at_nodes: Array) -> Array:
        if self.nodes is None or self.effective_voltage is None:
            return at_nodes
        return parameter_rows.rows_along(self.nodes, at_nodes, self.effective_voltage)

    def difference_to(self, other: KernelInputs) -> tuple[NDArray[np.int64], Array]:
        """Return the (c,) columns in which another damper differs, and (1, c), (k, c) or (m, c) its rows less these.

        A difference of two infinite values is 0. For k it is that of 1/k: linear between nodes is k, so that along a
        voltage it is formed where it is needed.
        """
        same_voltage = self.effective_voltage is other.effective_voltage
        differs = np.any(self.at_nodes != other.at_nodes, axis=0)
        if not same_voltage:
            differs |= np.any(self.at_nodes != self.at_nodes[:1], axis=0)
        columns = np.flatnonzero(differs)
        mine, others = self.at_nodes[:, columns], other.at_nodes[:, columns]
        if not same_voltage or differs[K]:
            mine, others = self._interpolated(mine), other._interpolated(others)
        mine, others = (np.divide(1.0, rows, out=rows.copy(), where=columns == K) for rows in (mine, others))
        shape = np.broadcast_shapes(mine.shape, others.shape)
        return columns, np.subtract(others, mine, out=np.zeros(shape), where=others != mine)

    def along_motion(self, change: Array) -> Array:
        """Interpolate values given at the nodes to (1, c) or (m, c) along the motion."""
        return self._interpolated(change) if self.nodes is not None and len(change) == self.nodes.size else change

    def parallel_force(self, o: WeightedRecord) -> Array:
        """Compute the (m,) parallel force [N]; (1,) a zero without any."""
        if self.parallel is None:
            return np.zeros(1)
        return parallel_force_along(o.motion.centred_on(self.displacement_zero), self.parallel)


def kernel_inputs(point: Point, o: WeightedRecord, beside: tuple[Point, KernelInputs] | None = None) -> KernelInputs:
    """Evaluate the parameters of a point along the motion of an observation.

    Parameters
    ----------
    point : the point
    o : the observation
    beside : another point with its parameters; those of its effects are not evaluated again where they are the same
    """
    if o.base_row < 0:
        return _at_moving_voltage(point, o)
    if beside is not None and point.effects is beside[0].effects and not _has_material(point):
        found = replace(beside[1], at_nodes=beside[1].at_nodes.copy())
        found.at_nodes[:, : len(ELEMENT)] = point.base[o.base_row]
        return found
    return _at_constant_voltage(point, o)


def _has_material(point: Point) -> bool:
    return any(known()[name].place == "material" for name in point.effects)


def _at_constant_voltage(point: Point, o: WeightedRecord) -> KernelInputs:
    friction, damping, stiffness = point.base[o.base_row]
    effects = point.effects_at(o.base_row)
    rows, parallel = parameter_rows.constant_rows(friction, damping, stiffness, effects)
    places = {name: known()[name].place for name in effects}
    acting = {name: values for name, values in effects.items() if places[name] == "material"}
    if acting:
        given = {name: {key: np.array([value]) for key, value in values.items()} for name, values in acting.items()}
        temperature = constant_value(o.motion.temperature)
        factors = parameter_rows.material_factors(given, temperature, point.problem.reference_temperature)
        rows = np.repeat(rows, len(factors), axis=0)
        rows[:, : len(ELEMENT)] *= factors
    return KernelInputs(rows, parallel, _sensors(effects), point.displacement_zero)


def _at_moving_voltage(point: Point, o: WeightedRecord) -> KernelInputs:
    temperature = constant_value(o.motion.temperature)
    if temperature is not None and temperature.size > 1:
        damper = point.damper
        effective = o.effective_voltage(parameter_rows.drive_row_of(damper).tobytes())
        rows = parameter_rows.element_rows(damper, effective, temperature)
        parallel = parameter_rows.parallel_rows(damper, effective)
        return KernelInputs(rows, parallel, sensors_of(damper), point.displacement_zero)
    nodes = point.nodes(None if temperature is None else float(temperature[0]))
    effective, along = o.effective_voltage(nodes.drive.tobytes()), None
    if parameter_rows.acts_beside(point.effects):
        along = parameter_rows.rows_along(nodes.voltages, nodes.parallel, effective)
    return KernelInputs(nodes.rows, along, _sensors(point.effects), point.displacement_zero, nodes.voltages, effective)


def _sensors(effects: Mapping[str, Mapping[str, float | tuple[float, ...]]]) -> Sensors:
    """Return those of some effects that are the sensor's, which has one value at every voltage."""
    return {name: cast("Mapping[str, float]", own) for name, own in effects.items() if known()[name].place == "sensor"}


@dataclass(frozen=True, eq=False)
class SearchDirections:
    """Derivatives of the kernel inputs along some directions of the search, for one observation."""

    centre: KernelInputs
    pairs: Sequence[tuple[KernelInputs, KernelInputs, float]]
    """On each direction a point before and one behind, and their distance."""
    changed: NDArray[np.int64]
    """(c,) columns of the rows that a direction changes."""
    derivatives: Array
    """(1, d, c) or (m, d, c) derivatives of these columns by each direction, for k those of 1/k."""


def search_directions(
    point: Point, neighbours: Sequence[tuple[Point, Point, float]], o: WeightedRecord
) -> SearchDirections:
    """Difference the kernel inputs along some directions of the search.

    Parameters
    ----------
    point : at which the derivatives are taken
    neighbours : on each direction a point before and one behind, and their distance
    o : the observation
    """
    here = kernel_inputs(point, o)
    known_inputs = point, here
    pairs = [
        (kernel_inputs(a, o, known_inputs), kernel_inputs(b, o, known_inputs), width) for a, b, width in neighbours
    ]
    changes = [(*before.difference_to(after), width) for before, after, width in pairs]
    moves = np.zeros(here.at_nodes.shape[1], dtype=np.bool_)
    for columns, change, _ in changes:
        moves[columns] |= np.any(change != 0.0, axis=0)
    moved, place = np.flatnonzero(moves), np.cumsum(moves) - 1
    along = []
    for columns, change, width in changes:
        by = np.zeros((len(change), moved.size))
        kept = moves[columns]
        by[:, place[columns[kept]]] = change[:, kept] / width
        along.append(here.along_motion(by))
    return SearchDirections(here, pairs, moved, np.stack(np.broadcast_arrays(*along), axis=1))


def sensitivities(given: SearchDirections, o: WeightedRecord, budget: Budget) -> tuple[Array, Array]:
    """Compute the force along the motion of an observation and its derivatives along some directions.

    The dependence of the kernel inputs on the parameters is differenced; the path integrates the derivatives exactly.

    Parameters
    ----------
    given : directions along the motion of this observation
    o : the observation
    budget : counts what is simulated

    Returns
    -------
    (m,) force along the motion [N], and the (m, d) slopes of what the channel shows of it [N]
    """
    budget.add(o.motion.time.size * (1 + len(given.pairs)))
    parallel = given.centre.parallel_force(o)
    changes = [_parallel_force_derivative(pair, o) for pair in given.pairs]
    initial_slopes = np.array([-change[0] for change in changes])
    force, slopes = integrated_sensitivities(
        given.centre.rows,
        Variables(given.changed, given.derivatives, initial_slopes),
        o.motion,
        o.steps,
        o.initial_force - float(parallel[0]),
        SIMULATION_TOLERANCE,
    )
    force = force + parallel
    for j, change in enumerate(changes):
        slopes[:, j] += change
    if not given.centre.sensors:
        return force, slopes
    shown = o.through_sensors(slopes, given.centre.sensors)
    for j, (before, after, width) in enumerate(given.pairs):
        if before.sensors != after.sensors:
            change = o.through_sensors(force, after.sensors) - o.through_sensors(force, before.sensors)
            shown[:, j] += change / width
    return force, shown


def _parallel_force_derivative(pair: tuple[KernelInputs, KernelInputs, float], o: WeightedRecord) -> Array:
    """Compute the (m,) or (1,) derivative of the parallel force along a direction [N]."""
    before, after, width = pair
    zeros, rows = (before.displacement_zero, after.displacement_zero), (before.parallel, after.parallel)
    same = rows[0] is rows[1] or (rows[0] is not None and rows[1] is not None and np.array_equal(rows[0], rows[1]))
    if rows[0] is None or rows[1] is None or (zeros[0] == zeros[1] and same):
        return np.zeros(1)
    motions = o.motion.centred_on(zeros[0]), o.motion.centred_on(zeros[1])
    return parallel_force_change(motions, (rows[0], rows[1])) / width


# --- Residuals and their Jacobian


STEP = 1e-4
"""Step of a search variable to either side, over which the kernel inputs and the parallel force are differenced.

Reason: far above rounding, and so short that a branch begins to slip at the same sample on either side; the path of the
element, whose own errors a longer step would have to exceed, is not differenced."""


@dataclass(frozen=True, eq=False)
class BlockJacobian:
    """Jacobian by observations, each with the variables that move it alone: a test has one voltage of many."""

    free: int
    """Number of variables that the search moves."""
    blocks: tuple[tuple[tuple[int, ...], Array], ...]
    """Columns of the variables and (w_o, columns) derivatives of each observation."""

    def dense(self, columns: Sequence[int] | None = None) -> Array:
        """Return the (w, columns) derivatives by some variables, or by all; zero where there is no dependence."""
        wanted = range(self.free) if columns is None else columns
        place = {j: i for i, j in enumerate(wanted)}
        found = np.zeros((sum(len(block) for _, block in self.blocks), len(place)))
        begin = 0
        for own, block in self.blocks:
            here = [i for i, j in enumerate(own) if j in place]
            found[begin : begin + len(block), [place[own[i]] for i in here]] = block[:, here]
            begin += len(block)
        return found


@dataclass(frozen=True, eq=False)
class Linearisation:
    """Residuals at a point of the search, and their Jacobian."""

    residuals: tuple[Array, ...]
    """(w_o,) per observation, in units of noise."""
    simulated: tuple[Array, ...]
    """(n,) per observation, force at the compared samples [N]."""
    jacobian: BlockJacobian
    """Of all residuals by the search variables."""

    @property
    def stacked(self) -> Array:
        """(w,) all residuals."""
        return np.concatenate(self.residuals)


def linearise(
    problem: Problem,
    unknowns: Sequence[Unknown],
    x: Array,
    limits: tuple[Array, Array],
    wanted: Sequence[int] | None = None,
) -> Linearisation:
    """Compute residuals and Jacobian at a point: together they cost little more than the residuals alone.

    Parameters
    ----------
    problem : observations and starting values
    unknowns : of the effects
    x : (3 b + e,) point in the units of the search
    limits : (free,) least and largest values of the variables that the search moves
    wanted : columns to compute, the others being zero; all where none are given
    """
    residuals, forces, blocks = [], [], []
    for o, columns, sensors, force, slopes in _sensitivities_at(problem, unknowns, x, limits, wanted):
        # Next to C = 0 under a power law the slopes leave the floating numbers, and the force does not: a step goes by
        # the samples before it. As NaN they would end the search, and with it the diagnosis.
        finite = np.where(np.isfinite(slopes), slopes, 0.0)
        standardised = o.residual_and_slopes(force, finite, sensors)
        residuals.append(standardised[:, 0].copy())
        forces.append(o.at_compared(o.through_sensors(force, sensors)))
        blocks.append((columns, standardised[:, 1:].copy()))
    return Linearisation(tuple(residuals), tuple(forces), BlockJacobian(limits[0].size, tuple(blocks)))


def force_jacobian(problem: Problem, unknowns: Sequence[Unknown], x: Array) -> BlockJacobian:
    """Compute the Jacobian of the force at the compared samples [N] by all variables; see `linearise`."""
    limits = np.full(x.size, -np.inf), np.full(x.size, np.inf)
    found = _sensitivities_at(problem, unknowns, x, limits, None)
    return BlockJacobian(x.size, tuple((columns, o.at_compared(slopes)) for o, columns, *_, slopes in found))


def _sensitivities_at(
    problem: Problem, unknowns: Sequence[Unknown], x: Array, limits: tuple[Array, Array], wanted: Sequence[int] | None
) -> Iterator[tuple[WeightedRecord, tuple[int, ...], Sensors, Array, Array]]:
    """Yield each observation with its active variables, sensors, and what `sensitivities` computes along its motion."""
    low, high = limits
    free = low.size
    point = problem.point(x, unknowns)
    below, above = np.maximum(x[:free] - STEP, low), np.minimum(x[:free] + STEP, high)

    def moved(j: int, value: float) -> Point:
        return problem.point_beside(point, np.concatenate([x[:j], [value], x[j + 1 :]]), unknowns, j)

    columns_wanted = range(free) if wanted is None else wanted
    neighbours = {j: (moved(j, below[j]), moved(j, above[j]), float(above[j] - below[j])) for j in columns_wanted}
    # Observations of one base row share their directions, unless a material effect goes by the temperature of each.
    shared = not _has_material(point)
    cached = dict[int, SearchDirections]()
    for o in problem.observations:
        columns = tuple(j for j in active_columns(problem, unknowns, o, free) if j in neighbours)
        if o.base_row not in cached or o.base_row < 0 or not shared:
            cached[o.base_row] = search_directions(point, [neighbours[j] for j in columns], o)
        directions = cached[o.base_row]
        yield o, columns, directions.centre.sensors, *sensitivities(directions, o, problem.budget)


def active_columns(problem: Problem, unknowns: Sequence[Unknown], o: WeightedRecord, free: int) -> list[int]:
    """Return which of the first `free` variables move an observation: a test depends on its own voltage alone.

    Parameters
    ----------
    problem : observations and starting values
    unknowns : of the effects
    o : the observation
    free : number of variables that the search moves
    """
    rows = 3 * len(problem.base)
    own = range(3 * o.base_row, 3 * o.base_row + 3) if o.base_row >= 0 else range(rows)
    effects = [
        j for j, u in enumerate(unknowns) if u.node is None or o.base_row < 0 or u.node == problem.nodes[o.base_row]
    ]
    return [*own, *(rows + j for j in effects if rows + j < free)]
