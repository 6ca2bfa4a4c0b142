"""The commands that only look: at a config, at a run, at several runs side by side."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from pzd.cli.options import CORES, Call, Json, Quiet, Verbose, on_config
from pzd.cli.output import DONE, Output
from pzd.report.diagnosis_text import diagnosis_lines, shown
from pzd.schema.errors import ConfigError, counted

if TYPE_CHECKING:
    from pzd.artefacts import IngestRow, MountedDampers, RecordEntry
    from pzd.pipeline.run_summary import RunSummary
    from pzd.report.columns import Table
    from pzd.report.runs_page import ComparedRun

PlotFile = Annotated[
    Path | None,
    typer.Option("--plot", metavar="FILE.html", help="Draw every record on a page, with the findings marked."),
]
IsResolved = Annotated[
    bool,
    typer.Option("--resolved", help="Print every value of the config with its origin instead: line, --set, default."),
]
RunFolders = Annotated[list[Path], typer.Argument(metavar="RUN...", help="Folders of runs, e.g. runs/quickstart.")]


# --- pzd check ---


@on_config("as_json")
def check(call: Call, plot: PlotFile = None) -> int:
    """Check config, rig records and road files; write nothing but the page of --plot."""
    from pzd.pipeline.command import check_roads, check_setting, preflight
    from pzd.schema.validate import plain_data

    given, output = call.opened, call.output
    _check_plot(plot)
    if given.config.damper is not None:
        return _check_mounted(call, plot)
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


def _check_mounted(call: Call, plot: Path | None) -> int:
    """Check dampers that are known without a rig, and say how they were read."""
    from pzd.pipeline.command import check_roads, mounted_dampers
    from pzd.schema.validate import plain_data

    if plot is not None:
        raise ConfigError(
            f"--plot {plot}: draws the records of a rig, and this config has none; pzd report draws curves"
        )
    mounted, output = mounted_dampers(call.opened), call.output
    check_roads(call.opened)
    if output.as_json:
        notes = [axle.notes for axle in mounted.axles]
        output.say_json(plain_data({"config": call.config.as_posix(), "dampers": notes}, call.opened.run.control))
    for name, axle in mounted.named_axles:
        output.say(f"{name or 'front and rear'}: {axle.notes.source}", *(f"  {line}" for line in axle.notes.read))
    output.say("the config is in order, nothing was written")
    return DONE


def _check_plot(plot: Path | None) -> None:
    """Refuse to write the page over a file of another kind, say a record, or into a folder that is not there."""
    if plot is not None and not plot.parent.is_dir():
        raise ConfigError(f"--plot {plot}: there is no folder {plot.parent}; make it, or name another one")
    if plot is not None and plot.suffix.lower() != ".html":
        raise ConfigError(f"--plot {plot}: must end in .html, as it is a page (got {plot.suffix or 'no suffix'})")


def _entry(entry: RecordEntry) -> Iterator[str]:
    yield f"{entry.name}: {shown(entry.cycles)} cycles at {shown(entry.rate_Hz, 'Hz')}"
    for finding in entry.findings:
        yield f"  {finding.check}: {finding.where}: {shown(finding.size)} {finding.unit}; {finding.follows}"


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
    if found.mounted is not None:
        yield "dampers", [f"  {line}" for line in _mounted_lines(found.mounted)]
    yield _titled(tables.parameters(found.parameters, found.control).without("rmse_N"))
    lines = diagnosis_lines(found.diagnosis, found.control, hypotheses=found.hypotheses) if found.diagnosis else []
    yield "diagnosis", [f"  {line}" for line in lines]
    yield _titled(tables.interpolated_settings(found.settings, found.control))
    yield _titled(tables.left_out_settings(found.settings_left_out))
    yield _titled(tables.rides(found.summary))
    yield "assumed, since the config does not say it", [f"  {line}" for line in found.assumed]
    yield _titled(tables.comfort(found.comfort))


def _mounted_lines(mounted: MountedDampers) -> Iterator[str]:
    """Yield where the dampers of a run without a rig come from, and how they were read."""
    for name, axle in mounted.named_axles:
        yield f"{name or 'front and rear'}: {axle.notes.source}; {'; '.join(axle.notes.read)}"


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
    """Print the numbers of several runs side by side, and write a page with their curves over one another.

    Of the comfort of each ride a_w is printed, with --verbose every measure. The page tells the differences in percent,
    and which are beyond the intervals; it stands in the folder `compare` of the last run. A stage whose numbers are not
    those of its config as it is today is called stale, with the reason.
    """
    from pzd.pipeline.run_summary import compared_runs, summary_of, write_runs_page
    from pzd.report.columns import aligned

    output = Output(quiet=quiet, verbose=verbose, as_json=as_json)
    found = [summary_of(folder) for folder in runs]
    compared = compared_runs(found)
    if as_json:
        output.say_json([_run_as_data(run) for run in found])
    parameters = dict(_parameters(compared))
    columns = [
        {name: cells[one.name] for name, cells in parameters.items() if one.name in cells}
        | dict(_numbers(run, every_measure=verbose))
        for run, one in zip(found, compared, strict=True)
    ]
    names = dict.fromkeys([*parameters, *(name for column in columns for name in column)])
    head = ["", *(str(run.folder) for run in found)]
    output.say(*aligned([head, *([name, *(column.get(name, "-") for column in columns)] for name in names)]))
    if not verbose and any(row.measure != "a_w" for run in found for row in run.comfort):
        output.say("further measures of comfort: --verbose prints them")
    stale = [line for run in found for line in _stale_lines(run, f"{run.folder}: ")]
    output.say(*stale)
    if len({run.folder.resolve() for run in found}) > 1:
        marks = [f"not to be trusted: {run.folder}: {mark}" for run in found for mark in run.marks]
        output.say(f"page: {write_runs_page(found, compared, [*stale, *marks])}")
    return DONE


def _parameters(runs: Sequence[ComparedRun]) -> Iterator[tuple[str, dict[str, str]]]:
    """Yield the names of T0, C, k and W_s with what each run has, conditions matched as on the page."""
    from pzd.quantities import BINGHAM
    from pzd.report import tables
    from pzd.report.blocks import typewritten
    from pzd.report.columns import TERMINAL
    from pzd.report.runs_page import matched

    columns = {column.name: column for column in tables.parameters((), runs[0].control).columns}
    element = [columns[quantity.column] for quantity in BINGHAM]
    fitted = [run for run in runs if run.parameters]
    if fitted:
        yield "T0, C and k of", {run.name: "adopted damper" if run.damper else "simple model" for run in fitted}
    for rows_of, shown_columns, of in (
        (lambda run: run.parameters, element, ""),
        (lambda run: run.identified, [columns["W_s"]], " of the simple model"),
    ):
        for place in matched(runs, rows_of):
            for column in shown_columns:
                name = f"{column.heading(TERMINAL)}{of}, {typewritten(place.words)}"
                yield name, {run: column.text(row, TERMINAL) for run, row in place.rows.items()}


def _numbers(run: RunSummary, *, every_measure: bool) -> Iterator[tuple[str, str]]:
    """Yield names and values of the other numbers of a run that are compared with those of others.

    Parameters
    ----------
    run : the run
    every_measure : whether every measure of comfort is wanted, or a_w alone
    """
    if run.diagnosis is not None:
        yield "verdict", run.diagnosis.verdict
        yield "effects", ", ".join(run.diagnosis.effects) or "-"
        yield "confidence", shown(run.diagnosis.confidence)
        yield "W_s on held-out data, baseline", shown(run.diagnosis.gap.before if run.diagnosis.gap else None)
        yield "W_s on held-out data, adopted damper", shown(run.diagnosis.gap.after if run.diagnosis.gap else None)
    for ride in run.summary:
        yield f"{ride.case}: peak |a_K| at {ride.point} [m/s2]", shown(ride.peak_abs_aK_m_per_s2)
        yield f"{ride.case}: rms a_K at {ride.point} [m/s2]", shown(ride.rms_aK_m_per_s2)
    for measure in (row for row in run.comfort if every_measure or row.measure == "a_w"):
        name = f"{measure.case}: {measure.measure} at {measure.point} [{measure.unit}], {measure.edition}"
        yield name, shown(measure.value)


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
        "dampers": [axle.notes for axle in run.mounted.axles] if run.mounted else [],
        "rides": run.summary,
        "assumed": run.assumed,
        "comfort": run.comfort,
        "report": run.page.as_posix() if run.page else None,
    }
    data: dict[str, Any] = plain_data(numbers, run.control)
    return data


COMMANDS = (check, show, compare)
