"""Records of moving voltage: T0, C and k piecewise linear in the voltage, the state being the piston's place.

Nodes that constant records determine are fixed at those values, since a lag or hysteresis of the valve, which the
Bingham element lacks, would otherwise leak into them. The other nodes are fitted to the moving records, together with
the constant records of a node whose own fit left a parameter undetermined.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pzd.artefacts import ParameterRow
from pzd.damper.compose import respond
from pzd.damper.model import BaseRow, Damper
from pzd.damper.motion import Motion, parts_of_steps
from pzd.fit.least_squares import minimise
from pzd.identification import bingham_fit
from pzd.identification.bingham_fit import Bingham, Objective, fit_separable
from pzd.identification.condition import estimate_of
from pzd.identification.config import IdentifyConfig
from pzd.identification.prepared_record import fitted_records, prepare, split_by_record
from pzd.record import CONSTANT_SHARE, Array, Condition, Record, Rows, conditions, voltage_scale
from pzd.schema.errors import ConfigError
from pzd.signals.jumps import denoised_control

ConstantRow = tuple[Condition, ParameterRow]
log = logging.getLogger(__name__)
DWELL_TIME = 0.05
"""Time for which the voltage has been near a node before a sample serves for starting values [s]."""
LEAST_COORDINATES = np.array([0.0, 0.0, 0.1])
"""Least search coordinates of a node: between a rigid node and another k is not linear."""
FEWEST_NEAR_NODE = 200
"""Fewest samples near a node for starting values of its own."""


def fit_moving(
    records: Sequence[Record], constant: Sequence[Condition], rows: Sequence[ParameterRow], config: IdentifyConfig
) -> list[ParameterRow]:
    """Identify the nodes that moving records of one setting determine.

    Parameters
    ----------
    records : moving records of the setting
    constant : its conditions
    rows : their rows, in the same order
    config : grouping of records into conditions, and the nodes

    Returns
    -------
    rows of the nodes without a fully determined condition; they replace rows of the same labels
    """
    still = [replace(r, voltage=None) for r in records]
    bands, _ = conditions(still, None, config.group.temperature_degC)
    by_name = {r.name: r for r in records}
    found: list[ParameterRow] = []
    for band in bands:
        known = _at_nearest_temperature(list(zip(constant, rows, strict=True)), band.temperature, config)
        found += _fit_band([by_name[r.name] for r in band.records], band.temperature, known, config)
    return found


def _at_nearest_temperature(
    known: list[ConstantRow], temperature: float | None, config: IdentifyConfig
) -> list[ConstantRow]:
    """Return the conditions at the nearest temperature: the course over temperature comes from constant records."""

    def distance(condition: Condition) -> float:
        a, b = condition.temperature, temperature
        return 0.0 if a is None or b is None else abs(a - b)

    if not known:
        return []
    nearest = min((c for c, _ in known), key=distance).temperature
    within = config.group.temperature_degC
    return [(c, r) for c, r in known if c.temperature == nearest or _within(c.temperature, nearest, within)]


def _within(a: float | None, b: float | None, within: float) -> bool:
    """Tell whether two temperatures are known and close."""
    return a is not None and b is not None and abs(a - b) <= within


def _holds_damping(row: ParameterRow) -> bool:
    """Whether the interval of C excludes zero: where it does not, C is small in these slow tests alone."""
    return row.C_Ns_per_m_low95 is None or row.C_Ns_per_m_low95 > 0.0


def _fit_band(
    records: list[Record], temperature: float | None, known: list[ConstantRow], config: IdentifyConfig
) -> list[ParameterRow]:
    """Fit the free nodes of one setting and temperature."""
    scale = voltage_scale([*records, *(r for c, _ in known for r in c.records)])
    voltages = [c.voltage for c, _ in known if c.voltage is not None]
    nodes = voltage_nodes(records, voltages, config.nodes, scale)
    fixed: dict[int, Bingham] = {}
    temperatures: dict[int, float | None] = {}
    for condition, row in known:
        node = int(np.argmin(np.abs(nodes - (condition.voltage or 0.0))))
        temperatures[node] = condition.temperature
        if row.T0_N is not None and row.C_Ns_per_m is not None and row.k_N_per_m is not None and _holds_damping(row):
            fixed[node] = Bingham(row.T0_N, row.C_Ns_per_m, row.k_N_per_m)
        else:
            records = [*records, *condition.records]
    objective = MovingObjective(tuple(records), nodes, fixed, Objective(tuple(prepare(r) for r in records)))
    if not objective.free:
        residuals = objective.residuals([])
        ratio = float(residuals @ residuals) / objective.constant.energy
        log.info("moving records: every node has constant records; with these W_s = %.3g", ratio)
        return []
    free = _descend(objective, _starting_values(objective, CONSTANT_SHARE * scale))
    setting = records[0].setting
    labels = [(setting, float(nodes[i]), temperatures.get(i, temperature)) for i in objective.free]
    residuals = objective.residuals(free)
    slopes = objective.slopes(free, residuals)
    prepared = objective.constant.prepared
    # Where the voltage moves nothing repeats, and no lack of fit is judged.
    by_record = split_by_record(prepared, residuals, slopes)
    fitted = fitted_records(objective.records, prepared, by_record, config.nuisance, constant=False)
    optimum, touched = list(zip(labels, free, strict=True)), objective.touched()[:, objective.free] > 0.0
    return estimate_of(objective.constant, optimum, fitted, touched).rows()


def _starting_values(objective: MovingObjective, band: float) -> list[Bingham]:
    """Estimate each free node by a fit of constant parameters to the samples near it, else to all."""
    overall = fit_separable(objective.constant).parameters
    starts = []
    for node in objective.nodes[objective.free]:
        others = objective.nodes[objective.nodes != node]
        window = max(0.25 * float(np.min(np.abs(others - node), initial=np.inf)), band) if others.size else np.inf
        prepared = [
            replace(t, counted=t.counted & _dwells(r, float(node), window))
            for r, t in zip(objective.records, objective.constant.prepared, strict=True)
        ]
        prepared = [t for t in prepared if np.any(t.counted)]
        near = sum(int(np.count_nonzero(t.counted)) for t in prepared)
        starts.append(fit_separable(Objective(tuple(prepared))).parameters if near >= FEWEST_NEAR_NODE else overall)
    return [objective.constant.clipped(s) for s in starts]


def _dwells(record: Record, node: float, window: float) -> NDArray[np.bool_]:
    """Find the samples (n,) at which the voltage has been near the node for long enough."""
    outside = np.abs(voltage_of(record) - node) > window
    index = np.arange(outside.size)
    last_outside = np.maximum.accumulate(np.where(outside, index, -outside.size))
    return np.asarray(index - last_outside > DWELL_TIME * record.rate)


def _descend(objective: MovingObjective, starts: Sequence[Bingham]) -> list[Bingham]:
    """Find the optimum over all free nodes together by trust-region least squares."""
    constant, norm = objective.constant, np.sqrt(objective.constant.energy)
    low, high = (np.tile(b, len(starts)) for b in (LEAST_COORDINATES, constant.coordinates.high))

    def parameters(x: Array) -> list[Bingham]:
        return [constant.from_search(part) for part in x.reshape(-1, 3)]

    def residuals_at(x: Array) -> Array:
        return np.asarray(objective.residuals(parameters(x)) / norm)

    def slopes_at(x: Array) -> Array:
        free = parameters(x)
        slopes = objective.slopes(free, objective.residuals(free))
        parts = np.split(slopes, len(free), axis=1)
        own = [part @ constant.coordinates.slopes(p) for part, p in zip(parts, x.reshape(-1, 3), strict=True)]
        return np.asarray(-np.hstack(own) / norm)

    start = np.concatenate([constant.to_search(s) for s in starts])
    start = np.clip(start, low + 1e-9, high - 1e-9)
    found = minimise(
        residuals_at, start, slopes_at, (low, high), precision=PRECISION, evaluations=bingham_fit.EVALUATIONS
    )
    return parameters(found.x)


# --- Voltage nodes ---

DWELL_SHARE = 0.05
"""Least share of the samples at a level, in a band of 2 % of the scale of the voltage, or beyond the nodes."""
BEYOND = 0.1
"""Share of the range of the nodes by which a voltage lies well beyond them: closer, the last slope hardly changes."""


def voltage_nodes(
    moving: Sequence[Record], constant: Sequence[float], chosen: Sequence[float] | None, scale: float
) -> Array:
    """Choose the nodes of the piecewise linear parameters, rising [V].

    The voltages of constant records are always nodes. The config may add others; where it does not and there are fewer
    than two, the levels on which the voltage dwells are added, and the ends of what it goes through beyond all these.

    Parameters
    ----------
    moving : the records with moving voltage
    constant : voltages of the constant records of the same setting and temperature
    chosen : `identify.nodes`, None where the config does not give any
    scale : the rig's voltage scale [V]

    Returns
    -------
    (m,) nodes

    Raises
    ------
    ConfigError : when two chosen nodes are closer than 2 % of the scale
    """
    apart = CONSTANT_SHARE * scale
    constant = _distinct_voltages(constant, apart)
    if chosen is not None and np.any(np.diff(np.sort(chosen)) <= apart):
        raise ConfigError(f"identify.nodes: two nodes are closer than {apart:g}; leave one out (got {list(chosen)})")
    voltage = np.concatenate([r.voltage for r in moving if r.voltage is not None])
    added = chosen
    if added is None:
        added = [] if len(constant) > 1 else dwell_levels(voltage, apart)
        added = [*added, *_ends_beyond(voltage, [*constant, *added])]
    return np.sort([*constant, *(v for v in added if all(abs(v - c) > apart for c in constant))])


def _ends_beyond(voltage: Array, nodes: Sequence[float]) -> list[float]:
    """Return the least and largest voltage where they lie well beyond the nodes, and so many samples that they count.

    Beyond the outermost node all is constant, and what a ramp shows there would bend the nodes inside.
    """
    margin = BEYOND * (max(nodes) - min(nodes))
    low, high = float(voltage.min()), float(voltage.max())
    sides = ((low, voltage < min(nodes) - margin), (high, voltage > max(nodes) + margin))
    return [end for end, beyond in sides if np.mean(beyond) >= DWELL_SHARE]


def _distinct_voltages(voltages: Sequence[float], apart: float) -> list[float]:
    """Merge voltages no further apart into the lowest of them: one voltage may occur at two temperatures."""
    kept: list[float] = []
    for voltage in sorted(voltages):
        if not kept or voltage - kept[-1] > apart:
            kept.append(voltage)
    return kept


def dwell_levels(voltage: Array, band: float) -> list[float]:
    """Find the levels on which a voltage dwells; its extremes where there are fewer than two.

    Parameters
    ----------
    voltage : (n,) voltage [V]
    band : width of the band that makes a level [V]

    Returns
    -------
    medians of the bands that hold most samples, most first
    """
    rest = np.sort(voltage)
    levels: list[float] = []
    while rest.size:
        inside = np.searchsorted(rest, rest + band, side="right") - np.arange(rest.size)
        first = int(np.argmax(inside))
        if inside[first] < DWELL_SHARE * voltage.size:
            break
        levels.append(float(np.median(rest[first : first + inside[first]])))
        rest = rest[np.abs(rest - levels[-1]) > 2.0 * band]
    if len(levels) < 2:
        extremes = [float(voltage.min()), float(voltage.max())]
        levels += [e for e in extremes if all(abs(e - level) > 2.0 * band for level in levels)]
    return levels


def node_weights(nodes: Array, voltage: Array) -> Array:
    """Return the share (n, m) of each node in the parameters at each voltage, constant beyond the outermost nodes."""
    return np.stack([np.interp(voltage, nodes, unit) for unit in np.eye(nodes.size)], axis=-1)


# --- Criterion (4) with parameters piecewise linear in the voltage ---

PRECISION = 1e-9
"""Relative tolerance of the least squares: that of the slopes by difference quotients bounds how near it comes."""
DIFFERENCE = 1e-5
"""Step of the difference quotients, as a share of the parameter; for T0 of at least a hundredth of the peak force."""
INTEGRATION = 1e-10
"""Tolerance of the integration, well below the step of the difference quotients."""


@dataclass(frozen=True, eq=False)
class MovingObjective:
    """Criterion (4) over records of moving voltage, the parameters of some nodes free and of the others fixed."""

    records: tuple[Record, ...]
    nodes: Array
    """(m,) voltages of the nodes, rising [V]."""
    fixed: dict[int, Bingham]
    """Parameters of the fixed nodes, by their index."""
    constant: Objective
    """The same records with constant parameters, for bounds, warm-up and starting values."""

    @property
    def free(self) -> list[int]:
        """Indices of the nodes to be fitted."""
        return [i for i in range(self.nodes.size) if i not in self.fixed]

    @cached_property
    def _motions(self) -> tuple[tuple[Motion, Rows], ...]:
        """Motion of each record, and the indices of its samples in it."""
        return tuple(motion_of(record) for record in self.records)

    def residuals(self, free: Sequence[Bingham]) -> Array:
        """Compute the measured less simulated force (N,) at the counted samples [N]."""
        values = self.fixed | dict(zip(self.free, free, strict=True))
        rows = (
            BaseRow(voltage_V=float(self.nodes[i]), T0_N=p.friction, C_Ns_per_m=p.damping, k_N_per_m=p.stiffness)
            for i, p in sorted(values.items())
        )
        damper = Damper(base=tuple(rows))
        forces = [
            respond(damper, motion, float(r.force[0]), INTEGRATION)[places][t.counted]
            for r, t, (motion, places) in zip(self.records, self.constant.prepared, self._motions, strict=True)
        ]
        return np.asarray(self.constant.measured - np.concatenate(forces))

    def slopes(self, free: Sequence[Bingham], residuals: Array) -> Array:
        """Compute the derivatives (N, 3 f) of the force by T0, C, 1/k of each free node, by difference quotients."""
        peak, speed, _ = self.constant.scales
        columns = []
        for i, (friction, damping, stiffness) in enumerate(free):
            steps = DIFFERENCE * np.array(
                [max(friction, 1e-2 * peak), max(damping, 1e-2 * peak / speed), 1.0 / stiffness]
            )
            for j, step in enumerate(steps):
                change = step * np.eye(3)[j]
                moved = Bingham(friction + change[0], damping + change[1], 1.0 / (1.0 / stiffness + change[2]))
                other = [*free[:i], moved, *free[i + 1 :]]
                columns.append((residuals - self.residuals(other)) / step)
        return np.stack(columns, axis=-1)

    def touched(self) -> Array:
        """Return the share (N, m) of each node in the parameters at the counted samples."""
        pairs = zip(self.records, self.constant.prepared, strict=True)
        return np.concatenate([node_weights(self.nodes, voltage_of(r)[t.counted]) for r, t in pairs])


def motion_of(record: Record) -> tuple[Motion, Rows]:
    """Return the motion of a record, its speed from a cubic spline, on a finer grid where the voltage steps.

    Returns
    -------
    the motion, and (n,) indices of the samples of the record in it
    """
    from scipy.interpolate import CubicSpline

    speed, voltage = CubicSpline(record.time, record.displacement)(record.time, 1), voltage_of(record)
    motion = Motion(record.time, record.displacement, speed, record.acceleration, voltage, None)
    return motion.finer(parts_of_steps(voltage, voltage.size))


def voltage_of(record: Record) -> Array:
    """Return the voltage (n,) of a record, its levels and ramps free of noise.

    Raises
    ------
    ValueError : when it has none
    """
    if record.voltage is None:
        raise ValueError(f"record {record.name} has no voltage")
    return denoised_control(record.voltage)
