"""A diagnosis as about ten lines of text."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from pzd.artefacts import Diagnosis, Hypotheses, HypothesisRow, KeptBack, NextTest, Prediction, Value
from pzd.artefacts.identified import AVERAGED, courses
from pzd.artefacts.knee import OF_A_DIRECTION, OF_BOTH
from pzd.artefacts.rig import force_behind
from pzd.artefacts.table import fastest
from pzd.quantities import Control
from pzd.schema.errors import counted, rounded_as, supported

# ----------------------------------------------------------------------------------------------------
# Numbers and rows as aligned text.


DIGITS = 4
"""Significant digits of a number without an interval."""


def number(value: float | str | None) -> str:
    """A number with the digits that matter; a dash where there is none."""
    if value is None or value == "":
        return "-"
    return value if isinstance(value, str) else f"{value:.{DIGITS}g}"


def number_as(value: float, other: float) -> str:
    """A number to the decimal place to which another one is told, from which it was read."""
    return number(rounded_as(value, other, DIGITS))


def interval(value: float | None, low: float | None, high: float | None) -> str:
    """A value with its 95 % interval."""
    if value is None or low is None or high is None:
        return number(value)
    return "{} ({} to {})".format(*(supported(each, low, high) for each in (value, low, high)))


def filled(head: Sequence[str], rows: Sequence[Sequence[str]], first: int) -> list[list[str]]:
    """A header and its rows, of whose first columns those are left out that hold nothing but dashes.

    Parameters
    ----------
    head : the header
    rows : the rows, as `number` writes them
    first : so many columns are conditions, which a rig need not have
    """
    kept = [c for c in range(len(head)) if c >= first or any(row[c] != "-" for row in rows)]
    return [[row[c] for c in kept] for row in (head, *rows)] if rows else []


def aligned(rows: Sequence[Sequence[str]], indent: str = "") -> list[str]:
    """Rows as lines whose columns stand below each other."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return [
        (indent + "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True))).rstrip()
        for row in rows
    ]


# ----------------------------------------------------------------------------------------------------
# Force over speed, gas force, friction, response to steps and warm-up, as rows of text.


if TYPE_CHECKING:
    from pzd.artefacts import Characteristics
    from pzd.pipeline.run_summary import RunSummary


def characteristics_tables(found: RunSummary) -> Iterator[tuple[str, list[list[str]]]]:
    """Titles and rows of what the tests show without a model; no rows where there are no such tests."""
    here, control = found.characteristics, found.control
    signal = f"{control.name} [{control.unit}]"
    places = ["setting", signal, "T [degC]"]
    yield (
        "force at peak speed (PVP), rebound is extension and positive",
        filled(
            [*places, "test", "speed [m/s]", "rebound [N]", "compression [N]", "record"],
            [
                [
                    *_place(row.setting, row.voltage_V, row.temperature_degC),
                    row.kind,
                    number(row.speed),
                    number(row.rebound_force_N),
                    number(row.compression_force_N),
                    row.record,
                ]
                for row in here.peak_velocity
            ],
            len(places),
        ),
    )
    yield (
        "gas force and friction at mid-stroke",
        filled(
            [*places, "gas force [N]", "friction [N]", "from"],
            [
                [
                    *_place(row.setting, row.voltage_V, row.temperature_degC),
                    *(number_as(force, force_behind(here, row)) for force in (row.gas_force_N, row.friction_N)),
                    f"{number(row.velocity_m_per_s)} m/s, {row.method}",
                ]
                for row in here.gas_and_friction
            ],
            len(places),
        ),
    )
    yield (
        f"steps of the {control.name}",
        filled(
            ["setting", "T [degC]", "step", "speed [m/s]", "to 63 % [ms]", "to 90 % [ms]", "record", "status"],
            [
                [
                    number(row.setting),
                    number(row.temperature_degC),
                    f"{number(row.from_voltage_V)} to {number(row.to_voltage_V)} {control.unit}",
                    number(row.velocity_m_per_s),
                    *(number(None if t is None else 1000.0 * t) for t in (row.to_63_percent_s, row.to_90_percent_s)),
                    f"{row.record} at {number(row.time_s)} s",
                    row.status,
                ]
                for row in here.steps
            ],
            2,
        ),
    )
    yield f"warm-up: from the first {AVERAGED} cycles of a long test to its last", _warm_up(here, signal)
    yield "none of these tests, as it stands: extremes of all samples", _as_it_stands(here, places)


def _warm_up(here: Characteristics, signal: str) -> list[list[str]]:
    rows = [
        [
            number(one.first.setting),
            number(one.first.voltage_V),
            number(one.first.velocity_m_per_s),
            str(one.cycles),
            _course(one.first.temperature_degC, one.last.temperature_degC),
            _course(one.first.rebound_force_N, one.last.rebound_force_N),
            _course(one.first.compression_force_N, one.last.compression_force_N),
            one.first.record,
        ]
        for one in courses(here.warm_up)
    ]
    head = ["setting", signal, "speed [m/s]", "cycles", "T [degC]", "rebound [N]", "compression [N]", "record"]
    return filled(head, rows, 2)


def _as_it_stands(here: Characteristics, places: list[str]) -> list[list[str]]:
    rows = [
        [
            *_place(row.setting, row.voltage_V, row.temperature_degC),
            _course(row.compression_force_N, row.rebound_force_N),
            _course(row.compression_velocity_m_per_s, row.rebound_velocity_m_per_s),
            number(row.stroke_m),
            number(row.duration_s),
            row.record,
        ]
        for row in here.as_it_stands
    ]
    return filled([*places, "force [N]", "velocity [m/s]", "stroke [m]", "duration [s]", "record"], rows, len(places))


def _course(first: float | None, last: float | None) -> str:
    return number(None) if first is None else f"{number(first)} to {number(last)}"


def _place(setting: str | None, voltage: float | None, temperature: float | None) -> list[str]:
    return [number(setting), number(voltage), number(temperature)]


# ----------------------------------------------------------------------------------------------------
# The knee law as rows of text: rebound and compression in the language of the trade, and the force a click or unit.


if TYPE_CHECKING:
    from pzd.artefacts.knee import DirectionOfCondition
    from pzd.pipeline.run_summary import RunSummary


def knee_tables(found: RunSummary) -> Iterator[tuple[str, list[list[str]]]]:
    """Titles and rows of the knee law; no rows where the config does not ask for it."""
    knees, control = found.knees, found.control
    places = ["setting", f"{control.name} [{control.unit}]", "T [degC]"]
    yield "law handed on", [[number(row.setting), row.law, row.reason] for row in knees.laws]
    parameters = ["bleed [N s/m]", "knee [N]", "knee [m/s]", "blow-off [N s/m]", "gas force [N]", "seal friction [N]"]
    speeds = [f"{number(speed)} m/s [N]" for speed in knees.speeds]
    head = [*places, "direction", *speeds, *parameters]
    rows = [_direction(each) for each in knees.directions()]
    yield "rebound and compression, forces with the gas force at mid-stroke", filled(head, rows, len(places))
    yield (
        "force a click, without the gas",
        filled(
            [*places, "position", "speed [m/s]", "rebound [N]", "compression [N]"],
            [
                [
                    *_knee_place(row.setting, row.voltage_V, row.temperature_degC),
                    f"{number(row.from_click)} to {number(row.to_click)}",
                    number(row.velocity_m_per_s),
                    number(row.rebound_N_per_click),
                    number(row.compression_N_per_click),
                ]
                for row in knees.clicks
            ],
            len(places),
        ),
    )

    yield (
        "force a unit of pressure or length, without the gas, and of the gas force itself",
        filled(
            [*places, "from", "speed [m/s]", "rebound", "compression", "gas force"],
            [
                [
                    *_knee_place(row.setting, row.voltage_V, row.temperature_degC),
                    f"{number(row.from_value)} to {number(row.to_value)} {row.unit}",
                    number(row.velocity_m_per_s),
                    *(
                        f"{number(force)} N/{row.unit}"
                        for force in (row.rebound_N_per_unit, row.compression_N_per_unit, row.gas_force_N_per_unit)
                    ),
                ]
                for row in knees.per_unit
            ],
            len(places),
        ),
    )


def _direction(each: DirectionOfCondition) -> list[str]:
    row, forces = each.row, [number(force) for force in each.forces]
    return [
        *_knee_place(row.setting, row.voltage_V, row.temperature_degC),
        each.direction,
        *(text if inside or text == "-" else f"({text})" for text, inside in zip(forces, each.inside, strict=True)),
        *(interval(*each.estimate(name)) for name in (*OF_A_DIRECTION, *OF_BOTH)),
    ]


def _knee_place(setting: str | None, voltage: float | None, temperature: float | None) -> list[str]:
    return [number(setting), number(voltage), number(temperature)]


# ----------------------------------------------------------------------------------------------------
# The force at settings between tested ones, as rows of text.


if TYPE_CHECKING:
    from pzd.pipeline.run_summary import RunSummary


def settings_tables(found: RunSummary) -> Iterator[tuple[str, list[list[str]]]]:
    """Titles and rows; no rows where the config asks for no such setting."""
    places = ["T [degC]", f"{found.control.name} [{found.control.unit}]"]
    head = [*places, "setting", "speed [m/s]", "rebound [N]", "compression [N]", "interpolated between"]
    rows = [
        [
            number(rebound.temperature_degC),
            number(rebound.voltage_V),
            rebound.setting,
            number(rebound.velocity_m_per_s),
            number(rebound.force_N + rebound.static_force_N),
            number(compression.force_N + compression.static_force_N),
            f"{rebound.lower_setting} and {rebound.upper_setting}",
        ]
        for rebound, compression in fastest(found.settings)
    ]
    yield (
        "settings between tested ones, interpolated and not tested: force at the largest speed of both",
        filled(head, rows, len(places)),
    )
    yield (
        "tested settings left out and predicted from their neighbours",
        [
            [
                row.setting,
                f"between {row.lower_setting} and {row.upper_setting}",
                f"missed by {100.0 * row.rms_share_of_peak:.2g} % of peak (r.m.s.)",
                f"at most {100.0 * row.largest_share_of_peak:.2g} %",
            ]
            for row in found.settings_left_out
        ],
    )


# ----------------------------------------------------------------------------------------------------


_VERDICTS = {
    "named": "one answer fits, and no other does",
    "ambiguous": "several answers fit the data",
    "none": "nothing is missing that the data can show",
    "unexplained": "a gap that repeats remains, and no name accounts for it",
}
_MOST = 3
"""How many places and candidates are listed."""
_MOST_SHAPES = 2
"""How many shapes of what is left, each by itself."""
NONE_SOUGHT = Hypotheses()


def diagnosis_lines(
    diagnosis: Diagnosis, control: Control, *, every_test: bool = False, hypotheses: Hypotheses = NONE_SOUGHT
) -> list[str]:
    """The lines: what is missing, where, how sure that is, how far it closes the gap, and what to test next.

    Parameters
    ----------
    diagnosis : the artefact of diagnose
    control : the control signal, for its unit
    every_test : whether the prediction of each kept-back test and each voltage left out is listed too
    hypotheses : which shape what is left has
    """
    unit = control.unit
    lines = [
        f"verdict: {diagnosis.verdict}, {_VERDICTS[diagnosis.verdict]}",
        f"reason: {diagnosis.reason}",
        _gap(diagnosis),
    ]
    if diagnosis.prediction:
        lines += _prediction(diagnosis.prediction, unit, every_test=every_test)
    lines += [f"where: {where.region}, {where.share_of_gap:.0%} of the gap" for where in diagnosis.where[:_MOST]]
    lines += [f"adopted: {name}, {_parameters(diagnosis, name, unit)}" for name in diagnosis.effects]
    if diagnosis.confidence is not None:
        lines.append(f"confidence: {diagnosis.confidence:.0%}{_confident_of(diagnosis)}")
    if diagnosis.rivals:
        lines.append(f"rivals: {', '.join(diagnosis.rivals)}")
    lines += [*_rejected(diagnosis), *_hypotheses(hypotheses)]
    if diagnosis.next_test:
        lines.append(_next(diagnosis.next_test, unit))
    return lines


def _confident_of(diagnosis: Diagnosis) -> str:
    """What the confidence of an open verdict is in."""
    if diagnosis.verdict != "ambiguous":
        return ""
    named = [*diagnosis.effects, *diagnosis.rivals] + ["nothing"] * (not diagnosis.effects)
    return f" that it is {' or '.join(named)}" if len(named) > 1 else ""


def _gap(diagnosis: Diagnosis) -> str:
    gap = diagnosis.gap
    if gap is None:
        return "gap: could not be measured"
    share = f", {1.0 - gap.after / gap.before:.0%} less" if gap.after < gap.before else ""
    records = counted(len(gap.held_out), "record")
    held = {"records": records, "mixed": f"{records}, whole or in part"}.get(
        gap.hold_out, f"{gap.hold_out} of {records}"
    )
    return (
        f"gap on what no fit has seen ({held}): W_s {number(gap.before)} before, {number(gap.after)} after{share}; "
        f"noise alone gives {number(gap.noise_floor)}"
    )


def _prediction(found: Prediction, unit: str, *, every_test: bool) -> Iterator[str]:
    kept_back = {"tests": "whole tests", "mixed": "whole tests, or halves"}.get(found.hold_out, f"{found.hold_out}")
    yield f"prediction of {kept_back} kept back: W_s {number(found.W_s_plain)} plain, {number(found.W_s)} as handed on"
    if every_test:
        for each in found.by:
            at = "" if each.voltage is None else f" at {number(each.voltage)} {unit}"
            figures = f"W_s {number(each.W_s_plain)} plain, {number(each.W_s)} as handed on"
            yield f"kept back: {each.record}{at}, {figures}{_explained(each)}"
    listed = sorted(found.left_out_voltages, key=lambda left: -left.W_s)
    for left in listed if every_test else listed[:1]:
        figures = f"W_s {number(left.W_s_plain)} plain, {number(left.W_s)} as handed on"
        yield f"left out: {number(left.voltage)} {unit}, predicted from its neighbours with {figures}"


def _explained(each: KeptBack) -> str:
    """R2 of one test; nothing where an earlier version wrote the file."""
    return "" if each.R2 is None or each.R2_plain is None else f"; R2 {each.R2_plain:.4f} and {each.R2:.4f}"


def _parameters(diagnosis: Diagnosis, effect: str, unit: str) -> str:
    values = diagnosis.parameters.get(effect, {})
    text = ", ".join(f"{name} = {_value(value, unit)}" for name, value in values.items())
    return f"{text} to either side of x = {diagnosis.zero_m:.4g} m" if effect == "end_stop" else text


def _value(value: Value, unit: str) -> str:
    if isinstance(value.value, tuple):
        places = zip(value.value, value.at_voltage_V or (), strict=False)
        return "; ".join(
            f"{number(one)} {value.unit} at {number(voltage)} {unit}" for one, voltage in places
        ) + _by_hand(value)
    low = None if isinstance(value.low95, tuple) else value.low95
    high = None if isinstance(value.high95, tuple) else value.high95
    return f"{interval(value.value, low, high)} {value.unit}{_by_hand(value)}"


def _by_hand(value: Value) -> str:
    """Said of what nobody fitted."""
    return " (edited by hand)" if value.low95 is None and value.high95 is None else ""


def _rejected(diagnosis: Diagnosis) -> Iterator[str]:
    listed = {*diagnosis.effects, *diagnosis.rivals}
    others = [one for one in diagnosis.ranking if one.effect not in listed]
    adopted = {one.effect: one.gap_after for one in diagnosis.ranking if one.effect in diagnosis.effects}
    # What was added for its prediction alone was in no round of the search: then no figure there is the damper's.
    whole = adopted.keys() == {*diagnosis.effects}
    against = f" against {number(min(adopted.values()))}" if adopted and whole else ""
    for one in others[:_MOST]:
        yield f"not taken: {one.effect}, W_s {number(one.gap_after)}{against} on the tests seen, {one.reason}"


def _hypotheses(found: Hypotheses) -> Iterator[str]:
    """The best shapes of what is left, and what stands beside the best; nothing where none was looked for."""
    if found.sought and not found.rows:
        yield "hypothesis: none, no shape of what is left predicts tests kept back beyond two standard errors"
    for row in found.alone[:_MOST_SHAPES]:
        yield f"{'hypothesis' if row.place == 1 else 'or'}: {hypothesis(row)}; {row.physics}{of_library(row)}"
    for row in found.together:
        yield f"and beside {row.beside}: {hypothesis(row)} together; {row.physics}{of_library(row)}"


def hypothesis(row: HypothesisRow) -> str:
    """A shape with its coefficient, and what it would close."""
    more = f" and {number(row.second_coefficient)} with the cosine" if row.second_coefficient is not None else ""
    value = interval(row.coefficient, row.coefficient_low95, row.coefficient_high95)
    at = f", {row.parameter} = {number(row.parameter_value)} {row.parameter_unit}" if row.parameter else ""
    closes = f"would close {row.closes:.0%} of the gap on tests kept back"
    return f"c {row.shape}, c = {value}{more} {row.unit}{at}: {closes}"


def of_library(row: HypothesisRow) -> str:
    """Which effect of the library has the shape; empty where none has."""
    return f" ({row.library} has this shape)" if row.library else ""


def _next(test: NextTest, unit: str) -> str:
    voltages = test.voltage_V if isinstance(test.voltage_V, tuple) else (test.voltage_V,)
    parts = [
        test.waveform,
        f"{number(test.frequency_Hz)} Hz" if test.frequency_Hz is not None else "",
        f"{number(test.amplitude_m)} m" if test.amplitude_m is not None else "",
        f"about {test.middle_m:.6g} m" if test.middle_m is not None else "",
        f"at {' and '.join(f'{number(v)} {unit}' for v in voltages)}" if voltages != (None,) else "",
    ]
    reached = [
        f"{number(value)} {of}"
        for value, of in ((test.peak_speed_m_per_s, "m/s"), (test.peak_force_N, "N"))
        if value is not None
    ]
    far = f", up to {' and '.join(reached)}" if reached else ""
    aim = f" to tell {' from '.join(test.separates)}" if test.separates else ""
    if test.between_voltage_V is not None:
        low, high = (number(voltage) for voltage in test.between_voltage_V)
        aim = f", since between {low} and {high} {unit} the force is known least"
    return f"next test: {' '.join(part for part in parts if part)}{far}{aim}"
