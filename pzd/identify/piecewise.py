"""Criterion (4) over records whose voltage moves, the parameters being piecewise linear in the voltage."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pzd.damper.compose import respond
from pzd.damper.model import BaseRow, Damper
from pzd.damper.motion import Motion, parts_of_steps
from pzd.identify.nodes import weights
from pzd.identify.objective import Bingham, Objective
from pzd.record import Array, Record, Rows
from pzd.signals.lines import without_noise

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
        damper = damper_of(self.nodes, [values[i] for i in range(self.nodes.size)])
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
                weights(self.nodes, voltage_of(r)[t.counted])
                for r, t in zip(self.records, self.plain.trials, strict=True)
            ]
        )


def damper_of(nodes: Array, values: Sequence[Bingham]) -> Damper:
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
    return without_noise(record.voltage)
