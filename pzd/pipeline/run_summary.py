"""The numbers of a finished run, for the commands that only print them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

from pzd.artefacts import (
    Characteristics,
    ComfortRow,
    Diagnosed,
    Diagnosis,
    Hypotheses,
    Identified,
    Knees,
    MountedDampers,
    ParameterRow,
    Report,
    Rides,
    SettingLeftOutRow,
    SettingRow,
    SummaryRow,
    Table,
)
from pzd.artefacts.mounted import NOTES
from pzd.config import control_of, read_config, validated
from pzd.pipeline.command import Opened, stale_stages
from pzd.quantities import Control
from pzd.runs import CONFIG, Run
from pzd.schema.csvfile import read_rows
from pzd.schema.errors import ConfigError, UserError
from pzd.schema.yamlfile import read_yaml

if TYPE_CHECKING:
    from pzd.report.runs_page import ComparedRun


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
    assumed: tuple[str, ...] = ()
    """What the rides assume since the config does not say it."""
    stale: Mapping[str, str] = field(default_factory=dict)
    """Why results are not those of the config as it is today, by stage."""
    characteristics: Characteristics = field(default_factory=Characteristics)
    """What the tests show without any model."""
    knees: Knees = field(default_factory=Knees)
    """The knee law, where the config asks for it."""
    settings: tuple[SettingRow, ...] = ()
    """The force at settings between tested ones, where the config asks for some."""
    settings_left_out: tuple[SettingLeftOutRow, ...] = ()
    """How well tested settings are predicted from their neighbours."""
    hypotheses: Hypotheses = field(default_factory=Hypotheses)
    """Which shape what is left has, where the verdict is `unexplained`."""
    mounted: MountedDampers | None = None
    """The dampers, where they are known without a rig."""


COMPARISONS = "compare"
"""Folder of a run, with a page for each set of runs that it was the last of."""
_LONGEST_NAME = 120
"""Characters of the name of such a page: file systems take 255 bytes."""


def page_of(run: Run) -> Path:
    """Where the page of a run's report stands."""
    return run.folder / Report.folder / "report.html"


def answer_of(run: Run) -> tuple[str, ...]:
    """Return what came out of a run, in a few sentences; nothing before there is a report."""
    return Report.read_answer(run.folder / Report.folder)


def run_summary(run: Run) -> RunSummary:
    """Return the numbers in a run's folder, checked, under the name that the control had when they were written.

    Raises
    ------
    ConfigError : when there are none
    DataError : when a file of it is at fault
    """
    manifests = {kind: run.stage_folder(kind.folder).manifest for kind in (Identified, Diagnosed, Table, Rides, Report)}
    there = {kind for kind, manifest in manifests.items() if manifest is not None}
    if not there:
        raise ConfigError(f"{run.folder}: there are no results yet; pzd run {run.config} makes them")
    at = run.folder
    control = control_of(read_yaml(at / CONFIG).data) if (at / CONFIG).is_file() else run.control
    run = replace(run, control=control)
    identified = run.read(Identified) if Identified in there else Identified((), ())
    diagnosed = run.read(Diagnosed) if Diagnosed in there else None
    comfort = at / Report.folder / "comfort.csv"
    settings = Table.read_settings(at / Table.folder, control) if Table in there else ((), ())
    return RunSummary(
        at,
        control,
        identified.rows,
        diagnosed.diagnosis if diagnosed else None,
        read_rows(at / Rides.folder / "summary.csv", SummaryRow, control) if Rides in there else (),
        read_rows(comfort, ComfortRow, control) if Report in there else (),
        page_of(run) if Report in there else None,
        tuple(dict.fromkeys(mark for manifest in manifests.values() if manifest for mark in manifest.marks)),
        characteristics=identified.characteristics,
        knees=identified.knees,
        settings=settings[0],
        settings_left_out=settings[1],
        hypotheses=diagnosed.hypotheses if diagnosed else Hypotheses(),
    )


def summary_with_stale(given: Opened) -> RunSummary:
    """Return the numbers of a config's run, what they assume, and why they may be those of an older config.

    Raises
    ------
    ConfigError : when there are none
    DataError : when a file of the run is at fault
    """
    return _beside_its_config(run_summary(given.run), given)


def summary_of(folder: Path) -> RunSummary:
    """Return the numbers in a folder that a run wrote, with what makes them stale against the config that it is of.

    Raises
    ------
    ConfigError : when it is no such folder
    DataError : when a file of it is at fault
    """
    written = folder / CONFIG
    if not folder.is_dir():
        what = "this is a file" if folder.exists() else "there is no such folder"
        raise ConfigError(f"{folder}: {what}; give the folder of a run, like runs/quickstart")
    if not written.is_file():
        raise ConfigError(f"{folder}: this folder holds no run, it has no {CONFIG}; give a folder like runs/quickstart")
    run = Run(folder, written, control_of(read_yaml(written).data))
    found, config = run_summary(run), run.config_of_results()
    if config is None or not config.is_file():
        lost = f"their config {config or ''} is missing, so nobody can say whether these are its numbers"
        return replace(found, stale={"all": lost})
    try:
        document = read_config(config)
        return _beside_its_config(found, Opened(document, validated(document), replace(run, config=config)))
    except UserError as error:
        return replace(found, stale={"all": f"their config would be refused: {'; '.join(error.messages)}"})


def compared_runs(found: Sequence[RunSummary]) -> tuple[ComparedRun, ...]:
    """Return what `pzd compare` shows of several runs, each in its setting in use.

    Raises
    ------
    DataError : when a file of a run is at fault
    """
    folders = [run.folder for run in found]
    alike = {folder.name for folder in folders if [one.name for one in folders].count(folder.name) > 1}
    return tuple(_compared(run, str(run.folder) if run.folder.name in alike else run.folder.name) for run in found)


def _compared(found: RunSummary, name: str) -> ComparedRun:
    from pzd.report.damper_models import DamperModels
    from pzd.report.runs_page import ComparedRun

    run = Run(found.folder, found.folder / CONFIG, found.control)
    chosen = read_yaml(run.config).data.get("setting")
    has = {kind for kind in (Diagnosed, Table) if run.stage_folder(kind.folder).manifest is not None}
    rows = tuple(row for row in found.parameters if chosen in (None, row.setting))
    diagnosed = run.read(Diagnosed) if Diagnosed in has and found.mounted is None else None
    return ComparedRun(
        name,
        found.control,
        DamperModels(diagnosed, rows).final_parameters if diagnosed else rows,
        found.diagnosis,
        diagnosed.damper if diagnosed else None,
        run.read(Table).force if Table in has else (),
        tuple(row for row in found.characteristics.peak_velocity if chosen in (None, row.setting)),
        found.comfort,
        rows,
    )


def write_runs_page(found: Sequence[RunSummary], compared: Sequence[ComparedRun], warnings: Sequence[str]) -> Path:
    """Write the page that compares runs into the folder of the last one, and return its path.

    Parameters
    ----------
    found : the runs
    compared : the same, as the page shows them
    warnings : why numbers of a run are not those of its config as it is today, or not to be trusted

    Raises
    ------
    FilesError : when the disk does not take it, or another command is at work in the run
    """
    from pzd.pipeline.state_comparison import comparison_name, write_comparison
    from pzd.report.runs_page import runs_page

    page = runs_page(compared, warnings)
    run = Run(found[-1].folder, found[-1].folder / CONFIG, found[-1].control)
    name = comparison_name(*(one.folder.resolve().name for one in found), between="--and--")[:_LONGEST_NAME]
    with run.locked("pzd compare"):
        write = {"html": lambda path: path.write_text(page, encoding="utf-8", newline="\n")}
        return write_comparison(run, COMPARISONS, name, write) / f"{name}.html"


def _mounted_of(given: Opened) -> MountedDampers | None:
    """Return the dampers of a run without a rig; None where its first stage has not run."""
    there = (given.run.folder / MountedDampers.folder / NOTES).is_file()
    return given.run.read(MountedDampers) if there else None


def _beside_its_config(found: RunSummary, given: Opened) -> RunSummary:
    """Add what the config says of the numbers: what is stale, and what the rides assume."""
    from pzd.simulate.study.plan import assumed

    if given.config.damper is not None:  # what the run of a rig left in the folder is none of this one
        nothing = RunSummary(
            found.folder, found.control, (), None, found.summary, found.comfort, found.page, found.marks
        )
        found = replace(nothing, mounted=_mounted_of(given))
    ride = given.config.simulate
    if found.mounted is not None:
        ride = ride.by_tables() if found.mounted.by_curve else ride
        effects, with_voltage = found.mounted.effects, found.mounted.controlled
    else:
        effects = found.diagnosis.effects if found.diagnosis else ()
        with_voltage = all(row.voltage_V is not None for row in found.parameters)
    if not given.config.car:  # rides that an earlier config left in the folder are none of this run
        found = replace(found, summary=(), comfort=())
    lines = assumed(ride, effects, with_voltage) if found.summary else ()
    return replace(found, stale=stale_stages(given), assumed=lines)
