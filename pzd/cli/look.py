"""The commands that only look: at a config, at a run, at several runs side by side."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from pzd.cli.output import CORES, DONE, RUNS, Config, Json, Output, Quiet, Runs, Set, Verbose
from pzd.cli.text_tables import aligned, filled, interval, number
from pzd.schema.errors import ConfigError, counted

# ----------------------------------------------------------------------------------------------------
# The numbers of several runs as one table: a line a number, a column a run.


if TYPE_CHECKING:
    from pzd.pipeline.run_summary import RunSummary

Column = dict[str, str]


def comparison(runs: Sequence[RunSummary]) -> list[list[str]]:
    """Rows of text; a dash where a run has no such number."""
    columns = [_parameters(run) | _diagnosis(run) | _rides(run) | _comfort(run) for run in runs]
    names = list(dict.fromkeys(name for column in columns for name in column))
    head = ["", *(str(run.folder) for run in runs)]
    return [head, *([name, *(column.get(name, "-") for column in columns)] for name in names)]


def _parameters(run: RunSummary) -> Column:
    column: Column = {}
    for row in run.parameters:
        place = [
            row.setting or "",
            *_with_unit(row.voltage_V, run.control.unit),
            *_with_unit(row.temperature_degC, "degC"),
        ]
        where = ", ".join(part for part in place if part) or "all records"
        column[f"T0 [N], {where}"] = interval(row.T0_N, row.T0_N_low95, row.T0_N_high95)
        column[f"C [N s/m], {where}"] = interval(row.C_Ns_per_m, row.C_Ns_per_m_low95, row.C_Ns_per_m_high95)
        column[f"k [N/m], {where}"] = interval(row.k_N_per_m, row.k_N_per_m_low95, row.k_N_per_m_high95)
        column[f"W_s, {where}"] = number(row.W_s)
    return column


def _with_unit(value: float | None, unit: str) -> list[str]:
    return [] if value is None else [f"{number(value)} {unit}"]


def _diagnosis(run: RunSummary) -> Column:
    found = run.diagnosis
    if found is None:
        return {}
    return {
        "verdict": found.verdict,
        "effects": ", ".join(found.effects) or "-",
        "confidence": number(found.confidence),
        "gap before": number(found.gap.before if found.gap else None),
        "gap after": number(found.gap.after if found.gap else None),
    }


def _rides(run: RunSummary) -> Column:
    column: Column = {}
    for row in run.summary:
        column[f"{row.case}: peak |a_K| at {row.point} [m/s2]"] = number(row.peak_abs_aK_m_per_s2)
        column[f"{row.case}: rms a_K at {row.point} [m/s2]"] = number(row.rms_aK_m_per_s2)
    return column


def _comfort(run: RunSummary) -> Column:
    return {
        f"{row.case}: {row.measure} at {row.point} [{row.unit}], {row.edition}": number(row.value)
        for row in run.comfort
    }


# ----------------------------------------------------------------------------------------------------
# What `--json` prints of a run: the numbers that people see, under the names that the files have.


if TYPE_CHECKING:
    from pzd.damper.effect import Effect, Parameter
    from pzd.pipeline.run_summary import RunSummary


def run_as_data(run: RunSummary) -> dict[str, Any]:
    """The numbers of a run as plain data, the control under its own name."""
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


def effects_as_data(effects: Iterable[Effect]) -> list[dict[str, Any]]:
    """The library as plain data; a limit that there is not is null."""
    return [
        {"name": e.name, "place": e.place, "law": e.law, "parameters": [_parameter(p) for p in e.parameters]}
        for e in effects
    ]


def _parameter(parameter: Parameter) -> dict[str, Any]:
    limits = {"low": parameter.low, "high": parameter.high, "neutral": parameter.neutral}
    finite = {name: value if math.isfinite(value) else None for name, value in limits.items()}
    return {"name": parameter.name, "unit": parameter.unit, "meaning": parameter.meaning} | finite


# ----------------------------------------------------------------------------------------------------


if TYPE_CHECKING:
    from pzd.artefacts import IngestRow, ParameterRow, RecordEntry
    from pzd.pipeline.run_summary import RunSummary

PlotFile = Annotated[
    Path | None,
    typer.Option("--plot", metavar="FILE.html", help="Draw every record on a page, with the findings marked."),
]
IsResolved = Annotated[
    bool,
    typer.Option("--resolved", help="Print every value of the config with its origin instead: line, --set, default."),
]
RunFolders = Annotated[list[Path], typer.Argument(metavar="RUN...", help="Folders of runs, e.g. runs/quickstart.")]


def check(
    config: Config,
    runs: Runs = RUNS,
    overrides: Set = None,
    plot: PlotFile = None,
    as_json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> int:
    """Check config, rig records and road files; write nothing but the page of --plot."""
    from pzd.pipeline.command import check_roads, check_setting, opened, preflight
    from pzd.schema.validate import plain_data

    output = Output(quiet=quiet, verbose=verbose)
    given = opened(config, runs, overrides or ())
    _only_a_page(plot)
    rig = preflight(given)
    entries, ingested = rig.entries, rig.ingested
    if plot is not None:
        from pzd.report.recorded import records_page

        plot.write_text(records_page(rig, given.run.control, CORES), encoding="utf-8", newline="\n")
    if as_json:
        output.say_json(plain_data({"config": config.as_posix(), "records": entries}, given.run.control))
        check_setting(given, entries)
        check_roads(given)
        return DONE
    for entry in entries:
        output.say(*_entry(entry), *(_ingested(ingested, entry.name) if verbose else ()))
    check_setting(given, entries)
    check_roads(given)
    found = sum(len(entry.findings) for entry in entries)
    wrote = f"the records are drawn in {plot}" if plot is not None else "nothing was written"
    output.say(f"{counted(len(entries), 'record')}, {counted(found, 'finding')}; the config is in order, {wrote}")
    return DONE


def _only_a_page(plot: Path | None) -> None:
    """Refuse to write the page over a file of another kind, say a record, or into a folder that is not there."""
    if plot is not None and not plot.parent.is_dir():
        raise ConfigError(f"--plot {plot}: there is no folder {plot.parent}; make it, or name another one")
    if plot is not None and plot.suffix.lower() != ".html":
        raise ConfigError(f"--plot {plot}: must end in .html, as it is a page (got {plot.suffix or 'no suffix'})")


def _entry(entry: RecordEntry) -> Iterator[str]:
    yield f"{entry.name}: {number(entry.cycles)} cycles at {number(entry.rate_Hz)} Hz"
    for finding in entry.findings:
        yield f"  {finding.check}: {finding.where}: {number(finding.size)} {finding.unit}; {finding.follows}"


def _ingested(rows: Sequence[IngestRow], record: str) -> Iterator[str]:
    """What was done to the file of one record."""
    for row in rows:
        if row.record == record:
            what = f"{row.step} {row.quantity}" if row.quantity else row.step
            yield f"  {row.file}: {what}: {row.was}" + (f" -> {row.became}" if row.became else "")


def show(
    config: Config,
    runs: Runs = RUNS,
    overrides: Set = None,
    resolved: IsResolved = False,
    as_json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> int:
    """Print the numbers in the run of a config.

    A stage whose numbers are of an older config, of other files or of other code is called stale, with the reason.
    """
    if resolved:
        return _show_resolved(config, runs, overrides or (), Output(quiet=quiet, verbose=verbose), as_json=as_json)
    from pzd.cli.text_tables import characteristics_tables, diagnosis_lines, knee_tables, settings_tables
    from pzd.pipeline.command import opened
    from pzd.pipeline.run_summary import summary_with_stale

    found = summary_with_stale(opened(config, runs, overrides or ()))
    output = Output(quiet=quiet, verbose=verbose)
    if as_json:
        output.say_json(run_as_data(found))
        return DONE
    output.say(f"run: {found.folder}", *stale_lines(found))
    for title, rows in characteristics_tables(found):
        _section(output, title, rows)
    for title, rows in knee_tables(found):
        _section(output, title, rows)
    _section(output, "parameters", _look_parameters(found))
    _section(
        output,
        "diagnosis",
        [[line] for line in diagnosis_lines(found.diagnosis, found.control, hypotheses=found.hypotheses)]
        if found.diagnosis
        else [],
    )
    for title, rows in settings_tables(found):
        _section(output, title, rows)
    _section(output, "rides", _look_rides(found))
    _section(output, "assumed, since the config does not say it", [[line] for line in found.assumed])
    _section(output, "comfort", _look_comfort(found))
    output.say(*(f"not to be trusted: {mark}" for mark in found.marks))
    output.say(f"report: {found.page or 'not written yet'}")
    return DONE


def _show_resolved(config: Path, runs: Path, overrides: Sequence[str], output: Output, *, as_json: bool) -> int:
    """Every value of the config with its origin; nothing needs to have run."""
    from pzd.pipeline.command import opened, resolved
    from pzd.schema.yamltree import written

    found = resolved(opened(config, runs, overrides))
    if as_json:
        output.say_json([vars(one) for one in found])
        return DONE
    rows = [[one.path, "[]" if one.value == [] else "{}" if one.value == {} else written(one.value)] for one in found]
    output.say(*aligned([[*row, one.origin] for row, one in zip(rows, found, strict=True)]))
    return DONE


def stale_lines(found: RunSummary, place: str = "") -> list[str]:
    """A line a stage whose numbers are not those of the config as it is today."""
    return [f"stale: {place}{stage}: {reason}" for stage, reason in found.stale.items()]


def _section(output: Output, title: str, rows: list[list[str]]) -> None:
    if rows:
        output.say("", f"{title}:", *aligned(rows, "  "))


def _look_parameters(found: RunSummary) -> list[list[str]]:
    control = found.control
    head = [
        "setting",
        f"{control.name} [{control.unit}]",
        "T [degC]",
        "T0 [N]",
        "C [N s/m]",
        "k [N/m]",
        "W_s",
        "status",
    ]
    return filled(head, [_parameter_row(row) for row in found.parameters], 3)


def _parameter_row(row: ParameterRow) -> list[str]:
    return [
        number(row.setting),
        number(row.voltage_V),
        number(row.temperature_degC),
        interval(row.T0_N, row.T0_N_low95, row.T0_N_high95),
        interval(row.C_Ns_per_m, row.C_Ns_per_m_low95, row.C_Ns_per_m_high95),
        interval(row.k_N_per_m, row.k_N_per_m_low95, row.k_N_per_m_high95),
        number(row.W_s),
        row.status,
    ]


def _look_rides(found: RunSummary) -> list[list[str]]:
    head = ["case", "point", "peak |a_K| [m/s2]", "rms a_K [m/s2]", "peak deflection [m]", "outside the table"]
    rows = [
        [
            row.case,
            row.point,
            number(row.peak_abs_aK_m_per_s2),
            number(row.rms_aK_m_per_s2),
            number(row.peak_deflection_m),
            f"{row.outside_table:.1%}",
        ]
        for row in found.summary
    ]
    return [head, *rows] if rows else []


def _look_comfort(found: RunSummary) -> list[list[str]]:
    return [
        [row.case, row.point, row.edition, row.measure, f"{number(row.value)} {row.unit}", row.status]
        for row in found.comfort
    ]


def compare(runs: RunFolders, as_json: Json = False, quiet: Quiet = False, verbose: Verbose = False) -> int:
    """Print the numbers of several runs side by side.

    A stage whose numbers are not those of the run's config as it is today is called stale, with the reason.
    """
    from pzd.pipeline.run_summary import summary_of

    output = Output(quiet=quiet, verbose=verbose)
    found = [summary_of(folder) for folder in runs]
    if as_json:
        output.say_json([run_as_data(run) for run in found])
        return DONE
    output.say(*aligned(comparison(found)))
    for run in found:
        output.say(*stale_lines(run, f"{run.folder}: "))
    return DONE


COMMANDS = (check, show, compare)
