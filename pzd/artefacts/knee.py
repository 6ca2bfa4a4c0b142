"""The knee law of a passive damper: bleed, knee, blow-off, gas and friction, held-out prediction, and the damper."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, Self

import numpy as np
from pydantic import Field

from pzd.artefacts.csv_rows import ConditionRow, Estimate, Files, RecordRow, read_files, write_files
from pzd.damper.effect import NODE_VOLTAGES
from pzd.damper.fitted_laws import seal
from pzd.damper.fitted_laws.knee import mean_bleed, parameters_of
from pzd.damper.model import BaseRow, Damper
from pzd.quantities import Control
from pzd.schema.model import Frozen

LawName = Literal["bingham", "knee"]
Direction = Literal["rebound", "compression"]
DIRECTIONS: tuple[Direction, ...] = ("rebound", "compression")
OF_A_DIRECTION = (
    "bleed_Ns_per_m",
    "bleed_square_Ns2_per_m2",
    "knee_force_N",
    "knee_velocity_m_per_s",
    "blow_off_Ns_per_m",
    "knee_spread_N",
)
"""The columns of a direction, behind its name."""
OF_BOTH = ("gas_force_N", "friction_N")
"""The columns that both directions share and the trade names with them."""


class KneeRow(ConditionRow):
    """The knee law of one condition; a direction without a knee has empty cells, and its bleed goes on.

    Forces and speeds of both directions are magnitudes, of the oil and the seal alone; the gas is beside them.
    """

    rebound_bleed_Ns_per_m: float = Field(gt=0.0)
    """Slope up to the knee; at standstill, where there is a square part."""
    rebound_bleed_Ns_per_m_low95: float
    rebound_bleed_Ns_per_m_high95: float
    rebound_bleed_square_Ns2_per_m2: float | None = Field(default=None, ge=0.0)
    """Force over the square of the speed, beside it; empty where the bleed is straight."""
    rebound_bleed_square_Ns2_per_m2_low95: float | None = None
    rebound_bleed_square_Ns2_per_m2_high95: float | None = None
    rebound_knee_force_N: float | None = Field(ge=0.0)
    """Where bleed and blow-off meet, with the seal friction and without the gas; a round knee stays off it."""
    rebound_knee_force_N_low95: float | None
    rebound_knee_force_N_high95: float | None
    rebound_knee_velocity_m_per_s: float | None = Field(gt=0.0)
    rebound_knee_velocity_m_per_s_low95: float | None
    rebound_knee_velocity_m_per_s_high95: float | None
    rebound_blow_off_Ns_per_m: float | None = Field(gt=0.0)
    """Slope beyond the knee."""
    rebound_blow_off_Ns_per_m_low95: float | None
    rebound_blow_off_Ns_per_m_high95: float | None
    rebound_knee_spread_N: float | None = Field(default=None, gt=0.0)
    """Scale of the forces about that one over which the valve opens; empty where the knee is sharp."""
    rebound_knee_spread_N_low95: float | None = None
    rebound_knee_spread_N_high95: float | None = None
    compression_bleed_Ns_per_m: float = Field(gt=0.0)
    compression_bleed_Ns_per_m_low95: float
    compression_bleed_Ns_per_m_high95: float
    compression_bleed_square_Ns2_per_m2: float | None = Field(default=None, ge=0.0)
    compression_bleed_square_Ns2_per_m2_low95: float | None = None
    compression_bleed_square_Ns2_per_m2_high95: float | None = None
    compression_knee_force_N: float | None = Field(ge=0.0)
    compression_knee_force_N_low95: float | None
    compression_knee_force_N_high95: float | None
    compression_knee_velocity_m_per_s: float | None = Field(gt=0.0)
    compression_knee_velocity_m_per_s_low95: float | None
    compression_knee_velocity_m_per_s_high95: float | None
    compression_blow_off_Ns_per_m: float | None = Field(gt=0.0)
    compression_blow_off_Ns_per_m_low95: float | None
    compression_blow_off_Ns_per_m_high95: float | None
    compression_knee_spread_N: float | None = Field(default=None, gt=0.0)
    compression_knee_spread_N_low95: float | None = None
    compression_knee_spread_N_high95: float | None = None
    friction_N: float = Field(ge=0.0)
    """Seal friction T0, the same in both directions: half of what the force changes by where the rod turns round."""
    friction_N_low95: float
    friction_N_high95: float
    seal_m_per_s: float | None = Field(default=None, gt=0.0)
    """v_s, the speed of the rod by which its friction has turned round; empty where friction does not act on the rod,
    but on the flow behind the oil spring."""
    seal_m_per_s_low95: float | None = None
    seal_m_per_s_high95: float | None = None
    gas_force_N: float
    """F_0, the force beside the element at `zero_m`; below zero where the gas pushes the rod out. 0 where no test shows
    one: then all else is fitted without it."""
    gas_force_N_low95: float
    gas_force_N_high95: float
    gas_spring_N_per_m: float
    """k_g, by how much it rises with the displacement."""
    gas_spring_N_per_m_low95: float
    gas_spring_N_per_m_high95: float
    k_N_per_m: float = Field(gt=0.0)
    """Stiffness of the oil spring."""
    k_N_per_m_low95: float
    k_N_per_m_high95: float
    zero_m: float
    """Middle of the motion of the condition's tests, in the displacement as recorded."""
    reached_m_per_s: float = Field(gt=0.0)
    """Largest speed of the tests."""
    W_s: float = Field(ge=0.0)
    """Criterion (4) over the samples that the row was fitted to."""
    rmse_N: float = Field(ge=0.0)
    missed_share: float = Field(ge=0.0)
    """R.m.s. residual of the law beyond noise, as a share of peak force; 0 where noise alone explains it."""
    status: str = Field(pattern=r"^(ok|weak: .*)$")
    """`ok`, or `weak: ...` with the parameters and the reason."""

    @property
    def friction_on_rod(self) -> float:
        """Friction of a seal on the rod, beside the oil [N]."""
        return 0.0 if self.seal_m_per_s is None else self.friction_N

    @property
    def friction_of_flow(self) -> float:
        """T0 of the element, behind the oil spring [N]."""
        return self.friction_N - self.friction_on_rod


class KneeForceRow(ConditionRow):
    """Force of the knee law at one of the trade's speeds, as a rig records it: with the gas force at mid-stroke."""

    velocity_m_per_s: float = Field(gt=0.0)
    """Of either direction."""
    rebound_force_N: float
    compression_force_N: float
    gas_force_N: float
    """What of both the gas makes."""
    inside: int = Field(ge=0, le=1)
    """1 where a test was as fast, 0 where the law is the model beyond."""


class ClickRow(ConditionRow):
    """Force a click at one of the trade's speeds, between two neighbouring positions.

    The setting has # for the number of the clicker, where that stands in it and not in the control signal.
    """

    from_click: float
    to_click: float
    velocity_m_per_s: float = Field(gt=0.0)
    rebound_N_per_click: float
    """By how much the magnitude of the force rises a click; below zero where it falls."""
    compression_N_per_click: float


class UnitRow(ConditionRow):
    """Force a unit of a gas pressure, gap or shim at one of the trade's speeds.

    The setting has # for that number, where it stands in it and not in the control signal.
    """

    unit: str
    """Of the number, as it was written: psi, bar, mm, ..."""
    from_value: float
    to_value: float
    velocity_m_per_s: float = Field(gt=0.0)
    rebound_N_per_unit: float
    """By how much the magnitude of the force rises a unit, without the gas; below zero where it falls."""
    compression_N_per_unit: float
    gas_force_N_per_unit: float | None
    """By how much the gas force itself changes; below zero where the gas pushes the rod out more. None where the tests
    tell none from a rebound unlike compression: what it changes by is then in both of these."""


class PredictedRow(RecordRow):
    """One held-out test, predicted by both laws, each fitted without it."""

    W_s_bingham: float = Field(ge=0.0)
    """Of one T0 and C, with the same oil spring, gas force and gas spring beside it as the knee has."""
    W_s_knee: float = Field(ge=0.0)


class LawRow(Frozen):
    """The law of one setting that identify adopts, and why."""

    setting: str | None
    law: LawName
    tests: int = Field(ge=0)
    """Tests that were held out in turn."""
    W_s_bingham: float | None
    """Criterion (4) over all of them."""
    W_s_knee: float | None
    reason: str


UNSHOWN = 30.0
"""Times the force of the tests (r.m.s.), or what makes it at their speed, from which a number of the law is not shown.

Reason: no bleed, knee or blow-off of a damper is so far beyond what was run on it; not tuned."""


@dataclass(frozen=True)
class DirectionOfCondition:
    """Force at the trade's speeds, and the knee law, of one direction of one condition."""

    row: KneeRow
    direction: Direction
    forces: tuple[float | None, ...]
    """(s,) force as a rig records it, at the speeds of `Knees.speeds` [N]; None where the row has none."""
    inside: tuple[bool, ...]
    """(s,) whether a test was as fast."""

    def estimate(self, column: str) -> Estimate:
        """Return one of `OF_A_DIRECTION` or `OF_BOTH` with its 95 % interval; no value where there is no knee."""
        return Estimate.of(self.row, column if column in OF_BOTH else f"{self.direction}_{column}")

    def shows(self, column: str) -> bool:
        """Whether the tests tell one of these at all: its interval ends below `UNSHOWN` times what they reached."""
        high = self.estimate(column).high95
        if high is None or self.row.W_s <= 0.0:
            return True
        force, speed = self.row.rmse_N / self.row.W_s**0.5, self.row.reached_m_per_s
        by_unit = {"_Ns2_per_m2": force / speed**2, "_Ns_per_m": force / speed, "_m_per_s": speed, "_N": force}
        return bool(high <= UNSHOWN * next(size for unit, size in by_unit.items() if column.endswith(unit)))


@dataclass(frozen=True)
class Knees:
    """The knee law of every condition; empty where the config asks for Bingham alone."""

    rows: tuple[KneeRow, ...] = ()
    forces: tuple[KneeForceRow, ...] = ()
    clicks: tuple[ClickRow, ...] = ()
    predicted: tuple[PredictedRow, ...] = ()
    laws: tuple[LawRow, ...] = ()
    per_unit: tuple[UnitRow, ...] = ()

    def write(self, folder: Path, control: Control) -> None:
        """Write the files named in `KNEES` where the config asks for the law."""
        if self.laws:
            write_files(self, KNEES, folder, control)

    @classmethod
    def read(cls, folder: Path, control: Control) -> Self:
        """Read and check them again; an earlier version wrote all but the force a unit."""
        if not (folder / "law.csv").is_file():
            return cls()
        return cls(**read_files(KNEES, folder, control, ("per_unit",)))

    @property
    def speeds(self) -> tuple[float, ...]:
        """(s,) the trade's speeds at which a force is given, rising [m/s]."""
        return tuple(sorted({row.velocity_m_per_s for row in self.forces}))

    def directions(self) -> tuple[DirectionOfCondition, ...]:
        """Return every direction of every condition, rebound first."""
        at = {(*row.condition, row.velocity_m_per_s): row for row in self.forces}
        return tuple(
            DirectionOfCondition(
                row,
                direction,
                tuple(None if f is None else float(getattr(f, f"{direction}_force_N")) for f in here),
                tuple(f is not None and f.inside == 1 for f in here),
            )
            for row in self.rows
            for here in [[at.get((*row.condition, v)) for v in self.speeds]]
            for direction in DIRECTIONS
        )

    def law_of(self, setting: str | None) -> LawName:
        """Return the adopted law of a setting."""
        return next((row.law for row in self.laws if row.setting == setting), "bingham")

    def of(self, setting: str | None) -> tuple[KneeRow, ...]:
        """Return the rows of a setting."""
        return tuple(row for row in self.rows if row.setting == setting)


KNEES: Files = {
    "rows": ("knee.csv", KneeRow),
    "forces": ("knee_force.csv", KneeForceRow),
    "clicks": ("clicks.csv", ClickRow),
    "per_unit": ("per_unit.csv", UnitRow),
    "predicted": ("kept_back.csv", PredictedRow),
    "laws": ("law.csv", LawRow),
}


def knee_damper(rows: Sequence[KneeRow]) -> Damper:
    """Return the damper of one setting by the knee law: a base row a condition, knee, seal and gas as effects.

    Gas force and gas spring are left out where the fit of every condition went without them. Effects know no
    temperature: where a voltage was tested at several, theirs are the mean, and so is the friction of a seal; T0, C and
    k are of each.

    Parameters
    ----------
    rows : of one setting, at least one
    """
    from pzd.damper.parameter_rows import rows_per_voltage  # here, since it needs numba

    displacement_zero = float(np.mean([row.zero_m for row in rows]))

    def gas_force(row: KneeRow) -> float:
        return row.gas_force_N + row.gas_spring_N_per_m * (displacement_zero - row.zero_m)

    base = tuple(
        BaseRow(
            voltage_V=row.voltage_V,
            temperature_degC=row.temperature_degC,
            T0_N=row.friction_of_flow,
            C_Ns_per_m=mean_bleed(row.rebound_bleed_Ns_per_m, row.compression_bleed_Ns_per_m),
            k_N_per_m=row.k_N_per_m,
        )
        for row in rows
    )
    # Labels of one level at two temperatures may differ a little.
    of_base = {id(each): row for each, row in zip(base, rows, strict=True)}
    groups = rows_per_voltage(base)
    parts = [[of_base[id(each)] for each in group] for _, group in groups]
    effects = {
        "seal": [_mean([_seal(row) for row in part]) for part in parts],
        "knee": [_mean([_knee(row) for row in part]) for part in parts],
        "preload_offset": [_mean([{"F_0": gas_force(row)} for row in part]) for part in parts],
        "gas_spring": [_mean([{"k_g": row.gas_spring_N_per_m} for row in part]) for part in parts],
    }
    shown = {
        "knee": True,
        "seal": any(row.seal_m_per_s is not None for row in rows),
        "preload_offset": any(row.gas_force_N != 0.0 for row in rows),
        "gas_spring": any(row.gas_spring_N_per_m != 0.0 for row in rows),
    }
    given = [voltage for voltage, group in groups if group[0].voltage_V is not None]
    return Damper(
        base=base,
        effects={name: _per_voltage(values, given) for name, values in effects.items() if shown[name]},
        zero_m=displacement_zero,
    )


def _seal(row: KneeRow) -> dict[str, float]:
    """Return the parameters of the law `seal`."""
    return {"F_s": row.friction_on_rod, "v_s": row.seal_m_per_s or seal.EFFECT.parameter("v_s").neutral}


def _knee(row: KneeRow) -> dict[str, float]:
    """Return the parameters of the law `knee`, whose forces are those of the oil."""
    forces = (
        None if force is None else force - row.friction_on_rod
        for force in (row.rebound_knee_force_N, row.compression_knee_force_N)
    )
    return parameters_of(
        (row.rebound_bleed_Ns_per_m, row.compression_bleed_Ns_per_m),
        (row.rebound_bleed_square_Ns2_per_m2 or 0.0, row.compression_bleed_square_Ns2_per_m2 or 0.0),
        (next(forces), next(forces)),
        (row.rebound_blow_off_Ns_per_m, row.compression_blow_off_Ns_per_m),
        (row.rebound_knee_spread_N or 0.0, row.compression_knee_spread_N or 0.0),
    )


def _mean(values: Sequence[dict[str, float]]) -> dict[str, float]:
    return {name: float(np.mean([each[name] for each in values])) for name in values[0]}


def _per_voltage(values: Sequence[dict[str, float]], voltages: Sequence[float]) -> dict[str, float | tuple[float, ...]]:
    """Return one number each, or lists beside `at_voltage_V` where there are several voltages."""
    if len(values) == 1:
        return dict(values[0])
    lists = {name: tuple(each[name] for each in values) for name in values[0]}
    return {**lists, NODE_VOLTAGES: tuple(voltages)}
