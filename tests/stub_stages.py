"""Stub stages that take no time: signatures and artefacts of the real ones, numbers that show what they depend on."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pzd.artefacts import (
    AXLE_COLUMNS,
    AXLES,
    RIDE_COLUMNS,
    ComfortRow,
    Diagnosed,
    Diagnosis,
    Finding,
    ForceRow,
    Gap,
    Identified,
    InverseRow,
    NextTest,
    ParameterRow,
    RecordEntry,
    Region,
    Report,
    Ride,
    RideRow,
    Rides,
    Rig,
    SummaryRow,
    Table,
    TableNotes,
    base_of,
)
from pzd.config import RunConfig
from pzd.diagnosis.config import DiagnoseConfig
from pzd.force_table.config import TableConfig
from pzd.identification.config import IdentifyConfig
from pzd.pipeline.stages import Stage
from pzd.quantities import Control
from pzd.record import Record
from pzd.report.config import ReportConfig
from pzd.rig.config import RigConfig
from pzd.rig.files.reading import listed
from pzd.schema.errors import DataError
from pzd.simulate.config import SimulateConfig

NAMES = ["ingest", "identify", "diagnose", "table", "simulate", "report"]
UNDETERMINED = 99
"""A seed with which C is undetermined."""
LOUD = Finding(check="range", where="all of it", size=901.0, unit="N", follows="look at the load cell")
"""Found in a test with more than 900 N."""
TWO_LEVELS = Finding(check="level", where="force", size=1.6, unit="-", follows="one fit to both is neither")
"""Found in a test with more than 1000 N as well."""
NEXT_TEST = NextTest(
    waveform="sine",
    frequency_Hz=4.0,
    amplitude_m=0.01,
    voltage_V=150.0,
    separates=("orifice_quadratic", "shear_thinning"),
    middle_m=0.03135,
    peak_speed_m_per_s=0.251327,
    peak_force_N=1512.345,
)


def ingest(rig: RigConfig, control: Control, folder: Path) -> Rig:
    """A record a file: the first line of the file is its force."""
    files = listed(rig.files or (), folder)
    wrong = [one.path for one in files if one.path.read_text() == "nonsense"]
    if wrong:
        raise DataError(f"{path}:1: a number is needed (got nonsense)" for path in wrong)
    records = tuple(_record(one.path, one.entry.setting) for one in files)
    entries = [
        RecordEntry(
            name=r.name,
            setting=r.setting,
            voltage_V=1.0,
            temperature_degC=22.0,
            rate_Hz=1.0,
            cycles=0.0,
            findings=((LOUD, TWO_LEVELS) if r.force[0] > 1000.0 else (LOUD,)) if r.force[0] > 900.0 else (),
        )
        for r in records
    ]
    return Rig(records, tuple(entries))


def _record(path: Path, setting: str | None) -> Record:
    level = np.full(3, float(path.read_text()))
    time = np.arange(3.0)
    return Record(path.stem, setting, time, level, level, level, level, np.ones(3), np.full(3, 22.0))


def identify(identify: IdentifyConfig, rig: Rig, seed: int) -> Identified:
    """A row a setting: T0 is the mean force, k the seed in N/mm times 100."""
    rows = []
    for setting in sorted({record.setting for record in rig.records}, key=str):
        level = float(np.mean([record.force[0] for record in rig.records if record.setting == setting]))
        damping = None if seed == UNDETERMINED else 2.0
        rows.append(
            ParameterRow(
                setting=setting,
                voltage_V=1.0,
                temperature_degC=22.0,
                W_s=0.01,
                rmse_N=1.0,
                T0_N=level,
                T0_N_low95=level,
                T0_N_high95=level,
                C_Ns_per_m=damping,
                C_Ns_per_m_low95=damping,
                C_Ns_per_m_high95=damping,
                k_N_per_m=1e5 * seed,
                k_N_per_m_low95=None,
                k_N_per_m_high95=None,
                status="ok" if damping else "undetermined: C, the records are too slow",
            )
        )
    return Identified(tuple(rows), ())


def diagnose(diagnose: DiagnoseConfig, rig: Rig, identified: Identified, setting: str | None) -> Diagnosed:
    """Nothing missing; the significance shows as the noise floor."""
    gap = Gap(
        before=0.01,
        after=0.01,
        noise_floor=diagnose.significance,
        standard_error=0.001,
        held_out=("a",),
        hold_out="records",
    )
    reason = f"{len(rig.records)} records are explained"
    where = (Region(region="abs(v) > 0.25 m/s", share_of_gap=0.7),)
    told = Diagnosis.without_effects("none", reason, gap, where)
    damper = base_of(identified.rows, setting)
    return Diagnosed(told, damper, damper)


def tabulate(
    table: TableConfig, rig: Rig, identified: Identified, diagnosed: Diagnosed, control: Control, setting: str | None
) -> Table:
    """One node; the largest speed is that of the config."""
    force = diagnosed.damper.base[0].T0_N
    row = ForceRow(temperature_degC=22.0, voltage_V=1.0, velocity_m_per_s=0.1, force_N=force, inside=1)
    inverse = InverseRow(temperature_degC=22.0, velocity_m_per_s=0.1, force_N=force, voltage_V=1.0)
    notes = TableNotes(outside=table.outside, reached_m_per_s=table.speed_max_m_per_s, lost=(), not_monotone=())
    return Table((row,), (inverse,), notes)


def simulate(simulate: SimulateConfig, diagnosed: Diagnosed, table: Table, seed: int) -> Rides:
    """One ride whose peak is the table's force."""
    names = (*RIDE_COLUMNS, *(name.format(axle) for axle in AXLES for name in AXLE_COLUMNS))
    ride = Ride("sine-comfort-ideal", {name: np.zeros(2) for name in names})
    summary = SummaryRow(
        case=ride.case,
        road="sine",
        policy="comfort",
        fidelity="ideal",
        point="K",
        peak_abs_aK_m_per_s2=float(table.force[0].force_N or 0.0),
        rms_aK_m_per_s2=1.0,
        rms_jerk_m_per_s3=1.0,
        peak_deflection_m=0.1,
        rms_wheel_load_N=1.0,
        dissipated_J=1.0,
        energy_error=1e-9,
        outside_table=0.0,
    )
    ridden = RideRow(
        case=ride.case,
        from_s=0.0,
        to_s=1.0,
        ending="end of the ride",
        voltage_V=None,
        damping_Ns_per_m=None,
        history="csv",
    )
    return Rides((ride,), (summary,), (ridden,))


def report(report: ReportConfig, rides: Rides, control: Control, setting: str | None, folder: Path) -> Report:
    """One measure, and a page of a line."""
    row = ComfortRow(
        case="sine-comfort-ideal",
        point="K",
        edition="ISO 2631-1:1997",
        measure="a_w",
        value=rides.summary[0].peak_abs_aK_m_per_s2,
        unit="m/s2",
        status="verified",
    )
    return Report((row,), f"<p>{report.daily_exposure_h} h</p>\n", answer=("The answer.", "What rides best."))


_FUNCTIONS: dict[str, Callable[..., Any]] = dict(
    zip(NAMES, (ingest, identify, diagnose, tabulate, simulate, report), strict=True)
)
_PACKAGES = {"ingest": "rig", "identify": "identification", "diagnose": "diagnosis", "table": "force_table"}
for _name, _function in _FUNCTIONS.items():
    _function.__module__ = f"pzd.{_PACKAGES.get(_name, _name)}.stage"


def stages(config: RunConfig) -> tuple[Stage, ...]:
    """The stand-ins in order."""
    first = Stage("synthesise" if config.rig.virtual else "ingest", ingest)
    return (first, *(Stage(name, _FUNCTIONS[name]) for name in NAMES[1:]))


def project(folder: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with two rig files, and a config that the stand-ins can run."""
    monkeypatch.setattr("pzd.pipeline.command.stages", stages)
    monkeypatch.setattr("os.fsync", lambda _: None)  # the disk's time is not what these tests are about
    (folder / "data").mkdir(parents=True)
    (folder / "data" / "a.csv").write_text("100")
    (folder / "data" / "b.csv").write_text("300")
    config = folder / "first.yaml"
    config.write_text("rig:\n  files:\n    - path: data/*.csv\n")
    return config
