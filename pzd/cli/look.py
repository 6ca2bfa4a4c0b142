"""The commands that only look: at a config, at a run, at several runs side by side."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from pzd.cli.options import CORES, Call, Json, Quiet, Verbose, on_config
from pzd.cli.output import DONE, Output
from pzd.schema.errors import ConfigError, counted

if TYPE_CHECKING:
    from pzd.artefacts import (
        Diagnosis,
        HeldOutTest,
        HeldOutVoltage,
        Hypotheses,
        HypothesisRow,
        IngestRow,
        NextTest,
        Prediction,
        RecordEntry,
        Value,
    )
    from pzd.pipeline.run_summary import RunSummary
    from pzd.quantities import Control
    from pzd.report.columns import Table

_VERDICTS = {
    "named": "one answer fits, and no other does",
    "ambiguous": "several answers fit the data",
    "none": "nothing is missing that the data can show",
    "unexplained": "a gap that repeats remains, and no name accounts for it",
}
_MOST = 3
"""How many regions and candidates are listed."""
_MOST_SHAPES = 2
"""How many shapes of the residual force, each by itself."""

PlotFile = Annotated[
    Path | None,
    typer.Option("--plot", metavar="FILE.html", help="Draw every record on a page, with the findings marked."),
]
IsResolved = Annotated[
    bool,
    typer.Option("--resolved", help="Print every value of the config with its origin instead: line, --set, default."),
]
RunFolders = Annotated[list[Path], typer.Argument(metavar="RUN...", help="Folders of runs, e.g. runs/quickstart.")]


def _number(value: float | None, unit: str = "") -> str:
    """Return a number with its unit as tables of the terminal have it."""
    from pzd.report.columns import TERMINAL  # here, since `pzd --help` needs neither tables nor numpy

    return TERMINAL.amount(value, unit)


# --- pzd check ---


@on_config("as_json")
def check(call: Call, plot: PlotFile = None) -> int:
    """Check config, rig records and road files; write nothing but the page of --plot."""
    from pzd.pipeline.command import check_roads, check_setting, preflight
    from pzd.schema.validate import plain_data

    given, output = call.opened, call.output
    _check_plot(plot)
    rig = preflight(given)
    if plot is not None:
        from pzd.report.page import records_page

        plot.write_text(records_page(rig, given.run.control, CORES), encoding="utf-8", newline="\n")
    if output.as_json:
        output.say_json(plain_data({"config": call.config.as_posix(), "records": rig.entries}, given.run.control))
    for entry in rig.entries:
        output.say(*_entry(entry), *(_ingested(rig.ingested, entry.name) if output.verbose else ()))
    check_setting(given, rig.entries)
    check_roads(given)
    found = counted(sum(len(entry.findings) for entry in rig.entries), "finding")
    wrote = f"the records are drawn in {plot}" if plot is not None else "nothing was written"
    output.say(f"{counted(len(rig.entries), 'record')}, {found}; the config is in order, {wrote}")
    return DONE


def _check_plot(plot: Path | None) -> None:
    """Refuse to write the page over a file of another kind, say a record, or into a folder that is not there."""
    if plot is not None and not plot.parent.is_dir():
        raise ConfigError(f"--plot {plot}: there is no folder {plot.parent}; make it, or name another one")
    if plot is not None and plot.suffix.lower() != ".html":
        raise ConfigError(f"--plot {plot}: must end in .html, as it is a page (got {plot.suffix or 'no suffix'})")


def _entry(entry: RecordEntry) -> Iterator[str]:
    yield f"{entry.name}: {_number(entry.cycles)} cycles at {_number(entry.rate_Hz, 'Hz')}"
    for finding in entry.findings:
        yield f"  {finding.check}: {finding.where}: {_number(finding.size)} {finding.unit}; {finding.follows}"


def _ingested(rows: Sequence[IngestRow], record: str) -> Iterator[str]:
    """Yield what was done to the file of one record."""
    for row in rows:
        if row.record == record:
            what = f"{row.step} {row.quantity}" if row.quantity else row.step
            yield f"  {row.file}: {what}: {row.was}" + (f" -> {row.became}" if row.became else "")


# --- pzd show ---


@on_config("as_json")
def show(call: Call, resolved: IsResolved = False) -> int:
    """Print the numbers in the run of a config.

    A stage whose numbers are of an older config, of other files or of other code is called stale, with the reason.
    """
    output = call.output
    if resolved:
        _show_resolved(call)
        return DONE
    from pzd.pipeline.run_summary import summary_with_stale

    found = summary_with_stale(call.opened)
    if output.as_json:
        output.say_json(_run_as_data(found))
    output.say(f"run: {found.folder}", *_stale_lines(found))
    for title, lines in _sections(found):
        if lines:
            output.say("", f"{title}:", *lines)
    output.say(*(f"not to be trusted: {mark}" for mark in found.marks))
    output.say(f"report: {found.page or 'not written yet'}")
    return DONE


def _sections(found: RunSummary) -> Iterator[tuple[str, list[str]]]:
    """Yield the titles and lines of what a run found, in the order of the stages."""
    from pzd.report import tables

    for table in (
        *tables.characteristics(found.characteristics, found.control),
        *tables.knee(found.knees, found.control),
    ):
        yield _titled(table)
    yield _titled(tables.parameters(found.parameters, found.control).without("rmse_N"))
    lines = diagnosis_lines(found.diagnosis, found.control, hypotheses=found.hypotheses) if found.diagnosis else []
    yield "diagnosis", [f"  {line}" for line in lines]
    yield _titled(tables.interpolated_settings(found.settings, found.control))
    yield _titled(tables.left_out_settings(found.settings_left_out))
    yield _titled(tables.rides(found.summary))
    yield "assumed, since the config does not say it", [f"  {line}" for line in found.assumed]
    yield _titled(tables.comfort(found.comfort))


def _titled(table: Table) -> tuple[str, list[str]]:
    return f"{table.title[0].lower()}{table.title[1:]}", table.lines("  ")


def _show_resolved(call: Call) -> None:
    """Print every value of the config with its origin; nothing needs to have run."""
    from pzd.pipeline.command import resolved
    from pzd.report.columns import aligned
    from pzd.schema.yamltree import written

    found = resolved(call.opened)
    if call.output.as_json:
        call.output.say_json([vars(one) for one in found])
    values = ["[]" if one.value == [] else "{}" if one.value == {} else written(one.value) for one in found]
    call.output.say(*aligned([[one.path, value, one.origin] for one, value in zip(found, values, strict=True)]))


def _stale_lines(found: RunSummary, place: str = "") -> list[str]:
    """Return a line for each stage whose numbers are not those of the config as it is today."""
    return [f"stale: {place}{stage}: {reason}" for stage, reason in found.stale.items()]


# --- pzd compare ---


def compare(runs: RunFolders, as_json: Json = False, quiet: Quiet = False, verbose: Verbose = False) -> int:
    """Print the numbers of several runs side by side.

    A stage whose numbers are not those of the run's config as it is today is called stale, with the reason.
    """
    from pzd.pipeline.run_summary import summary_of
    from pzd.report.columns import aligned

    output = Output(quiet=quiet, verbose=verbose, as_json=as_json)
    found = [summary_of(folder) for folder in runs]
    if as_json:
        output.say_json([_run_as_data(run) for run in found])
    columns = [dict(_numbers(run)) for run in found]
    names = dict.fromkeys(name for column in columns for name in column)
    head = ["", *(str(run.folder) for run in found)]
    output.say(*aligned([head, *([name, *(column.get(name, "-") for column in columns)] for name in names)]))
    for run in found:
        output.say(*_stale_lines(run, f"{run.folder}: "))
    return DONE


def _numbers(run: RunSummary) -> Iterator[tuple[str, str]]:
    """Yield names and values of the numbers of a run that are compared with those of others."""
    from pzd.report import tables
    from pzd.report.columns import TERMINAL

    parameters = tables.parameters(run.parameters, run.control)
    compared = [column for column in parameters.columns if column.name in ("T0_N", "C_Ns_per_m", "k_N_per_m", "W_s")]
    for row in run.parameters:
        for column in compared:
            head = column.heading(run.parameters, TERMINAL)
            yield f"{head}, {row.words(run.control) or 'all records'}", column.text(row, TERMINAL)
    if run.diagnosis is not None:
        yield "verdict", run.diagnosis.verdict
        yield "effects", ", ".join(run.diagnosis.effects) or "-"
        yield "confidence", _number(run.diagnosis.confidence)
        yield "W_s on held-out data, baseline", _number(run.diagnosis.gap.before if run.diagnosis.gap else None)
        yield "W_s on held-out data, adopted damper", _number(run.diagnosis.gap.after if run.diagnosis.gap else None)
    for ride in run.summary:
        yield f"{ride.case}: peak |a_K| at {ride.point} [m/s2]", _number(ride.peak_abs_aK_m_per_s2)
        yield f"{ride.case}: rms a_K at {ride.point} [m/s2]", _number(ride.rms_aK_m_per_s2)
    for measure in run.comfort:
        name = f"{measure.case}: {measure.measure} at {measure.point} [{measure.unit}], {measure.edition}"
        yield name, _number(measure.value)


# --- JSON: the numbers that people see, under the names that the files have ---


def _run_as_data(run: RunSummary) -> dict[str, Any]:
    """Return the numbers of a run as plain data, the control under its own name."""
    from pzd.schema.validate import plain_data

    numbers = {
        "run": run.folder.as_posix(),
        "stale": run.stale,
        "not_to_be_trusted": run.marks,
        "characteristics": vars(run.characteristics),
        "knee": vars(run.knees),
        "parameters": run.parameters,
        "diagnosis": run.diagnosis,
        "settings": run.settings,
        "settings_left_out": run.settings_left_out,
        "hypotheses": run.hypotheses.rows,
        "rides": run.summary,
        "assumed": run.assumed,
        "comfort": run.comfort,
        "report": run.page.as_posix() if run.page else None,
    }
    data: dict[str, Any] = plain_data(numbers, run.control)
    return data


# --- The diagnosis as about ten lines of text ---


def diagnosis_lines(
    diagnosis: Diagnosis, control: Control, *, every_test: bool = False, hypotheses: Hypotheses | None = None
) -> list[str]:
    """Return what is missing, where, how sure that is, how far it closes the gap, and what to test next.

    Parameters
    ----------
    diagnosis : the artefact of diagnose
    control : the control signal, for its unit
    every_test : whether the prediction of each held-out test and voltage is listed too
    hypotheses : shapes of the residual force, if any were looked for
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
        lines.append(f"confidence: {diagnosis.confidence:.0%}{_open_names(diagnosis)}")
    if diagnosis.rivals:
        lines.append(f"rivals: {', '.join(diagnosis.rivals)}")
    lines += [*_rejected(diagnosis), *(_hypotheses(hypotheses) if hypotheses else ())]
    if diagnosis.next_test:
        lines.append(_next(diagnosis.next_test, unit))
    return lines


def _open_names(diagnosis: Diagnosis) -> str:
    """Return the effects that the confidence of an ambiguous verdict is about."""
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
    held_out = {"records": records, "mixed": f"{records}, whole or in part"}.get(
        gap.hold_out, f"{gap.hold_out} of {records}"
    )
    return (
        f"gap on what no fit has seen ({held_out}): W_s {_number(gap.before)} before, {_number(gap.after)} after"
        f"{share}; noise alone gives {_number(gap.noise_floor)}"
    )


def _prediction(found: Prediction, unit: str, *, every_test: bool) -> Iterator[str]:
    def errors(each: Prediction | HeldOutTest | HeldOutVoltage) -> str:
        return f"W_s {_number(each.W_s_plain)} plain, {_number(each.W_s)} as handed on"

    held_out = {"tests": "whole tests", "mixed": "whole tests, or halves"}.get(found.hold_out, f"{found.hold_out}")
    yield f"prediction of {held_out} kept back: {errors(found)}"
    if every_test:
        for each in found.by:
            at = "" if each.voltage is None else f" at {_number(each.voltage, unit)}"
            # An earlier version wrote no R2.
            R2 = "" if each.R2 is None or each.R2_plain is None else f"; R2 {each.R2_plain:.4f} and {each.R2:.4f}"
            yield f"kept back: {each.record}{at}, {errors(each)}{R2}"
    listed = sorted(found.left_out_voltages, key=lambda left: -left.W_s)
    for left in listed if every_test else listed[:1]:
        yield f"left out: {_number(left.voltage, unit)}, predicted from its neighbours with {errors(left)}"


def _parameters(diagnosis: Diagnosis, effect: str, unit: str) -> str:
    values = diagnosis.parameters.get(effect, {})
    text = ", ".join(f"{name} = {_value(value, unit)}" for name, value in values.items())
    return f"{text} to either side of x = {diagnosis.zero_m:.4g} m" if effect == "end_stop" else text


def _value(value: Value, unit: str) -> str:
    """Return a parameter with its interval, or one value for each control value."""
    from pzd.report.columns import TERMINAL

    edited = " (edited by hand)" if value.low95 is None and value.high95 is None else ""
    if value.at_voltage_V is not None:
        pairs = zip(value.estimates, value.at_voltage_V, strict=True)
        return "; ".join(f"{_number(one.value, value.unit)} at {_number(at, unit)}" for one, at in pairs) + edited
    (estimate,) = value.estimates
    if estimate.interval is None:
        return f"{_number(estimate.value, value.unit)}{edited}"
    return f"{TERMINAL.text(estimate, value.unit)}{edited}"


def _rejected(diagnosis: Diagnosis) -> Iterator[str]:
    listed = {*diagnosis.effects, *diagnosis.rivals}
    others = [one for one in diagnosis.ranking if one.effect not in listed]
    adopted = {one.effect: one.gap_after for one in diagnosis.ranking if one.effect in diagnosis.effects}
    # What was added for its prediction alone was in no round of the search: then no figure there is the damper's.
    whole = adopted.keys() == {*diagnosis.effects}
    against = f" against {_number(min(adopted.values()))}" if adopted and whole else ""
    for one in others[:_MOST]:
        yield f"not taken: {one.effect}, W_s {_number(one.gap_after)}{against} on the tests seen, {one.reason}"


def _hypotheses(found: Hypotheses) -> Iterator[str]:
    """Yield the best shapes of the residual force, and those beside the best; nothing where none was looked for."""
    if found.sought and not found.rows:
        yield "hypothesis: none, no shape of what is left predicts tests kept back beyond two standard errors"
    for row in found.alone[:_MOST_SHAPES]:
        yield f"{'hypothesis' if row.place == 1 else 'or'}: {_shape(row)}; {_physics(row)}"
    for row in found.together:
        yield f"and beside {row.beside}: {_shape(row)} together; {_physics(row)}"


def _shape(row: HypothesisRow) -> str:
    """Return a shape with its coefficient, and the share of the gap that it would close."""
    from pzd.artefacts.csv_rows import Estimate
    from pzd.report.columns import TERMINAL

    more = f" and {_number(row.second_coefficient)} with the cosine" if row.second_coefficient is not None else ""
    value = TERMINAL.interval(Estimate.of(row, "coefficient"))
    at = f", {row.parameter} = {_number(row.parameter_value, row.parameter_unit or '')}" if row.parameter else ""
    closes = f"would close {row.closes:.0%} of the gap on tests kept back"
    unit = "" if row.unit == "-" else f" {row.unit}"
    return f"c {row.shape}, c = {value}{more}{unit}{at}: {closes}"


def _physics(row: HypothesisRow) -> str:
    """Return what has the shape, and which effect of the library, if any."""
    return f"{row.physics} ({row.library} has this shape)" if row.library else row.physics


def _next(test: NextTest, unit: str) -> str:
    voltages = test.voltage_V if isinstance(test.voltage_V, tuple) else (test.voltage_V,)
    parts = [
        test.waveform,
        _number(test.frequency_Hz, "Hz") if test.frequency_Hz is not None else "",
        _number(test.amplitude_m, "m") if test.amplitude_m is not None else "",
        f"about {test.middle_m:.6g} m" if test.middle_m is not None else "",
        f"at {' and '.join(_number(v, unit) for v in voltages)}" if voltages != (None,) else "",
    ]
    peaks = ((test.peak_speed_m_per_s, "m/s"), (test.peak_force_N, "N"))
    reached = [_number(value, of) for value, of in peaks if value is not None]
    far = f", up to {' and '.join(reached)}" if reached else ""
    aim = f" to tell {' from '.join(test.separates)}" if test.separates else ""
    if test.between_voltage_V is not None:
        low, high = (_number(voltage) for voltage in test.between_voltage_V)
        aim = f", since between {low} and {high} {unit} the force is known least"
    return f"next test: {' '.join(part for part in parts if part)}{far}{aim}"


COMMANDS = (check, show, compare)
