"""The knee law of passive dampers: parameters of every condition, choice of the law, force per click and per unit."""

from __future__ import annotations

import logging
from collections import defaultdict
from collections.abc import Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Literal

import numpy as np

from pzd.artefacts import ClickRow, KneeForceRow, KneeRow, Knees, LawRow, ParameterRow, PredictedRow, UnitRow
from pzd.artefacts.knee import DIRECTIONS, OF_A_DIRECTION, LawName, knee_damper
from pzd.artefacts.table import LENGTHS, PRESSURES, numbers_in
from pzd.damper.compose import static_force, steady_force
from pzd.damper.model import Damper
from pzd.fit.cross_validation import (
    FEWEST_TESTS,
    PredictionError,
    log_ratios,
    standard_error,
    student_errors,
)
from pzd.identification.config import IdentifyConfig
from pzd.identification.intervals import half_widths, interval_columns, label_columns
from pzd.identification.knee_fit import (
    DESCRIBES,
    GAS_FORCE,
    GAS_SPRING,
    KneeCurve,
    KneeData,
    KneeFit,
    fit_bingham,
    fit_knees,
    held_out_errors,
    without_gas,
)
from pzd.identification.prepared_record import fitted_records, prepare, split_by_record
from pzd.identification.trust import NOT_CONVERGED, OF_THE_MODEL, WEAK_WIDTH, Misfit, friction_scale, misfit_of
from pzd.parallel.processes import Listener, Progress
from pzd.quantities import Control
from pzd.record import SAME_TEMPERATURE, Condition, Labels, Record
from pzd.schema.errors import ConfigError
from pzd.signals.measures import VISIBLE, rms
from pzd.signals.nuisance import NO_NUISANCE, NuisanceConfig
from pzd.signals.segmentation import separate_tests

log = logging.getLogger(__name__)


STIFF = 1e8
"""Stiffness from which a knee is searched where the Bingham fit has none [N/m]."""


def identify_knees(
    conditions: Sequence[tuple[Condition, ParameterRow]],
    settings: Sequence[str | None],
    config: IdentifyConfig,
    control: Control,
    progress: Listener,
) -> Knees:
    """Identify the knee law of every condition, and choose the law of each setting.

    Parameters
    ----------
    conditions : of constant control signal, with their Bingham parameters
    settings : of the rig
    config : the law asked for, and standard deviations of what differs from test to test
    control : the control signal, which may be a clicker
    progress : called with every condition of a setting, when all of them are fitted

    Raises
    ------
    ConfigError : when the config asks for the knee law and a setting has no test at a constant control signal
    """
    by_setting: dict[str | None, list[FittedCondition]] = {}
    for setting in dict.fromkeys(condition.labels[0] for condition, _ in conditions):
        of_setting = [
            (condition.labels, [test for record in condition.records for test in separate_tests(record)], _start(row))
            for condition, row in conditions
            if condition.labels[0] == setting
        ]
        by_setting[setting] = _with_gas_that_shows(_fitted(of_setting, config.nuisance), config.nuisance)
        done = sum(map(len, by_setting.values()))
        for number, each in enumerate(by_setting[setting], start=done - len(of_setting) + 1):
            progress(Progress(number, len(conditions), f"knee law: {_knee_text(each.row)}"))
    fitted = [each for mine in by_setting.values() for each in mine]
    rows = [each.row for each in fitted]
    forces = [force for row in rows for force in knee_forces(row)]
    found, described = [], []
    for each in fitted:
        without = fit_bingham(each.tests, each.fit)
        found += held_out_predictions(each.labels, each.tests, each.fit, without)
        described.append((each.row.setting, _left_of(without, each.fit, each.tests)))
    laws = []
    for setting in settings:
        if config.law == "knee" and not any(row.setting == setting for row in rows):
            of = f" of setting {setting}" if setting else ""
            raise ConfigError(
                f"identify.law: needs tests{of} at a constant control signal; in all of them it moves: record some, or "
                "say bingham (got knee)"
            )
        mine = [each for each in found if each[0].setting == setting]
        law = law_row(config.law, setting, mine, [left for of, left in described if of == setting])
        log.info("identify: law %s%s, %s", law.law, f" of {setting}" if setting else "", law.reason)
        laws.append(law)
    clicks, units = force_changes(forces, control)
    return Knees(tuple(rows), tuple(forces), clicks, tuple(row for row, _, _ in found), tuple(laws), units)


@dataclass(frozen=True, eq=False)
class FittedCondition:
    """The knee law fitted to one condition."""

    labels: Labels
    tests: KneeData
    fit: KneeFit
    row: KneeRow

    @classmethod
    def of(cls, labels: Labels, tests: KneeData, fit: KneeFit, nuisance: NuisanceConfig) -> FittedCondition:
        """Describe an optimum of one condition."""
        return cls(labels, tests, fit, knee_row(labels, tests, fit, nuisance))


TestsOfCondition = tuple[Labels, Sequence[Record], float]
"""Labels and tests of a condition, and the stiffness of the oil spring at which the search begins [N/m]."""


def fitted_knee_damper(conditions: Sequence[TestsOfCondition]) -> Damper:
    """Fit the knee law to the tests of some conditions, and return the damper with it."""
    return knee_damper([each.row for each in _fitted(conditions, NO_NUISANCE)])


def _fitted(conditions: Sequence[TestsOfCondition], nuisance: NuisanceConfig) -> list[FittedCondition]:
    """Fit the knee law to the conditions of one damper."""
    tests = [KneeData.of(records) for _, records, _ in conditions]
    fits = fit_knees([(data, stiffness) for data, (_, _, stiffness) in zip(tests, conditions, strict=True)])
    return [
        FittedCondition.of(labels, data, fit, nuisance)
        for (labels, _, _), data, fit in zip(conditions, tests, fits, strict=True)
    ]


def _start(bingham: ParameterRow) -> float:
    """Return the stiffness of the oil spring at which the search begins [N/m]."""
    return bingham.k_N_per_m or bingham.k_N_per_m_low95 or STIFF


def _with_gas_that_shows(fitted: Sequence[FittedCondition], nuisance: NuisanceConfig) -> list[FittedCondition]:
    """Leave gas spring and gas force of a setting out where the interval of each of its conditions holds zero.

    One after the other, each time with all else fitted again: what is taken out of a joint fit moves the rest.
    """
    fitted = list(fitted)
    for term in (GAS_SPRING, GAS_FORCE):
        if any(_excludes_zero(each.row, GAS_COLUMNS[term]) for each in fitted):
            continue
        fits = [without_gas(each.tests, each.fit, term) for each in fitted]
        fitted = [FittedCondition.of(e.labels, e.tests, fit, nuisance) for e, fit in zip(fitted, fits, strict=True)]
    return fitted


def _excludes_zero(row: KneeRow, column: str) -> bool:
    """Whether the interval of a column does not hold zero."""
    low, high = getattr(row, f"{column}_low95"), getattr(row, f"{column}_high95")
    return bool(low * high > 0.0)


def _knee_text(row: KneeRow) -> str:
    """Return the knees of one condition as a line of progress."""
    place = ", ".join(str(part) for part in (row.setting, row.voltage_V, row.temperature_degC) if part is not None)
    knee = {
        "rebound": (row.rebound_knee_force_N, row.rebound_knee_velocity_m_per_s),
        "compression": (row.compression_knee_force_N, row.compression_knee_velocity_m_per_s),
    }
    knees = [
        f"{way} knee {force:.4g} N at {speed:.3g} m/s" if force is not None else f"no knee in {way}"
        for way, (force, speed) in knee.items()
    ]
    return f"{place or 'all records'}: {', '.join(knees)}, W_s = {row.W_s:.3g}"


# --- Rows of one condition ---

TRADE_SPEEDS = tuple(float(np.round(np.pi * 0.1 * turns / 60.0, 3)) for turns in (10, 25, 50, 75, 100, 200, 300))
"""Speeds at which dampers are specified [m/s]: peaks of a crank of 100 mm stroke at 10 to 300 revolutions a minute."""
SPEED_ROUNDING = 1.001
"""Factor within which a test reaches a speed, which is rounded to millimetres a second."""
NO_FRICTION = 1e-9
"""Friction, as a share of the peak force, that is none: a search that ends at its limit of 0 leaves 1e-14 N."""
NO_MISFIT = Misfit(0.0, 0.0)
GAS_COLUMNS = ("gas_force_N", "gas_spring_N_per_m")
"""Columns of the terms of the gas, gas force and gas spring."""


def knee_row(labels: Labels, tests: KneeData, fit: KneeFit, nuisance: NuisanceConfig) -> KneeRow:
    """Return the row of one condition.

    Parameters
    ----------
    labels : of the condition
    tests : that were fitted
    fit : their optimum
    nuisance : standard deviations of what differs from test to test
    """
    misfit, widths = _half_widths(tests, fit, nuisance)
    curve, (force, spring) = fit.curve, fit.gas.tolist()
    friction = curve.friction if curve.friction > NO_FRICTION * tests.peak else 0.0
    values: dict[str, float] = {"friction_N": friction, "gas_force_N": force, "gas_spring_N_per_m": spring}
    values["k_N_per_m"] = curve.stiffness
    bent = ["friction_N"]  # what may be none
    for way, direction in enumerate(DIRECTIONS):
        bleed, square, *of_knee, spread = (f"{direction}_{column}" for column in OF_A_DIRECTION)
        values[bleed] = curve.bleed[way]
        if fit.form.has_square[way]:
            values[square] = curve.square[way]
            bent.append(bleed)
        if fit.form.has_knee[way]:
            shape = _force_of_knee(curve, way), curve.knee_speed[way], curve.blow_off[way]
            values |= zip(of_knee, shape, strict=True)
        if fit.form.has_round_knee[way]:
            values[spread] = curve.spread[way]
    if curve.seal_speed is not None:
        values["seal_m_per_s"] = curve.seal_speed
    cells: dict[str, float | None] = {}
    for name in (field.removesuffix("_low95") for field in KneeRow.model_fields if field.endswith("_low95")):
        nonnegative = name in bent or "square" in name
        scale = "positive" if nonnegative else "linear" if name.startswith("gas") else "log"
        left_out = name in GAS_COLUMNS and name not in widths
        width = 0.0 if left_out else widths.get(name)
        cells |= interval_columns(name, values.get(name), width, scale, WIDEST_LOGARITHM)
    return KneeRow.model_validate(
        {
            **label_columns(labels),
            **cells,
            "zero_m": tests.middle,
            "reached_m_per_s": tests.fastest,
            "W_s": fit.criterion,
            "rmse_N": rms(fit.residuals),
            "missed_share": misfit.share,
            "status": _status(values, widths, fit, misfit, tests),
        }
    )


def _force_of_knee(curve: KneeCurve, way: int) -> float:
    """Return the force at a knee with all friction [N], of the flow or on the rod."""
    return curve.knee_force(way) + curve.friction - curve.friction_of_flow


def knee_forces(row: KneeRow) -> Iterator[KneeForceRow]:
    """Yield the force of a row at the trade's speeds, up to the first that no test reached."""
    damper, voltage = knee_damper([row]), row.voltage_V
    rest = float(static_force(damper, voltage))
    for speed in TRADE_SPEEDS:
        rebound, compression = steady_force(damper, voltage, row.temperature_degC, np.array([speed, -speed])) + rest
        inside = speed <= SPEED_ROUNDING * row.reached_m_per_s
        yield KneeForceRow(
            **label_columns((row.setting, row.voltage_V, row.temperature_degC)),
            velocity_m_per_s=speed,
            rebound_force_N=float(rebound),
            compression_force_N=float(compression),
            gas_force_N=rest,
            inside=int(inside),
        )
        if not inside:
            return


def _half_widths(tests: KneeData, fit: KneeFit, nuisance: NuisanceConfig) -> tuple[Misfit, dict[str, float]]:
    """Return the misfit of the law, and the half widths of the 95 % intervals by column.

    For the force of a knee it replaces its speed as parameter: dF/dF_k = (dF/dw_k) / (C + 2 q w_k), and T0, C and q act
    at constant F_k. The curve of any damper is round and the two lines are a reading of it: an interval holds what the
    same reading of other tests would give; the misfit of the law stands in the status and widens no interval.
    """
    form, curve = fit.form, fit.curve
    columns = ["friction_N", *(f"{name}_bleed_Ns_per_m" for name in DIRECTIONS), "k_N_per_m"]
    for way in form.directions_with_knee:
        columns += [f"{DIRECTIONS[way]}_knee_velocity_m_per_s", f"{DIRECTIONS[way]}_blow_off_Ns_per_m"]
    columns += [f"{DIRECTIONS[way]}_bleed_square_Ns2_per_m2" for way in form.directions_with_square]
    columns += [f"{DIRECTIONS[way]}_knee_spread_N" for way in form.directions_with_round_knee]
    columns += ["seal_m_per_s"] * form.has_seal
    columns += [GAS_COLUMNS[term] for term in form.gas_terms]
    by_force, forces = fit.slopes.copy(), list(columns)
    for way in form.directions_with_knee:
        place, w = columns.index(f"{DIRECTIONS[way]}_knee_velocity_m_per_s"), curve.knee_speed[way]
        slope = fit.slopes[:, place] / (curve.bleed[way] + 2.0 * curve.square[way] * w)
        by_force[:, place] = slope
        by_force[:, 0] -= slope
        by_force[:, 1 + way] -= slope * w
        if form.has_square[way]:
            by_force[:, columns.index(f"{DIRECTIONS[way]}_bleed_square_Ns2_per_m2")] -= slope * w**2
        forces[place] = f"{DIRECTIONS[way]}_knee_force_N"
    records = [test.record for test in tests.tests]
    prepared = [prepare(record) for record in records]
    fitted = [
        fitted_records(records, prepared, split_by_record(prepared, fit.residuals, slopes), nuisance)
        for slopes in (fit.slopes, by_force)
    ]
    # Records that are not constant use the speed of the rod for that of the flow: here no single C stands for it.
    widths, of_force = (half_widths([replace(r, constant=False) for r in each], NO_MISFIT) for each in fitted)
    by_column = dict(zip(forces, of_force.tolist(), strict=True)) | dict(zip(columns, widths.tolist(), strict=True))
    return misfit_of(fitted[0]), by_column


WIDEST_LOGARITHM = 20.0
"""Largest half width of an interval in the logarithm: nothing is known then."""


_UNITS = ("_Ns2_per_m2", "_Ns_per_m", "_N_per_m", "_m_per_s", "_N")


def _quantity_name(column: str) -> str:
    """Return the name of a column in words, without its unit."""
    unit = next(unit for unit in _UNITS if column.endswith(unit))
    return column.removesuffix(unit).replace("_", " ")


UNJUDGED = ("gas_spring_N_per_m", "seal_m_per_s")
"""Columns that make no status weak: a spring of the gas may be next to none, as may the speed of a seal."""


def _status(
    values: Mapping[str, float], widths: Mapping[str, float], fit: KneeFit, misfit: Misfit, tests: KneeData
) -> str:
    """Return `ok`, or the weak parameters with the reason.

    The gas is judged against the scale of the friction, both parts of a bleed against its force at the knee, or at the
    largest speed without one: either may be next to none. The spread of a knee is judged against its force.
    """
    least = {"friction_N": friction_scale(values["friction_N"], rms(tests.measured))}
    least["gas_force_N"] = max(abs(values["gas_force_N"]), least["friction_N"])
    for way in fit.form.directions_with_square:
        bleed, square, *_ = (f"{DIRECTIONS[way]}_{column}" for column in OF_A_DIRECTION)
        w = min(fit.curve.knee_speed[way], tests.fastest)
        least[bleed] = values[bleed] + values[square] * w
        least[square] = least[bleed] / w
    for way in fit.form.directions_with_round_knee:
        _, _, knee_force, _, _, spread = (f"{DIRECTIONS[way]}_{column}" for column in OF_A_DIRECTION)
        least[spread] = values[knee_force]
    weak = [
        f"{_quantity_name(name)} to +-{min(widths[name] / least.get(name, value), 9.99):.0%}"
        for name, value in values.items()
        if name not in UNJUDGED and widths.get(name, 0.0) > WEAK_WIDTH * least.get(name, value)
    ]
    if not fit.converged:
        weak.append(NOT_CONVERGED)
    if misfit.is_large:
        weak.append(f"the law misses {misfit.share:.1%} of peak: {OF_THE_MODEL}")
    return f"weak: {'; '.join(weak)}" if weak else "ok"


# --- Choice of the law by held-out tests ---

HeldOutLaws = tuple[PredictedRow, tuple[float, ...], tuple[float, ...]]
"""A held-out test: its row, and the entry of a `PredictionError` of Bingham's and of the knee law."""


def held_out_predictions(labels: Labels, tests: KneeData, knee: KneeFit, bingham: KneeFit) -> list[HeldOutLaws]:
    """Predict every test of a condition by both laws, each fitted without it; none where the test is alone.

    Parameters
    ----------
    labels : of the condition
    tests : of the condition
    knee, bingham : the optima over all tests, at which the refits start
    """
    found: list[HeldOutLaws] = []
    for test, (of_bingham, of_knee) in zip(tests.tests, held_out_errors(tests, bingham, knee), strict=False):
        W_s_bingham, W_s_knee = (error / force for error, force, *_ in (of_bingham, of_knee))
        name = test.record.name
        row = PredictedRow(record=name, **label_columns(labels), W_s_bingham=W_s_bingham, W_s_knee=W_s_knee)
        found.append((row, of_bingham, of_knee))
    return found


def _left_of(bingham: KneeFit, knee: KneeFit, tests: KneeData) -> float:
    """Return the share of the squared error of Bingham's law that the knee law leaves; what is invisible is none."""
    of_knee, of_bingham = (float(fit.residuals @ fit.residuals) + tests.invisible for fit in (knee, bingham))
    return of_knee / of_bingham


def law_row(
    asked: Literal["bingham", "knee", "auto"],
    setting: str | None,
    found: Sequence[HeldOutLaws],
    left: Sequence[float],
) -> LawRow:
    """Choose the law of one setting.

    The knee law where it predicts better beyond chance by the ratios of the errors, and visibly over all; the
    differences of W_s, which the slowest test rules, are not asked: friction is all of its force. Few tests seldom tell
    more than chance, since the fastest is beyond all that is left to fit: there the knee law is taken where it
    describes every condition far better.

    Equation: mean d > t s_d / sqrt(n), d of `log_ratios`, t of `student_errors`    Source: Student 1908, paired t-test

    Parameters
    ----------
    asked : law that the config asks for
    setting : of the rig
    found : its held-out tests
    left : what the knee law leaves in each condition of the W_s that Bingham's leaves, both fitted to all of its tests

    Returns
    -------
    the law, with the reason
    """
    count = len(found)
    bingham = PredictionError.of_entries(range(count), [of_bingham for _, of_bingham, _ in found])
    knee = PredictionError.of_entries(range(count), [of_knee for _, _, of_knee in found])
    comparison = f"{count} tests kept back are predicted with W_s {knee.criterion:.3g} by the knee law" if count else ""
    comparison += f", {bingham.criterion:.3g} by Bingham's" if count else ""
    law: LawName = "bingham"
    if not left:
        reason = "the knee law needs tests at a constant control signal"
    elif asked == "knee":
        law, reason = "knee", f"as the config asks for; {comparison or 'no test could be kept back'}"
    elif count < FEWEST_TESTS:
        reason = f"{count} tests could be kept back, and {FEWEST_TESTS} are needed to choose a law; "
        reason += "record several in a condition"
    else:
        ratios = log_ratios(knee, bingham)
        mean, least = float(ratios.mean()), student_errors(count) * standard_error(ratios)
        visible = knee.visibly_below(bingham)
        describes = abs(mean) <= least and max(left) < DESCRIBES
        law = "knee" if (visible and mean > least) or describes else "bingham"
        better = sum(row.W_s_knee < row.W_s_bingham for row, _, _ in found)
        reason = (
            f"{comparison}; better in {better} of {count}, by {np.exp(mean):.3g} in the geometric mean where chance "
        )
        reason += f"makes up to {np.exp(least):.3g}"
        reason += "" if visible or mean <= 0.0 else f", and by less than {VISIBLE:.2%} of peak"
        reason += f"; fitted to all tests it leaves {max(left):.0%} of W_s at most, and is taken" if describes else ""
    pooled = {"W_s_bingham": bingham.criterion, "W_s_knee": knee.criterion}
    return LawRow(setting=setting, law=law, tests=count, **pooled, reason=reason)


# --- Force per click and per unit ---
#
# From one position of a clicker, one psi or one mm to the next, at the trade's speeds, without the gas. The number is
# the control signal, as in `control: {name: rebound, unit: clicks}` or `{name: gas, unit: psi}`, or one in the name of
# the setting, as in "R 3 C 12", "gas 150 psi" or "gap 0.2 mm".


@dataclass(frozen=True)
class Axis:
    """The quantity that varies from one position to the next, all else being equal."""

    setting: str | None
    """Name of the setting, with # for the number where it holds it."""
    voltage: float | None
    """Voltage, where the number is not the control signal itself."""
    unit: str
    """Unit of a pressure or length; empty where the number counts clicks."""


def force_changes(forces: Sequence[KneeForceRow], control: Control) -> tuple[tuple[ClickRow, ...], tuple[UnitRow, ...]]:
    """Compute the change of force per click of every clicker, and per unit of a gas pressure, gap or shim.

    Parameters
    ----------
    forces : of every condition at the trade's speeds
    control : the control signal

    Returns
    -------
    rows between neighbouring positions, all other things equal
    """
    clicks: list[ClickRow] = []
    units: list[UnitRow] = []
    for axis, rows in _axes(forces, control).items():
        for low, before, high, after in _neighbours(rows):
            # Magnitudes without the gas force, which has a sign: below zero where it pushes the rod out. Where either
            # position does not tell it, it is in both.
            told = before.gas_force_N != 0.0 and after.gas_force_N != 0.0
            gas_forces = [row.gas_force_N if told else 0.0 for row in (before, after)]
            rebound = [row.rebound_force_N - gas for row, gas in zip((before, after), gas_forces, strict=True)]
            compression = [gas - row.compression_force_N for row, gas in zip((before, after), gas_forces, strict=True)]
            labels = label_columns((axis.setting, axis.voltage, before.temperature_degC))
            labels["velocity_m_per_s"] = before.velocity_m_per_s
            changes = [(rebound[1] - rebound[0]) / (high - low), (compression[1] - compression[0]) / (high - low)]
            if axis.unit:
                cells = {"unit": axis.unit, "from_value": low, "to_value": high}
                cells |= {"rebound_N_per_unit": changes[0], "compression_N_per_unit": changes[1]}
                gas = (gas_forces[1] - gas_forces[0]) / (high - low) if told else None
                units.append(UnitRow.model_validate({**labels, **cells, "gas_force_N_per_unit": gas}))
            else:
                cells = {"from_click": low, "to_click": high}
                cells |= {"rebound_N_per_click": changes[0], "compression_N_per_click": changes[1]}
                clicks.append(ClickRow.model_validate({**labels, **cells}))
    return tuple(clicks), tuple(units)


def _axes(forces: Sequence[KneeForceRow], control: Control) -> dict[Axis, list[tuple[float, KneeForceRow]]]:
    """Group the rows that differ by one number alone, each with this number."""
    measured = control.unit if control.unit in PRESSURES | LENGTHS else ""
    stepped = bool(measured) or "click" in f"{control.name} {control.unit}".lower()
    found: dict[Axis, list[tuple[float, KneeForceRow]]] = defaultdict(list)
    for row in forces:
        if stepped and row.voltage_V is not None:
            found[Axis(row.setting, None, measured)].append((row.voltage_V, row))
        for number in numbers_in(row.setting):
            found[Axis(number.axis, row.voltage_V, number.unit)].append((number.value, row))
    return found


def _neighbours(
    rows: Sequence[tuple[float, KneeForceRow]],
) -> Iterator[tuple[float, KneeForceRow, float, KneeForceRow]]:
    """Yield neighbouring positions on one axis with their rows, at one temperature and speed."""
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
                yield low, before, high, after
