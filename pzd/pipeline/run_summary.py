"""The numbers of a finished run, for the commands that only print them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from pzd.artefacts import (
    ComfortRow,
    Diagnosed,
    Diagnosis,
    Identified,
    ParameterRow,
    Report,
    Rides,
    SummaryRow,
)
from pzd.config import control_of
from pzd.quantities import Control
from pzd.runs import CONFIG, Run
from pzd.schema.csvfile import read_rows
from pzd.schema.errors import ConfigError
from pzd.schema.jsonfile import read_json
from pzd.schema.yamlfile import read_yaml


@dataclass(frozen=True)
class RunSummary:
    """The numbers of a run; empty or None where a stage has not run."""

    folder: Path
    control: Control
    parameters: tuple[ParameterRow, ...]
    diagnosis: Diagnosis | None
    summary: tuple[SummaryRow, ...]
    comfort: tuple[ComfortRow, ...]
    page: Path | None
    """The report's page."""
    marks: tuple[str, ...]
    """Why the results are not to be trusted."""


def page_of(run: Run) -> Path:
    """Where the page of a run's report stands."""
    return run.folder / Report.folder / "report.html"


def run_summary(run: Run) -> RunSummary:
    """What stands in a run's folder, checked.

    Raises
    ------
    ConfigError : when nothing stands there
    DataError : when a file of it is at fault
    """
    manifests = {kind: run.stage_folder(kind.folder).manifest for kind in (Identified, Diagnosed, Rides, Report)}
    there = {kind for kind, manifest in manifests.items() if manifest is not None}
    if not there:
        raise ConfigError(f"{run.folder}: no results stand here yet; pzd run {run.config} makes them")
    at, control = run.folder, run.control
    diagnosis = at / Diagnosed.folder / "diagnosis.json"
    comfort = at / Report.folder / "comfort.csv"
    return RunSummary(
        at,
        control,
        run.read(Identified).rows if Identified in there else (),
        read_json(diagnosis, Diagnosis, control) if Diagnosed in there else None,
        read_rows(at / Rides.folder / "summary.csv", SummaryRow, control) if Rides in there else (),
        read_rows(comfort, ComfortRow, control) if Report in there else (),
        page_of(run) if Report in there else None,
        tuple(dict.fromkeys(mark for manifest in manifests.values() if manifest for mark in manifest.marks)),
    )


def summary_of(folder: Path) -> RunSummary:
    """What stands in a folder that a run wrote.

    Raises
    ------
    ConfigError : when it is no such folder
    DataError : when a file of it is at fault
    """
    written = folder / CONFIG
    if not written.is_file():
        raise ConfigError(f"{folder}: no run stands here, it has no {CONFIG}; give a folder like runs/quickstart")
    return run_summary(Run(folder, written, control_of(read_yaml(written).data)))
