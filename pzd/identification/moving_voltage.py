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
from pzd.identification.bingham_fit import (
    TOLERANCE,
    Bingham,
    Objective,
    fit_separable,
    from_search,
    search_slopes,
    to_search,
)
from pzd.identification.condition import parameter_row
from pzd.identification.config import IdentifyConfig
from pzd.identification.intervals import half_widths, uncertainty
from pzd.identification.prepared_record import PreparedRecord, fitted_records, prepare
from pzd.identification.trust import (
    misfit_of,
    parameter_evidence,
    parameter_scales,
    partial_sensitivities,
    stationarity,
)
from pzd.record import CONSTANT_SHARE, Array, Condition, Record, Rows, conditions, voltage_scale
from pzd.schema.errors import ConfigError
from pzd.signals.jumps import denoised_control
from pzd.signals.measures import criterion
from pzd.signals.nuisance import NuisanceConfig

ConstantRow = tuple[Condition, ParameterRow]
log = logging.getLogger(__name__)
DWELL_TIME = 0.05
"""For starting values the voltage has been near its node for this long [s]."""
FEWEST_NEAR_NODE = 200
"""Samples near a node that starting values need."""


def fit_moving(
    records: Sequence[Record], constant: Sequence[Condition], rows: Sequence[ParameterRow], config: IdentifyConfig
) -> list[ParameterRow]:
    """Rows of the nodes that moving records of one setting determine.

    Parameters
    ----------
    records : moving records of the setting
    constant : its conditions
    rows : their rows, in the same order
    config : which records are one condition, and the nodes

    Returns
    -------
    rows of the nodes without a fully determined constant condition; they replace rows of the same labels
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
    """The conditions whose temperature is nearest: base parameters over temperature come from constant records."""

    def distance(condition: Condition) -> float:
        a, b = condition.temperature, temperature
        return 0.0 if a is None or b is None else abs(a - b)

    if not known:
        return []
    nearest = min((c for c, _ in known), key=distance).temperature
    within = config.group.temperature_degC
    return [(c, r) for c, r in known if c.temperature == nearest or _within(c.temperature, nearest, within)]



def _within(a: float | None, b: float | None, within: float) -> bool:
    return a is not None and b is not None and abs(a - b) <= within



def _fit_band(
    records: list[Record],
    temperature: float | None,
    known: list[ConstantRow],
    config: IdentifyConfig,
) -> list[ParameterRow]:
    """Fit the free nodes of one setting and temperature."""
    scale = voltage_scale([*records, *(r for c, _ in known for r in c.records)])
    voltages = [c.voltage for c, _ in known if c.voltage is not None]
    nodes = voltage_nodes(records, voltages, config.nodes, scale)
    held: dict[int, Bingham] = {}
    for condition, row in known:
        node = int(np.argmin(np.abs(nodes - (condition.voltage or 0.0))))
        if row.T0_N is not None and row.C_Ns_per_m is not None and row.k_N_per_m is not None:
            held[node] = Bingham(row.T0_N, row.C_Ns_per_m, row.k_N_per_m)
        else:
            records = [*records, *condition.records]
    objective = MovingObjective(
        tuple(records), nodes, held, Objective(tuple(_prepare_with_voltage(r) for r in records))
    )
    if not objective.free:
        residuals = objective.residuals([])
        ratio = float(residuals @ residuals) / objective.plain.energy
        log.info("moving records: every node has constant records; with these W_s = %.3g", ratio)
        return []
    free = _descend(objective, _starting_values(objective, CONSTANT_SHARE * scale))
    setting = records[0].setting
    temperatures = {int(np.argmin(np.abs(nodes - (c.voltage or 0.0)))): c.temperature for c, _ in known}
    labels = [(setting, float(nodes[i]), temperatures.get(i, temperature)) for i in objective.free]
    return _node_rows(objective, free, labels, config.nuisance)



def _prepare_with_voltage(record: Record) -> PreparedRecord:
    """The trial of a record, without a voltage that would be missing later."""
    voltage_of(record)
    return prepare(record)



def _starting_values(objective: MovingObjective, band: float) -> list[Bingham]:
    """Starting values of each free node: a constant fit to the samples near it, else to all of them."""
    overall = fit_separable(objective.plain).parameters
    starts = []
    for node in objective.nodes[objective.free]:
        others = objective.nodes[objective.nodes != node]
        window = max(0.25 * float(np.min(np.abs(others - node), initial=np.inf)), band) if others.size else np.inf
        trials = [
            replace(t, counted=t.counted & _dwells(r, float(node), window))
            for r, t in zip(objective.records, objective.plain.trials, strict=True)
        ]
        trials = [t for t in trials if np.any(t.counted)]
        near = sum(int(np.count_nonzero(t.counted)) for t in trials)
        starts.append(fit_separable(Objective(tuple(trials))).parameters if near >= FEWEST_NEAR_NODE else overall)
    return [objective.plain.clipped(s) for s in starts]



def _dwells(record: Record, node: float, window: float) -> NDArray[np.bool_]:
    """(n,) whether the voltage has been near the node for long enough."""
    outside = np.abs(voltage_of(record) - node) > window
    index = np.arange(outside.size)
    last_outside = np.maximum.accumulate(np.where(outside, index, -outside.size))
    return np.asarray(index - last_outside > DWELL_TIME * record.rate)



def _descend(objective: MovingObjective, starts: Sequence[Bingham]) -> list[Bingham]:
    """The optimum over all free nodes together, by trust-region least squares."""
    from scipy.optimize import least_squares

    stroke, norm = objective.plain.scales[2], np.sqrt(objective.plain.energy)
    low, high = (np.tile(b, len(starts)) for b in objective.plain.search_bounds)

    def parameters(x: Array) -> list[Bingham]:
        return [from_search(part, stroke) for part in x.reshape(-1, 3)]

    def residuals_at(x: Array) -> Array:
        return np.asarray(objective.residuals(parameters(x)) / norm)

    def slopes_at(x: Array) -> Array:
        free = parameters(x)
        slopes = objective.slopes(free, objective.residuals(free))
        inner = [slopes[:, 3 * i : 3 * i + 3] @ search_slopes(p, stroke) for i, p in enumerate(free)]
        return np.asarray(-np.hstack(inner) / norm)

    start = np.concatenate([to_search(s, stroke) for s in starts])
    found = least_squares(
        residuals_at,
        np.clip(start, low + 1e-9, high - 1e-9),
        jac=slopes_at,
        bounds=(low, high),
        x_scale="jac",
        xtol=TOLERANCE**0.75,
        ftol=TOLERANCE**0.75,
        gtol=TOLERANCE,
        max_nfev=60,
    )
    return parameters(found.x)



def _node_rows(
    objective: MovingObjective,
    free: list[Bingham],
    labels: list[tuple[str | None, float, float | None]],
    nuisance: NuisanceConfig,
) -> list[ParameterRow]:
    """One row a free node, judged on the samples that the node touches.

    Where the voltage moves nothing repeats, so that no lack of fit is judged.
    """
    residuals = objective.residuals(free)
    slopes = objective.slopes(free, residuals)
    plain = objective.plain
    parts = fitted_records(objective.records, plain.trials, (residuals, slopes), nuisance, constant=False)
    misfit = misfit_of(parts)
    noise = uncertainty(slopes, residuals, plain.lengths).half_widths().reshape(-1, 3)
    widths = half_widths(parts, misfit).reshape(-1, 3)
    scales = np.stack([parameter_scales(p, plain.measured) for p in free])
    visible = partial_sensitivities(slopes, scales.ravel(), plain.energy).reshape(-1, 3)
    cosines = stationarity(slopes, residuals, plain.energy).reshape(-1, 3)
    touched = objective.touched()[:, objective.free] > 0.0
    rows = []
    for i, parameters in enumerate(free):
        here = touched[:, i] if np.any(touched[:, i]) else slice(None)
        measured, left = plain.measured[here], residuals[here]
        energy = float(measured @ measured)
        facts = np.stack([scales[i], noise[i], widths[i], visible[i] * np.sqrt(plain.energy / energy), cosines[i]])
        evidence = parameter_evidence(plain, parameters, criterion(left, measured), facts, misfit)
        rows.append(parameter_row(labels[i], parameters, widths[i], evidence, (measured, left)))
    return rows



# --- Nodes ---

DWELL_SHARE = 0.05
"""A level holds at least this share of the samples, in a band of 2 % of the voltage's scale."""


def voltage_nodes(
    moving: Sequence[Record], constant: Sequence[float], chosen: Sequence[float] | None, scale: float
) -> Array:
    """The nodes of the piecewise linear parameters, rising [V].

    The voltages of constant records always are nodes. The config may add others; where it does
    not and there are fewer than two, the levels that the voltage dwells on join them.

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
    if chosen is None and len(constant) > 1:
        return np.sort(constant)
    voltage = np.concatenate([r.voltage for r in moving if r.voltage is not None])
    added = dwell_levels(voltage, apart) if chosen is None else chosen
    return np.sort([*constant, *(v for v in added if all(abs(v - c) > apart for c in constant))])



def _distinct_voltages(voltages: Sequence[float], apart: float) -> list[float]:
    """Voltages, those no further apart than that counting as the lowest of them: one voltage at two temperatures."""
    kept: list[float] = []
    for voltage in sorted(voltages):
        if not kept or voltage - kept[-1] > apart:
            kept.append(voltage)
    return kept



def dwell_levels(voltage: Array, band: float) -> list[float]:
    """Levels on which a voltage dwells, its extremes where there are fewer than two.

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
        held = np.searchsorted(rest, rest + band, side="right") - np.arange(rest.size)
        first = int(np.argmax(held))
        if held[first] < DWELL_SHARE * voltage.size:
            break
        levels.append(float(np.median(rest[first : first + held[first]])))
        rest = rest[np.abs(rest - levels[-1]) > 2.0 * band]
    if len(levels) < 2:
        extremes = [float(voltage.min()), float(voltage.max())]
        levels += [e for e in extremes if all(abs(e - level) > 2.0 * band for level in levels)]
    return levels



def node_weights(nodes: Array, voltage: Array) -> Array:
    """(n, m) share of each node in the parameters at each voltage, held beyond the outermost."""
    return np.stack([np.interp(voltage, nodes, unit) for unit in np.eye(nodes.size)], axis=-1)



# --- Criterion ---

DIFFERENCE = 1e-5
"""Step of the difference quotients, as a share of the parameter; for T0 of a hundredth of peak force at least."""
INTEGRATION = 1e-10
"""Tolerance of the integration, well below the step of the difference quotients."""


@dataclass(frozen=True, eq=False)
class MovingObjective:
    """Criterion (4) over moving records, the parameters of some nodes free and of the others held."""

    records: tuple[Record, ...]
    nodes: Array
    held: dict[int, Bingham]
    """Parameters of the nodes that stand, by their index."""
    plain: Objective
    """The same records with constant parameters: bounds, warm-up and starting values."""

    @property
    def free(self) -> list[int]:
        """Indices of the nodes to be fitted."""
        return [i for i in range(self.nodes.size) if i not in self.held]

    @cached_property
    def _motions(self) -> tuple[tuple[Motion, Rows], ...]:
        return tuple(motion_of(record) for record in self.records)

    def residuals(self, free: Sequence[Bingham]) -> Array:
        """(N,) measured less simulated force at the counted samples [N]."""
        values = dict(self.held) | dict(zip(self.free, free, strict=True))
        damper = damper_with_nodes(self.nodes, [values[i] for i in range(self.nodes.size)])
        parts = [
            respond(damper, motion, float(r.force[0]), INTEGRATION)[places][t.counted]
            for r, t, (motion, places) in zip(self.records, self.plain.trials, self._motions, strict=True)
        ]
        residuals: Array = self.plain.measured - np.concatenate(parts)
        return residuals

    def slopes(self, free: Sequence[Bingham], residuals: Array) -> Array:
        """(N, 3 f) derivatives of the simulated force by T0, C, k of each free node, by difference quotients."""
        peak = self.plain.scales[0]
        columns = []
        for i, parameters in enumerate(free):
            steps = DIFFERENCE * np.array([max(parameters.friction, 1e-2 * peak), *parameters[1:]])
            for j, step in enumerate(steps):
                moved = Bingham(*(p + step * (i == j) for i, p in enumerate(parameters)))
                other = [*free[:i], moved, *free[i + 1 :]]
                columns.append((residuals - self.residuals(other)) / step)
        return np.stack(columns, axis=-1)

    def touched(self) -> Array:
        """(N, m) share of each node in the parameters at the counted samples."""
        return np.concatenate(
            [
                node_weights(self.nodes, voltage_of(r)[t.counted])
                for r, t in zip(self.records, self.plain.trials, strict=True)
            ]
        )



def damper_with_nodes(nodes: Array, values: Sequence[Bingham]) -> Damper:
    """The plain damper with these parameters at these voltages."""
    return Damper(
        base=tuple(
            BaseRow(voltage_V=float(u), T0_N=p.friction, C_Ns_per_m=p.damping, k_N_per_m=p.stiffness)
            for u, p in zip(nodes, values, strict=True)
        )
    )



def motion_of(record: Record) -> tuple[Motion, Rows]:
    """The record's motion, its speed from the cubic through the displacement, on a finer grid where the voltage steps.

    Returns
    -------
    the motion, and (n,) which of its samples are those of the record
    """
    from scipy.interpolate import CubicSpline

    speed, voltage = CubicSpline(record.time, record.displacement)(record.time, 1), voltage_of(record)
    motion = Motion(record.time, record.displacement, speed, record.acceleration, voltage, None)
    return motion.finer(parts_of_steps(voltage, voltage.size))



def voltage_of(record: Record) -> Array:
    """(n,) the record's voltage, its levels and ramps free of noise.

    Raises
    ------
    ValueError : when it has none
    """
    if record.voltage is None:
        raise ValueError(f"record {record.name} has no voltage")
    return denoised_control(record.voltage)

