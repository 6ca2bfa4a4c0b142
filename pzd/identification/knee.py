"""The knee law of a passive damper: its rows, the choice between it and Bingham's law, force per click and unit."""

from __future__ import annotations

import logging
from collections import defaultdict
from collections.abc import Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Literal

import numpy as np

from pzd.artefacts import ClickRow, KneeForceRow, KneeRow, Knees, LawRow, ParameterRow, PredictedRow, UnitRow
from pzd.artefacts.identified import FALLBACK
from pzd.artefacts.knee import DIRECTIONS, LawName, knee_damper
from pzd.artefacts.table import LENGTHS, PRESSURES, numbers_in
from pzd.damper.compose import static_force, steady_force
from pzd.identification.config import IdentifyConfig
from pzd.identification.intervals import half_widths
from pzd.identification.knee_fit import REFIT_EVALUATIONS, KneeData, KneeFit, descend, fit_bingham, fit_knee
from pzd.identification.prepared_record import fitted_records, prepare
from pzd.identification.trust import MISFIT_THRESHOLD, WEAK_WIDTH, Misfit, friction_scale, misfit_of
from pzd.parallel.processes import Listener, Progress
from pzd.quantities import Control
from pzd.record import SAME_TEMPERATURE, Array, Condition
from pzd.schema.errors import ConfigError
from pzd.signals.measures import criterion, rms
from pzd.signals.nuisance import NuisanceConfig
from pzd.signals.segmentation import separate_tests

log = logging.getLogger(__name__)
Labels = tuple[str | None, float | None, float | None]
"""Setting, voltage and temperature of a condition."""


def identify_knees(
    conditions: Sequence[tuple[Condition, ParameterRow]],
    settings: Sequence[str | None],
    config: IdentifyConfig,
    control: Control,
    progress: Listener,
) -> Knees:
    """The knee law of every condition, and the law that each setting hands on.

    Parameters
    ----------
    conditions : in each of which the control signal stands still, with its Bingham parameters
    settings : of the rig
    config : the config's block: which law it asks for, and what the sensors may differ by from test to test
    control : the control signal, which may be a clicker
    progress : hears of every condition that is done

    Raises
    ------
    ConfigError : when the config asks for the knee law and a setting has no test at a constant control signal
    """
    rows: list[KneeRow] = []
    forces: list[KneeForceRow] = []
    found = []
    for number, (condition, bingham) in enumerate(conditions, start=1):
        tests = KneeData.of([test for record in condition.records for test in separate_tests(record)])
        labels = (condition.setting, condition.voltage, condition.temperature)
        fit = fit_knee(tests, bingham.k_N_per_m or FALLBACK["k_N_per_m"])
        row = knee_row(labels, tests, fit, config.nuisance)
        rows.append(row)
        forces += knee_forces(row)
        found += held_out_predictions(labels, tests, fit, fit_bingham(tests, fit))
        progress(Progress(number, len(conditions), f"knee law: {_knee_text(row)}"))
    laws = []
    for setting in settings:
        if config.law == "knee" and not any(row.setting == setting for row in rows):
            of = f" of setting {setting}" if setting else ""
            raise ConfigError(
                f"identify.law: needs tests{of} at a constant control signal; in all of them it moves: record some, or "
                "say bingham (got knee)"
            )
        mine = [each for each in found if each[0].setting == setting]
        law = law_row(config.law, setting, mine, sum(row.setting == setting for row in rows))
        log.info("identify: law %s%s, %s", law.law, f" of {setting}" if setting else "", law.reason)
        laws.append(law)
    return Knees(
        tuple(rows),
        tuple(forces),
        force_per_click(forces, control),
        tuple(row for row, _ in found),
        tuple(laws),
        force_per_unit(forces, control),
    )


def _knee_text(row: KneeRow) -> str:
    place = ", ".join(str(part) for part in (row.setting, row.voltage_V, row.temperature_degC) if part is not None)
    knee = {
        "rebound": (row.rebound_knee_force_N, row.rebound_knee_velocity_m_per_s),
        "compression": (row.compression_knee_force_N, row.compression_knee_velocity_m_per_s),
    }
    told = [
        f"{way} knee {force:.4g} N at {speed:.3g} m/s" if force is not None else f"no knee in {way}"
        for way, (force, speed) in knee.items()
    ]
    return f"{place or 'all records'}: {', '.join(told)}, W_s = {row.W_s:.3g}"


# --- Rows of one condition ---

TRADE_SPEEDS = tuple(float(np.round(np.pi * 0.1 * turns / 60.0, 3)) for turns in (10, 25, 50, 75, 100, 200, 300))
"""Peak speeds of a crank of 100 mm stroke at 10 to 300 revolutions a minute, at which dampers are specified [m/s]."""
SPEED_ROUNDING = 1.001
"""A test is as fast as a speed within this factor, which its rounding to millimetres a second takes."""
NO_MISFIT = Misfit(0.0, 0.0)


def knee_row(labels: Labels, tests: KneeData, fit: KneeFit, nuisance: NuisanceConfig) -> KneeRow:
    """The row of one condition.

    Parameters
    ----------
    labels : of the condition
    tests : that were fitted
    fit : their optimum
    nuisance : what the sensors may differ by from test to test
    """
    misfit, widths = _half_widths(tests, fit, nuisance)
    curve, (force, spring) = fit.curve, fit.gas.tolist()
    values: dict[str, float] = {"friction_N": curve.friction, "gas_force_N": force, "gas_spring_N_per_m": spring}
    values["k_N_per_m"] = curve.stiffness
    for way, direction in enumerate(DIRECTIONS):
        values[f"{direction}_bleed_Ns_per_m"] = curve.bleed[way]
        if fit.form.bent[way]:
            values[f"{direction}_knee_force_N"] = curve.knee_force(way)
            values[f"{direction}_knee_velocity_m_per_s"] = curve.knee_speed[way]
            values[f"{direction}_blow_off_Ns_per_m"] = curve.blow_off[way]
    cells: dict[str, float | None] = {}
    for name in _quantities_with_interval():
        cells |= _with_interval(name, values.get(name), widths.get(name))
    return KneeRow.model_validate(
        {
            **dict(zip(("setting", "voltage_V", "temperature_degC"), labels, strict=True)),
            **cells,
            "zero_m": tests.middle,
            "reached_m_per_s": tests.fastest,
            "W_s": fit.criterion,
            "rmse_N": rms(fit.residuals),
            "missed_share": misfit.share,
            "status": _status(values, widths, misfit, tests.measured),
        }
    )


def knee_forces(row: KneeRow) -> Iterator[KneeForceRow]:
    """The force of a row at the trade's speeds, up to the first that no test reached."""
    damper, voltage = knee_damper([row]), row.voltage_V
    rest = float(static_force(damper, voltage))
    for speed in TRADE_SPEEDS:
        rebound, compression = steady_force(damper, voltage, row.temperature_degC, np.array([speed, -speed])) + rest
        inside = speed <= SPEED_ROUNDING * row.reached_m_per_s
        yield KneeForceRow(
            setting=row.setting,
            voltage_V=row.voltage_V,
            temperature_degC=row.temperature_degC,
            velocity_m_per_s=speed,
            rebound_force_N=float(rebound),
            compression_force_N=float(compression),
            gas_force_N=rest,
            inside=int(inside),
        )
        if not inside:
            return


def _half_widths(tests: KneeData, fit: KneeFit, nuisance: NuisanceConfig) -> tuple[Misfit, dict[str, float]]:
    """What the law misses, and the half widths of the 95 % intervals by column.

    The force of a knee takes the place of its speed: dF/dF_k = (dF/dw_k) / C, and T0 and C act at a constant F_k. Two
    straight lines are read off a curve that is round in any damper, so an interval holds what the same reading of other
    tests would give; what the law misses of the curve stands in the status and widens none.
    """
    form, curve = fit.form, fit.curve
    columns = ["friction_N", *(f"{name}_bleed_Ns_per_m" for name in DIRECTIONS), "k_N_per_m"]
    for way in form.ways:
        columns += [f"{DIRECTIONS[way]}_knee_velocity_m_per_s", f"{DIRECTIONS[way]}_blow_off_Ns_per_m"]
    columns += ["gas_force_N", "gas_spring_N_per_m"]
    by_force, forces = fit.slopes.copy(), list(columns)
    for way in form.ways:
        place, C = columns.index(f"{DIRECTIONS[way]}_knee_velocity_m_per_s"), curve.bleed[way]
        slope = fit.slopes[:, place] / C
        by_force[:, place] = slope
        by_force[:, 0] -= slope
        by_force[:, 1 + way] -= slope * curve.knee_speed[way]
        forces[place] = f"{DIRECTIONS[way]}_knee_force_N"
    records = [test.record for test in tests.tests]
    trials = [prepare(record) for record in records]
    misfit = misfit_of(fitted_records(records, trials, (fit.residuals, fit.slopes), nuisance))
    # Told not to be constant, a part takes the speed of the rod for that of the flow: here no one C stands for it.
    widths, of_force = (
        half_widths(
            [replace(p, constant=False) for p in fitted_records(records, trials, (fit.residuals, s), nuisance)],
            NO_MISFIT,
        )
        for s in (fit.slopes, by_force)
    )
    return misfit, dict(zip(columns, widths.tolist(), strict=True)) | {
        name: width for name, width in zip(forces, of_force.tolist(), strict=True) if name not in columns
    }


WIDEST_LOGARITHM = 20.0
"""Half width of an interval in the logarithm at most: it then says that nothing is known."""


def _quantities_with_interval() -> list[str]:
    """The columns that have an interval."""
    return [name.removesuffix("_low95") for name in KneeRow.model_fields if name.endswith("_low95")]


def _with_interval(name: str, value: float | None, width: float | None) -> dict[str, float | None]:
    """A value and its 95 % interval: in the logarithm for slopes and knees, linear for friction and gas."""
    if value is None or width is None:
        return {name: None, f"{name}_low95": None, f"{name}_high95": None}
    if name in ("friction_N", "gas_force_N", "gas_spring_N_per_m"):
        low, high = value - width, value + width
        low = max(low, 0.0) if name == "friction_N" else low
    else:
        ratio = float(np.exp(min(width / value, WIDEST_LOGARITHM)))
        low, high = value / ratio, value * ratio
    return {name: value, f"{name}_low95": low, f"{name}_high95": high}


_UNITS = ("_Ns_per_m", "_N_per_m", "_m_per_s", "_N")


def _quantity_name(column: str) -> str:
    """A column as a sentence names it: without its unit."""
    unit = next(unit for unit in _UNITS if column.endswith(unit))
    return column.removesuffix(unit).replace("_", " ")


def _status(values: Mapping[str, float], widths: Mapping[str, float], misfit: Misfit, measured: Array) -> str:
    """`ok`, or which parameters are weak and why; the gas is judged against the friction's scale."""
    least = {"friction_N": friction_scale(values["friction_N"], measured)}
    least["gas_force_N"] = max(abs(values["gas_force_N"]), least["friction_N"])
    wide = [
        f"{_quantity_name(name)} to +-{min(widths[name] / least.get(name, value), 9.99):.0%}"
        for name, value in values.items()
        if name != "gas_spring_N_per_m" and widths[name] > WEAK_WIDTH * least.get(name, value)
    ]
    missed = (
        [f"the law misses {misfit.share:.1%} of peak: the parameters are the model's, not the damper's"]
        if misfit.is_large
        else []
    )
    return f"weak: {'; '.join([*wide, *missed])}" if wide or missed else "ok"


# --- Choice of the law by held-out tests ---

LAW_FOLDS = 5
"""The tests of a condition are kept back in so many turns, or one by one where they are fewer."""
SIGNIFICANT_ERRORS = 2.0
"""Standard errors of the mean difference beyond which it is no chance; as in diagnose."""
FEWEST_TESTS = 3
"""Tests from which a standard error is worth anything."""


def held_out_predictions(
    labels: Labels, tests: KneeData, knee: KneeFit, bingham: KneeFit
) -> list[tuple[PredictedRow, Array]]:
    """Every test of a condition predicted by both laws, each fitted without it; none where the test is alone.

    Parameters
    ----------
    labels : of the condition
    tests : of the condition
    knee, bingham : the optima over all of them, where the refits begin

    Returns
    -------
    the rows, each with (4,) sums over its samples [N2]: the squared errors of Bingham and of the knee, the squares of
    the measured force, and of what is too small to see
    """
    count = len(tests.tests)
    if count < 2:
        return []
    order = np.argsort([float(np.max(np.abs(test.record.velocity))) for test in tests.tests], kind="stable")
    found = {}
    for fold in range(min(LAW_FOLDS, count)):
        out = order[fold::LAW_FOLDS].tolist()
        rest = tests.some([i for i in range(count) if i not in out])
        fits = [descend(rest, fit.form, fit.curve, fit.gas, REFIT_EVALUATIONS) for fit in (bingham, knee)]
        for i in out:
            one = tests.some([i])
            left = [one.measured - fit.predicted(one) for fit in fits]
            unseen = np.full(one.measured.size, MISFIT_THRESHOLD * one.peak)
            squares = np.array([float(r @ r) for r in (*left, one.measured, unseen)])
            found[i] = _predicted(labels, one, left), squares
    return [found[i] for i in range(count)]


def _predicted(labels: Labels, one: KneeData, left: Sequence[Array]) -> PredictedRow:
    return PredictedRow(
        record=one.tests[0].record.name,
        setting=labels[0],
        voltage_V=labels[1],
        temperature_degC=labels[2],
        W_s_bingham=criterion(left[0], one.measured),
        W_s_knee=criterion(left[1], one.measured),
    )


def law_row(
    asked: Literal["bingham", "knee", "auto"],
    setting: str | None,
    found: Sequence[tuple[PredictedRow, Array]],
    conditions: int,
) -> LawRow:
    """The law of one setting, and why.

    Equation: knee where mean d > 2 s_d / sqrt(n), d_i = W_s,i of Bingham less that of the knee, and where all tests
    together are missed visibly less                                            Source: paired differences

    Parameters
    ----------
    asked : what the config asks for
    setting : of the rig
    found : its tests, kept back in turn, with the squares of `kept_back`
    conditions : how many of the setting the knee law was fitted to
    """
    count = len(found)
    if not conditions:
        return _law(setting, "bingham", count, None, "the knee law needs tests at a constant control signal")
    squares = np.sum([each for _, each in found], axis=0) if found else None
    pooled = None if squares is None else (float(squares[0] / squares[2]), float(squares[1] / squares[2]))
    told = f"{count} tests kept back are predicted with W_s {pooled[1]:.3g} by the knee law" if pooled else ""
    told += f", {pooled[0]:.3g} by Bingham's" if pooled else ""
    if asked == "knee":
        return _law(setting, "knee", count, pooled, f"as the config asks for; {told or 'no test could be kept back'}")
    if count < FEWEST_TESTS:
        why = f"{count} tests could be kept back, and {FEWEST_TESTS} are needed to choose a law; record several in a condition"
        return _law(setting, "bingham", count, pooled, why)
    apart = np.array([row.W_s_bingham - row.W_s_knee for row, _ in found])
    mean, error = float(apart.mean()), float(np.std(apart, ddof=1) / np.sqrt(count))
    visible = squares is not None and float(squares[0] - squares[1]) > float(squares[3])
    measure = f"mean difference {mean:.2g}, its standard error {error:.2g}"
    measure += "" if visible or mean <= 0.0 else f", less than {MISFIT_THRESHOLD:.2%} of peak"
    law: LawName = "knee" if mean > SIGNIFICANT_ERRORS * error and visible else "bingham"
    return _law(setting, law, count, pooled, f"{told}; {measure}")


def _law(setting: str | None, law: LawName, tests: int, pooled: tuple[float, float] | None, reason: str) -> LawRow:
    bingham, knee = pooled or (None, None)
    return LawRow(setting=setting, law=law, tests=tests, W_s_bingham=bingham, W_s_knee=knee, reason=reason)


# --- Force per click and per unit ---# From one position of a clicker, one psi or one mm to the next, at the trade's speeds, without the gas. The number is# the control signal, as in `control: {name: rebound, unit: clicks}` or `{name: gas, unit: psi}`, or one in the name of# the setting, as in "R 3 C 12", "gas 150 psi" or "gap 0.2 mm".


@dataclass(frozen=True)
class Axis:
    """What varies from one position to the next; all else is equal."""

    setting: str | None
    """With # for the number, where it stands there."""
    voltage: float | None
    """Where the number is not the control signal itself."""
    unit: str
    """Of a pressure or a length; empty where the number counts clicks."""


@dataclass(frozen=True)
class Rise:
    """By how much magnitudes of the force rise from one position on an axis to the next one, at one speed [N]."""

    axis: Axis
    low: float
    high: float
    before: KneeForceRow
    rebound: float
    """Without the gas."""
    compression: float
    gas: float
    """Of the gas force itself, which has a sign: below zero where it pushes the rod out more."""

    @property
    def way(self) -> float:
        """From the lower position to the higher one, in the unit of the axis."""
        return self.high - self.low


def force_per_click(forces: Sequence[KneeForceRow], control: Control) -> tuple[ClickRow, ...]:
    """The force a click between neighbouring positions of every clicker, all other things equal.

    Parameters
    ----------
    forces : of every condition at the trade's speeds
    control : the control signal
    """
    return tuple(
        ClickRow(
            setting=rise.axis.setting,
            voltage_V=rise.axis.voltage,
            temperature_degC=rise.before.temperature_degC,
            from_click=rise.low,
            to_click=rise.high,
            velocity_m_per_s=rise.before.velocity_m_per_s,
            rebound_N_per_click=rise.rebound / rise.way,
            compression_N_per_click=rise.compression / rise.way,
        )
        for rise in _rises(forces, control)
        if not rise.axis.unit
    )


def force_per_unit(forces: Sequence[KneeForceRow], control: Control) -> tuple[UnitRow, ...]:
    """The force a unit of a gas pressure, gap or shim between neighbouring values, all other things equal.

    Parameters
    ----------
    forces : of every condition at the trade's speeds
    control : the control signal
    """
    return tuple(
        UnitRow(
            setting=rise.axis.setting,
            voltage_V=rise.axis.voltage,
            temperature_degC=rise.before.temperature_degC,
            unit=rise.axis.unit,
            from_value=rise.low,
            to_value=rise.high,
            velocity_m_per_s=rise.before.velocity_m_per_s,
            rebound_N_per_unit=rise.rebound / rise.way,
            compression_N_per_unit=rise.compression / rise.way,
            gas_force_N_per_unit=rise.gas / rise.way,
        )
        for rise in _rises(forces, control)
        if rise.axis.unit
    )


def _rises(forces: Sequence[KneeForceRow], control: Control) -> Iterator[Rise]:
    for axis, rows in _axes(forces, control).items():
        yield from _rises_on_axis(axis, rows)


def _axes(forces: Sequence[KneeForceRow], control: Control) -> dict[Axis, list[tuple[float, KneeForceRow]]]:
    """The rows that differ by one number alone, each with this number."""
    measured = control.unit if control.unit in PRESSURES | LENGTHS else ""
    stepped = bool(measured) or "click" in f"{control.name} {control.unit}".lower()
    found: dict[Axis, list[tuple[float, KneeForceRow]]] = defaultdict(list)
    for row in forces:
        if stepped and row.voltage_V is not None:
            found[Axis(row.setting, None, measured)].append((row.voltage_V, row))
        for number in numbers_in(row.setting):
            found[Axis(number.axis, row.voltage_V, number.unit)].append((number.value, row))
    return found


def _rises_on_axis(axis: Axis, rows: Sequence[tuple[float, KneeForceRow]]) -> Iterator[Rise]:
    """The rows of one axis: by temperature and speed, from one position to the next."""
    groups: dict[Hashable, list[tuple[float, KneeForceRow]]] = defaultdict(list)
    first: float | None = None
    for position, row in sorted(rows, key=lambda each: (each[1].temperature_degC or 0.0, each[0])):
        degrees = row.temperature_degC
        if first is None or degrees is None or degrees - first > SAME_TEMPERATURE:
            first = degrees
        groups[first, row.velocity_m_per_s].append((position, row))
    for same in groups.values():
        for (low, before), (high, after) in pairwise(sorted(same, key=lambda each: each[0])):
            if high > low:
                rebound = [row.rebound_force_N - row.gas_force_N for row in (before, after)]
                compression = [row.gas_force_N - row.compression_force_N for row in (before, after)]
                yield Rise(
                    axis,
                    low,
                    high,
                    before,
                    rebound[1] - rebound[0],
                    compression[1] - compression[0],
                    after.gas_force_N - before.gas_force_N,
                )
