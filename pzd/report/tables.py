"""The tables that command line and page share, each declared once, in the order of the stages."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any

from pzd.artefacts import (
    Characteristics,
    ComfortRow,
    Diagnosis,
    Knees,
    ParameterRow,
    Prediction,
    SettingLeftOutRow,
    SettingRow,
    SummaryRow,
)
from pzd.artefacts.changes import Course, CourseRow
from pzd.artefacts.csv_rows import Estimate
from pzd.artefacts.diagnosis import PeerComparison, PeerParameterRow, PeerSummaryRow
from pzd.artefacts.identified import AVERAGED, GasAndFrictionRow, courses
from pzd.artefacts.knee import DIRECTIONS, DirectionOfCondition, UnitRow
from pzd.artefacts.rig import slowest_test_force
from pzd.artefacts.table import at_largest_speed
from pzd.damper.effect import Effect
from pzd.damper.model import BaseRow
from pzd.quantities import Control
from pzd.report.columns import TERMINAL, Beyond, Cell, Column, Difference, Quantity, Span, Table
from pzd.report.diagnosis_text import counted_from

FOLD = 12
"""Longer tables of tests and conditions are folded on the page."""
NO_FORCE = 1e-6
"""A friction of less [N] is none: no load cell shows it, and a fit leaves such numbers where it found none."""


def conditions(control: Control, of: Callable[[Any], Any] = lambda row: row) -> tuple[Column, ...]:
    """Return setting, control signal and temperature, each left out where no row has it.

    Parameters
    ----------
    control : the control signal, for its name and unit
    of : what of a row of the table has them
    """
    return (
        Column("setting", "setting", value=lambda row: of(row).setting, optional=True),
        signal(control, lambda row: of(row).voltage_V),
        Column("temperature_degC", "temperature", "degC", lambda row: of(row).temperature_degC, optional=True),
    )


def signal(control: Control, value: Callable[[Any], Cell] = lambda row: row.voltage_V) -> Column:
    """Return the column of the control signal."""
    return Column(control.renamed("voltage_V"), control.name, control.unit, value, optional=True)


# --- identify: parameters of the conditions ---


def parameters(
    rows: Sequence[ParameterRow | BaseRow], control: Control, title: str = "Parameters", fold: int | None = None
) -> Table:
    """Return T0, C and k of every condition, with 95 % intervals where they were fitted."""
    return Table(
        title,
        (
            Column("setting", "setting", value=lambda row: getattr(row, "setting", None), optional=True),
            *conditions(control)[1:],
            Column("T0_N", "T0", "N", lambda row: _base_value(row, "T0_N")),
            Column("C_Ns_per_m", "C", "N s/m", lambda row: _base_value(row, "C_Ns_per_m")),
            Column("k_N_per_m", "k", "N/m", lambda row: _base_value(row, "k_N_per_m")),
            Column("W_s", "W_s", value=lambda row: getattr(row, "W_s", None)),
            Column("rmse_N", "r.m.s. error", "N", lambda row: getattr(row, "rmse_N", None)),
            Column("status", "status", value=lambda row: getattr(row, "status", "edited by hand")),
        ),
        rows,
        fold,
    )


def _base_value(row: ParameterRow | BaseRow, name: str) -> Estimate:
    """Return T0, C or k; of a base row, which has no interval to round it by, a friction of nothing is 0."""
    found = Estimate.of(row, name)
    return Estimate(0.0) if isinstance(row, BaseRow) and abs(found.value or 0.0) < NO_FORCE else found


# --- identify: characteristics, without any model ---


NO_GAS = "cannot be told from asymmetry"
"""Of the gas force without a slow test."""
READ = {"at the lowest speed": "at the only speed, whose viscous force is in it"}
"""How the static force is read, where the name of the method in the file says less than a reader needs."""


def characteristics(found: Characteristics, control: Control) -> Iterator[Table]:
    """Yield the tables of what the tests show without any model: those that have rows."""
    setting, _, temperature = conditions(control)

    def static_force(row: GasAndFrictionRow, value: float | None, untold: str) -> Difference | str:
        return untold if value is None else Difference(value, slowest_test_force(found, row))

    tables = (
        Table(
            "Force at the peak speed of each test (PVP), rebound positive",
            (
                *conditions(control),
                Column("velocity_m_per_s", "speed", "m/s", lambda row: row.speed),
                Column("rebound_force_N", "rebound", "N"),
                Column("compression_force_N", "compression", "N"),
                Column("kind", "test"),
                Column("amplitude_m", "amplitude", "mm", factor=1000.0),
                Column("frequency_Hz", "frequency", "Hz", optional=True),
                Column("record", "record"),
            ),
            found.peak_velocity,
            FOLD,
        ),
        Table(
            "Static force at mid-stroke: mean of both directions (gas) and half their difference (friction)",
            (
                *conditions(control),
                Column("gas_force_N", "gas force", "N", lambda row: static_force(row, row.gas_force_N, NO_GAS)),
                Column(
                    "friction_N", "friction", "N", lambda row: static_force(row, row.friction_N, "no line leads to it")
                ),
                Column("velocity_m_per_s", "slowest speed", "m/s"),
                Column(
                    "method",
                    "how",
                    value=lambda row: READ.get(row.method, row.method),
                ),
            ),
            found.gas_and_friction,
            FOLD,
        ),
        Table(
            f"Measured response to steps of the {control.name}",
            (
                setting,
                temperature,
                Column("voltage_V", "step", control.unit, lambda row: Span(row.from_voltage_V, row.to_voltage_V)),
                Column("velocity_m_per_s", "speed", "m/s"),
                Column("force_N", "force", "N", lambda row: Span(row.from_force_N, row.to_force_N)),
                Column("to_63_percent_s", "to 63 %", "ms", factor=1000.0),
                Column("to_90_percent_s", "to 90 %", "ms", factor=1000.0),
                Column("status", "status"),
                Column("record", "record"),
                Column("time_s", "at", "s", digits=4),
            ),
            found.steps,
            FOLD,
        ),
        Table(
            f"Warm-up: force at the peak speed from the first {AVERAGED} cycles to the last",
            (
                *conditions(control, lambda course: course.first)[:2],
                Column("velocity_m_per_s", "speed", "m/s", lambda course: course.first.velocity_m_per_s),
                Column("cycles", "cycles"),
                _course("temperature_degC", "temperature", "degC"),
                _course("rebound_force_N", "rebound", "N"),
                _course("compression_force_N", "compression", "N"),
                Column("record", "record", value=lambda course: course.first.record),
            ),
            courses(found.warm_up),
            FOLD,
        ),
        Table(
            "Records that are none of these tests, as they stand: extremes of all samples",
            (
                *conditions(control),
                Column("force_N", "force", "N", lambda r: Span(r.compression_force_N, r.rebound_force_N)),
                Column(
                    "velocity_m_per_s",
                    "velocity",
                    "m/s",
                    lambda row: Span(row.compression_velocity_m_per_s, row.rebound_velocity_m_per_s),
                ),
                Column("stroke_m", "stroke", "mm", factor=1000.0),
                Column("duration_s", "duration", "s"),
                Column("record", "record"),
            ),
            found.as_it_stands,
            FOLD,
        ),
    )
    return (table for table in tables if table.rows)


def _course(name: str, head: str, unit: str) -> Column:
    return Column(name, head, unit, lambda course: Span(getattr(course.first, name), getattr(course.last, name)))


# --- identify: the knee law, in the language of the trade ---


def knee(found: Knees, control: Control) -> Iterator[Table]:
    """Yield the tables of the knee law: the adopted law, forces, parameters, force a click or unit."""
    directions = found.directions()
    of_direction = (*conditions(control, lambda each: each.row), Column("direction", "direction"))
    yield Table(
        "Law of the element that identify chose",
        (Column("setting", "setting", optional=True), Column("law", "law"), Column("reason", "reason")),
        found.laws,
    )
    yield Table(
        "Force at the speeds of the trade, as a rig records it with the gas force at mid-stroke, in brackets beyond "
        "what the tests reached",
        (*of_direction, *(_force_at(place, speed) for place, speed in enumerate(found.speeds))),
        directions,
    )
    yield Table(
        "Bleed, knee (with friction, without gas) and blow-off with 95 % intervals",
        (
            *of_direction,
            _estimated("bleed_Ns_per_m", "bleed", "N s/m"),
            _estimated("bleed_square_Ns2_per_m2", "square part of it", "N s2/m2", optional=True),
            _estimated("knee_force_N", "knee", "N"),
            _estimated("knee_spread_N", "spread of it", "N", optional=True),
            _estimated("knee_velocity_m_per_s", "knee", "m/s"),
            _estimated("blow_off_Ns_per_m", "blow-off", "N s/m"),
        ),
        directions,
    )
    yield Table(
        "Force beside the law at mid-stroke (of the gas, where a slow test shows the same) and seal friction with 95 % "
        "intervals, and the status of the condition",
        (
            *conditions(control, lambda each: each.row),
            Column("gas_force_N", "offset", "N", _offset),
            _estimated("friction_N", "seal friction", "N"),
            Column("status", "status", value=lambda each: each.row.status),
        ),
        [each for each in directions if each.direction == DIRECTIONS[0]],
    )
    yield Table(
        "Force a click, without the gas: by how much the magnitude rises with the number of the clicker",
        (
            *conditions(control),
            Column("click", "position", value=lambda row: Span(row.from_click, row.to_click)),
            Column("velocity_m_per_s", "speed", "m/s"),
            Column("rebound_N_per_click", "rebound", "N/click"),
            Column("compression_N_per_click", "compression", "N/click"),
        ),
        found.clicks,
        FOLD,
    )
    yield Table(
        "Force a unit of pressure or length: by how much the magnitude without the gas rises, and how the gas force "
        "itself changes, below zero where it pushes the rod out more",
        (
            *conditions(control),
            Column("value", "from", value=lambda row: Quantity(Span(row.from_value, row.to_value), row.unit)),
            Column("velocity_m_per_s", "speed", "m/s"),
            _per_unit("rebound_N_per_unit", "rebound"),
            _per_unit("compression_N_per_unit", "compression"),
            _per_unit("gas_force_N_per_unit", "gas force"),
        ),
        found.per_unit,
        FOLD,
    )


def knee_prediction(found: Knees, control: Control) -> Table:
    """Return the prediction error of both laws on each held-out test."""
    return Table(
        "Tests predicted by both laws, each fitted without them",
        (
            Column("record", "held-out test"),
            *conditions(control),
            Column("W_s_bingham", "W_s by one T0 and C"),
            Column("W_s_knee", "W_s by the knee law"),
        ),
        found.predicted,
        fold=0,
    )


def _force_at(place: int, speed: float) -> Column:
    return Column(
        f"force_at_{speed:g}_m_per_s_N",
        f"at {speed:.3g} m/s",
        "N",
        lambda each: each.forces[place] if each.inside[place] else Beyond(each.forces[place]),
    )


UNKNOWN = "not shown"
"""Of a number of the knee law whose interval reaches far beyond what the tests did."""


def _estimated(column: str, head: str, unit: str, *, optional: bool = False) -> Column:
    def value(each: DirectionOfCondition) -> Estimate | str:
        return each.estimate(column) if each.shows(column) else UNKNOWN

    return Column(column, head, unit, value, optional=optional)


def _offset(each: DirectionOfCondition) -> Estimate | str:
    """Return the force beside the law; a word where the tests do not tell it from none and it was left out."""
    found = each.estimate("gas_force_N")
    return "none that shows" if found == (0.0, 0.0, 0.0) else found


def _per_unit(column: str, head: str) -> Column:
    def value(row: UnitRow) -> Quantity | str:
        found = getattr(row, column)
        return NO_GAS if found is None else Quantity(found, f"N/{row.unit}")

    return Column(column, head, value=value)


# --- diagnose: held-out prediction, adopted effects, candidates, hypotheses, peers ---


def prediction(found: Prediction, control: Control) -> Table:
    """Return W_s on every held-out test and voltage, of the baseline and of the adopted damper."""
    how = {"tests": "whole tests", "mixed": "whole tests, halves of those that are alone"}.get(
        found.hold_out, f"halves of a test, by {found.hold_out}, which is weak"
    )
    whole = {"record": "all of them", "voltage": None, "W_s_plain": found.W_s_plain, "W_s": found.W_s}
    tests = [each.model_dump() for each in found.by]
    voltages = [{"record": "all tests, left out", **each.model_dump()} for each in found.left_out_voltages]
    return Table(
        f"Prediction of held-out data ({how}) by a fit to the others",
        (
            Column("record", "held out", value=lambda row: row["record"]),
            signal(control, lambda row: row["voltage"]),
            Column("W_s_plain", "W_s, simple model", value=lambda row: row["W_s_plain"]),
            Column("W_s", "W_s, adopted damper", value=lambda row: row["W_s"]),
        ),
        [whole, *tests, *voltages],
        fold=7,  # the row of all and six tests
    )


def effect_parameters(diagnosis: Diagnosis, control: Control) -> Table:
    """Return the parameters of the adopted effects, a row for each control value where they differ by it."""
    zero = f"{1000.0 * diagnosis.zero_m:.3g} mm"
    rows = [
        (effect, name + counted_from(diagnosis, effect, name, zero), voltage, estimate, value.unit)
        for effect, values in diagnosis.parameters.items()
        for name, value in values.items()
        for voltage, estimate in zip(value.at_voltage_V or (None,) * len(value.estimates), value.estimates, strict=True)
    ]
    return Table(
        "What was added",
        (
            Column("effect", "effect", value=lambda row: row[0]),
            Column("parameter", "parameter", value=lambda row: row[1]),
            signal(control, lambda row: row[2]),
            Column("value", "value (95 % interval)", value=lambda row: Quantity(row[3], row[4])),
        ),
        rows,
    )


def peers(found: PeerComparison, control: Control) -> Iterator[Table]:
    """Yield the tables of the comparison with published models, the models side by side: those that have rows."""
    held_out = [row for row in found.rows if row.kept_back == "test"]
    pooled = [row for row in held_out if row.record is None]
    parts = {
        "tests kept back": [row for row in held_out if row.record is not None],
        f"tests kept back, by {control.name}": [row for row in pooled if row.voltage_V is not None],
        "left out, predicted from its neighbours": [row for row in found.rows if row.kept_back == "voltage"],
    }
    columns = (
        *conditions(control, lambda by_model: by_model[found.models[0]])[:2],
        Column("record", "test", value=lambda by_model: by_model[found.models[0]].record, optional=True),
        *(_of_model("W_s", model) for model in found.models),
        *(_of_model("R2", model, decimals=4) for model in found.models),  # four places tell 0.994 from 0.996
    )
    count = len(found.models)
    for title, rows in parts.items():
        if rows:  # those of a test stand together, one for each model
            tests = [{row.model: row for row in rows[first : first + count]} for first in range(0, len(rows), count)]
            yield Table(title, columns, tests)
    yield _peer_parameters(found.parameters, control)
    yield peer_summary([("", row) for row in found.summary])


def peer_summary(rows: Sequence[tuple[str, PeerSummaryRow]]) -> Table:
    """Return how well each model predicts each damper, with the numbers that it takes.

    Parameters
    ----------
    rows : each with the name of the damper, empty where there is one
    """

    def column(name: str, head: str, *, optional: bool = False, decimals: int | None = None) -> Column:
        return Column(name, head, value=lambda named: getattr(named[1], name), optional=optional, decimals=decimals)

    return Table(
        "all tests kept back, and all that is left out",
        (
            Column("config", "damper", value=lambda named: named[0], optional=True),
            column("setting", "setting", optional=True),
            column("model", "model"),
            column("parameters", "parameters"),
            column("tests", "tests"),
            column("W_s", "W_s"),
            column("R2", "R2", decimals=4),
            column("left_out", "left out"),
            column("W_s_left_out", "W_s left out"),
            column("R2_left_out", "R2 left out", decimals=4),
        ),
        rows,
    )


# --- changes: each quantity over the states


def course(found: Course, control: Control) -> Table:
    """Return each quantity over the states, a line for each state and control value."""
    rows = [
        (row, state, i, at)
        for row in found.over
        for i, state in enumerate(found.states)
        for at in range(len(row.at_voltage_V or (None,)))
    ]

    def picked(values: Any, at: int) -> float | None:
        picked_one: float | None = values[at] if isinstance(values, tuple) else values
        return picked_one

    def estimate(cell: tuple[CourseRow, str, int, int]) -> Estimate:
        row, _, i, at = cell
        value, low, high = (picked(each[i], at) for each in (row.values, row.low95, row.high95))
        return Estimate(value) if low == high else Estimate(value, low, high)  # the first state is held

    verdicts = {True: "yes", False: "no", None: None}
    return Table(
        "Each quantity over the states",
        (
            Column("quantity", "quantity", value=lambda c: _quantity(c[0])),
            signal(control, lambda c: picked(c[0].at_voltage_V, c[3])),
            Column("state", "state", value=lambda c: c[1]),
            Column("value", "value", value=lambda c: Quantity(estimate(c), c[0].unit)),
            Column("pass", "within limits", value=lambda c: verdicts[c[0].within(c[2])], optional=True),
        ),
        rows,
    )


def _quantity(row: CourseRow) -> str:
    return row.name if row.name == row.parameter else f"{row.name} {row.parameter}"


def _of_model(name: str, model: str, decimals: int | None = None) -> Column:
    return Column(
        f"{name}_{model}", f"{name} {model}", value=lambda by_model: getattr(by_model[model], name), decimals=decimals
    )


MOST_ASSIGNMENTS = 12
"""Parameters of a model up to which a line of a terminal shows them all."""


def _peer_parameters(rows: Sequence[PeerParameterRow], control: Control) -> Table:
    """Return the parameters of published models, a line for each model and control value."""

    def assignments(fit: Sequence[PeerParameterRow]) -> str:
        if len(fit) > MOST_ASSIGNMENTS:
            return f"{len(fit)} coefficients"
        return ", ".join(f"{row.parameter} = {TERMINAL.amount(row.value, row.unit)}" for row in fit)

    fits: dict[tuple[Any, ...], list[PeerParameterRow]] = {}
    for row in rows:
        fits.setdefault((row.setting, row.voltage_V, row.model, row.form, row.status), []).append(row)
    return Table(
        "peers, fitted to all tests",
        (
            *conditions(control, lambda fit: fit[0])[:2],
            Column("model", "model", value=lambda fit: ", ".join(filter(None, (fit[0].model, fit[0].form)))),
            Column("parameters", "parameters", value=assignments),
            Column("status", "fit", value=lambda fit: fit[0].status),
        ),
        list(fits.values()),
    )


# --- table: settings between tested ones ---


def interpolated_settings(rows: Sequence[SettingRow], control: Control) -> Table:
    """Return the largest force of settings that were not tested, of both directions."""
    return Table(
        "Settings that were not tested: interpolated force at the largest speed that both neighbours reached",
        (
            *conditions(control, lambda pair: pair[0]),
            Column("velocity_m_per_s", "speed", "m/s", lambda pair: pair[0].velocity_m_per_s),
            Column("rebound_force_N", "rebound", "N", lambda pair: pair[0].force_N + pair[0].static_force_N),
            Column("compression_force_N", "compression", "N", lambda pair: pair[1].force_N + pair[1].static_force_N),
            Column("between", "interpolated between", value=lambda pair: _neighbours(pair[0])),
        ),
        at_largest_speed(rows),
    )


def left_out_settings(rows: Sequence[SettingLeftOutRow]) -> Table:
    """Return how well tested settings are predicted from their neighbours."""
    return Table(
        "Tested settings predicted from their neighbours, with the error in % of peak force",
        (
            Column("setting", "left out"),
            Column("between", "predicted from", value=_neighbours),
            Column("peak_force_N", "its peak force", "N"),
            share("rms_share_of_peak", "error (r.m.s.)"),
            share("largest_share_of_peak", "largest error"),
        ),
        rows,
    )


def _neighbours(row: SettingRow | SettingLeftOutRow) -> str:
    return f"{row.lower_setting} and {row.upper_setting}"


def share(name: str, head: str, value: Callable[[Any], Cell] | None = None) -> Column:
    """Return a column of shares, shown in percent."""
    return Column(name, head, "%", value, digits=2, factor=100.0)


# --- simulate and report: rides and comfort ---


def rides(rows: Sequence[SummaryRow]) -> Table:
    """Return the summary of every ride."""
    return Table(
        "Rides",
        (
            Column("case", "case"),
            Column("point", "point"),
            Column("peak_abs_aK_m_per_s2", "peak |a_K|", "m/s2"),
            Column("rms_aK_m_per_s2", "rms a_K", "m/s2"),
            Column("peak_deflection_m", "peak deflection", "m"),
            share("outside_table", "outside the table"),
        ),
        rows,
    )


def comfort(rows: Sequence[ComfortRow]) -> Table:
    """Return every comfort measure of every ride."""
    return Table(
        "Comfort",
        (
            *(Column(name, name) for name in ("case", "point", "edition", "measure")),
            Column("value", "value", value=lambda row: Quantity(row.value, row.unit)),
            Column("status", "status"),
        ),
        rows,
    )


# --- the library of effects ---


def effects(library: Iterable[Effect]) -> Table:
    """Return the parameters of every effect with their limits."""
    return Table(
        "Effects",
        (
            Column("effect", "effect", value=lambda row: row[0].name),
            Column("place", "place", value=lambda row: row[0].place),
            Column("parameter", "parameter", value=lambda row: row[1].name),
            Column("unit", "unit", value=lambda row: row[1].unit),
            Column("low", "from", value=lambda row: f"{row[1].low:g}"),
            Column("high", "to", value=lambda row: f"{row[1].high:g}"),
            Column("neutral", "off at", value=lambda row: f"{row[1].neutral:g}"),
            Column("law", "law", value=lambda row: row[0].law),
        ),
        [(effect, parameter) for effect in library for parameter in effect.parameters],
    )
