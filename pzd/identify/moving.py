"""Records whose voltage moves: parameters piecewise linear in the voltage, the piston's place being the state.

Nodes that constant records determine are held at what those gave, since a lag or hysteresis of
the valve, which the plain element lacks, would else leak from the moving records into them. The
other nodes are fitted to the moving records, together with the constant ones of a node whose own
fit left a parameter undetermined.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pzd.artefacts import ParameterRow
from pzd.damper.compose import respond
from pzd.damper.model import BaseRow, Damper
from pzd.damper.motion import Motion
from pzd.identify.config import IdentifyConfig
from pzd.identify.fit import NAMES, row_of
from pzd.identify.intervals import uncertainty
from pzd.identify.nodes import nodes_of, weights
from pzd.identify.objective import Bingham, Objective, from_search, to_search
from pzd.identify.separable import TOLERANCE, fit_separable
from pzd.identify.trial import Trial, trial_of
from pzd.identify.trust import Evidence, friction_scale, is_stationary, lies_at_bound, visible_shares
from pzd.record import CONSTANT_SHARE, Array, Condition, Record, conditions, voltage_scale

Known = tuple[Condition, ParameterRow]

log = logging.getLogger(__name__)

DIFFERENCE = 1e-5
"""Step of the difference quotients, in the logarithm of C and k and the share of peak force of T0."""
INTEGRATION = 1e-10
"""Tolerance of the integration, well below the step of the difference quotients."""
SETTLED = 0.05
"""For starting values the voltage has been near its node for this long [s]."""
FEWEST = 200
"""Samples near a node that starting values need."""


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

    def residuals(self, free: Sequence[Bingham]) -> Array:
        """(N,) measured less simulated force at the counted samples [N]."""
        values = dict(self.held) | dict(zip(self.free, free, strict=True))
        damper = damper_of(self.nodes, [values[i] for i in range(self.nodes.size)])
        parts = [
            respond(damper, motion_of(r), float(r.force[0]), INTEGRATION)[t.counted]
            for r, t in zip(self.records, self.plain.trials, strict=True)
        ]
        residuals: Array = self.plain.measured - np.concatenate(parts)
        return residuals

    def slopes(self, free: Sequence[Bingham], residuals: Array) -> Array:
        """(N, 3 f) derivatives of the simulated force by T0, C, k of each free node, by difference quotients."""
        force = self.plain.scales[0]
        columns = []
        for i, parameters in enumerate(free):
            for j in range(3):
                moved = to_search(parameters, force)
                moved[j] += DIFFERENCE
                other = [*free[:i], from_search(moved, force), *free[i + 1 :]]
                step = other[i][j] - parameters[j]
                columns.append((residuals - self.residuals(other)) / step)
        return np.stack(columns, axis=-1)

    def touched(self) -> Array:
        """(N, m) share of each node in the parameters at the counted samples."""
        return np.concatenate(
            [
                weights(self.nodes, voltage_of(r)[t.counted])
                for r, t in zip(self.records, self.plain.trials, strict=True)
            ]
        )


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


def damper_of(nodes: Array, values: Sequence[Bingham]) -> Damper:
    """The plain damper with these parameters at these voltages."""
    return Damper(
        base=tuple(
            BaseRow(voltage_V=float(u), T0_N=p.friction, C_Ns_per_m=p.damping, k_N_per_m=p.stiffness)
            for u, p in zip(nodes, values, strict=True)
        )
    )


def motion_of(record: Record) -> Motion:
    """The record's motion, its speed from the cubic through the displacement."""
    from scipy.interpolate import CubicSpline

    speed = CubicSpline(record.time, record.displacement)(record.time, 1)
    return Motion(record.time, record.displacement, speed, record.acceleration, voltage_of(record), None)


def voltage_of(record: Record) -> Array:
    """The record's voltage.

    Raises
    ------
    ValueError : when it has none
    """
    if record.voltage is None:
        raise ValueError(f"record {record.name} has no voltage")
    return record.voltage


def _at_nearest_temperature(known: list[Known], temperature: float | None, config: IdentifyConfig) -> list[Known]:
    """The conditions whose temperature is nearest: base parameters over temperature come from constant records."""

    def distance(condition: Condition) -> float:
        a, b = condition.temperature, temperature
        return 0.0 if a is None or b is None else abs(a - b)

    if not known:
        return []
    nearest = min((c for c, _ in known), key=distance).temperature
    within = config.group.temperature_degC
    return [(c, r) for c, r in known if c.temperature == nearest or _close(c.temperature, nearest, within)]


def _close(a: float | None, b: float | None, within: float) -> bool:
    return a is not None and b is not None and abs(a - b) <= within


def _fit_band(
    records: list[Record],
    temperature: float | None,
    known: list[Known],
    config: IdentifyConfig,
) -> list[ParameterRow]:
    """Fit the free nodes of one setting and temperature."""
    scale = voltage_scale([*records, *(r for c, _ in known for r in c.records)])
    voltages = [c.voltage for c, _ in known if c.voltage is not None]
    nodes = nodes_of(records, voltages, config.nodes, scale)
    held: dict[int, Bingham] = {}
    for condition, row in known:
        node = int(np.argmin(np.abs(nodes - (condition.voltage or 0.0))))
        if row.T0_N is not None and row.C_Ns_per_m is not None and row.k_N_per_m is not None:
            held[node] = Bingham(row.T0_N, row.C_Ns_per_m, row.k_N_per_m)
        else:
            records = [*records, *condition.records]
    objective = MovingObjective(tuple(records), nodes, held, Objective(tuple(_at_samples(r) for r in records)))
    if not objective.free:
        residuals = objective.residuals([])
        ratio = float(residuals @ residuals) / objective.plain.energy
        log.info("moving records: every node has constant records; with these W_s = %.3g", ratio)
        return []
    free = _descend(objective, _starts(objective, CONSTANT_SHARE * scale))
    setting = records[0].setting
    temperatures = {int(np.argmin(np.abs(nodes - (c.voltage or 0.0)))): c.temperature for c, _ in known}
    labels = [(setting, float(nodes[i]), temperatures.get(i, temperature)) for i in objective.free]
    return _rows(objective, free, labels)


def _at_samples(record: Record) -> Trial:
    """The trial of a record, without a voltage that would be missing later."""
    voltage_of(record)
    return trial_of(record)


def _starts(objective: MovingObjective, band: float) -> list[Bingham]:
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
        starts.append(fit_separable(Objective(tuple(trials))).parameters if near >= FEWEST else overall)
    return [objective.plain.clipped(s) for s in starts]


def _dwells(record: Record, node: float, window: float) -> NDArray[np.bool_]:
    """(n,) whether the voltage has been near the node for long enough."""
    outside = np.abs(voltage_of(record) - node) > window
    index = np.arange(outside.size)
    last_outside = np.maximum.accumulate(np.where(outside, index, -outside.size))
    return np.asarray(index - last_outside > SETTLED * record.rate)


def _descend(objective: MovingObjective, starts: Sequence[Bingham]) -> list[Bingham]:
    """The optimum over all free nodes together, by trust-region least squares."""
    from scipy.optimize import least_squares

    force, norm = objective.plain.scales[0], np.sqrt(objective.plain.energy)
    low, high = (np.tile(to_search(b, force), len(starts)) for b in objective.plain.bounds)

    def parameters(x: Array) -> list[Bingham]:
        return [from_search(part, force) for part in x.reshape(-1, 3)]

    def residuals_at(x: Array) -> Array:
        return np.asarray(objective.residuals(parameters(x)) / norm)

    def slopes_at(x: Array) -> Array:
        free = parameters(x)
        factors = np.concatenate([(force, p.damping, p.stiffness) for p in free])
        return np.asarray(-objective.slopes(free, objective.residuals(free)) * factors / norm)

    start = np.concatenate([to_search(s, force) for s in starts])
    found = least_squares(
        residuals_at,
        np.clip(start, low + 1e-6, high - 1e-6),
        jac=slopes_at,
        bounds=(low, high),
        x_scale="jac",
        xtol=TOLERANCE**0.75,
        ftol=TOLERANCE**0.75,
        gtol=TOLERANCE,
        max_nfev=60,
    )
    return parameters(found.x)


def _rows(
    objective: MovingObjective, free: list[Bingham], labels: list[tuple[str | None, float, float | None]]
) -> list[ParameterRow]:
    """One row a free node, judged on the samples that the node touches."""
    residuals = objective.residuals(free)
    slopes = objective.slopes(free, residuals)
    widths = uncertainty(slopes, residuals, objective.plain.lengths).half_widths().reshape(-1, 3)
    measured, energy = objective.plain.measured, objective.plain.energy
    scales = np.array([(friction_scale(p.friction, measured), p.damping, p.stiffness) for p in free])
    visible = visible_shares(slopes, scales.ravel(), energy).reshape(-1, 3)
    still = np.reshape(is_stationary(slopes, residuals, energy), (-1, 3))
    low, high = objective.plain.bounds
    touched = objective.touched()[:, objective.free] > 0.0
    rows = []
    for i, parameters in enumerate(free):
        here = touched[:, i]
        share = np.sqrt(energy / max(float(measured[here] @ measured[here]), np.finfo(float).tiny))
        evidence = [
            Evidence(
                NAMES[j],
                float(scales[i, j]),
                float(widths[i, j]),
                float(visible[i, j] * share),
                lies_at_bound(parameters[j], low[j], high[j]),
                bool(still[i, j]) or parameters[j] == 0.0,
            )
            for j in range(3)
        ]
        fitted = (measured[here], residuals[here]) if np.any(here) else (measured, residuals)
        rows.append(row_of(labels[i], parameters, widths[i], evidence, fitted))
    return rows
