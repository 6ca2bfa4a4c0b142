"""A small run made by hand: rig, parameters, verdict, table and rides whose numbers are known."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pytest
from stub_stages import NEXT_TEST

from pzd.artefacts import (
    Diagnosed,
    Diagnosis,
    Finding,
    ForceRow,
    Gap,
    HeldOutTest,
    HeldOutVoltage,
    Identified,
    MeasureRow,
    ParameterRow,
    Prediction,
    Ranked,
    RecordEntry,
    Region,
    Report,
    Response,
    Ride,
    RideRow,
    Rides,
    Rig,
    SpectrumRow,
    SummaryRow,
    Table,
    TableNotes,
    Value,
    WeightedRow,
    WheelRow,
)
from pzd.artefacts.identified import StepRow
from pzd.damper.compose import respond, steady_force
from pzd.damper.model import BaseRow, Damper
from pzd.damper.motion import Motion
from pzd.identification.characteristics import characteristics
from pzd.quantities import Control
from pzd.record import Record, conditions
from pzd.report.config import ReportConfig
from pzd.report.ride_comfort import RatedRide, rated
from pzd.report.stage import report
from pzd.simulate.config import SimulateConfig
from pzd.simulate.ride.outcome import settled
from pzd.simulate.study.gathering import spectrum_rows, weighted_row

BASELINE = Damper(
    base=(
        BaseRow(voltage_V=0.0, temperature_degC=22.0, T0_N=474.0, C_Ns_per_m=2260.0, k_N_per_m=263000.0),
        BaseRow(voltage_V=150.0, temperature_degC=22.0, T0_N=760.0, C_Ns_per_m=4000.0, k_N_per_m=280000.0),
    )
)
FINAL = BASELINE.with_effect("orifice_quadratic", {"q": 1510.0})
SETTLE_S, RATE_HZ, DURATION_S = 4.0, 500.0, 20.0
VOLTS = Control()
STEP = StepRow(
    record="r09",
    setting="gap 0.25 mm",
    temperature_degC=22.0,
    time_s=1.5,
    from_voltage_V=0.0,
    to_voltage_V=150.0,
    velocity_m_per_s=0.1,
    from_force_N=400.0,
    to_force_N=1400.0,
    to_63_percent_s=0.0041,
    to_90_percent_s=0.0123,
    status="ok",
)


@dataclass(frozen=True)
class Run:
    """What the report takes."""

    rig: Rig
    identified: Identified
    diagnosed: Diagnosed
    table: Table
    rides: Rides
    control: Control = VOLTS
    setting: str | None = "gap 0.25 mm"
    simulate: SimulateConfig = field(default_factory=SimulateConfig)

    def told(self, config: ReportConfig | None = None, jobs: int = 1, folder: Path = Path()) -> Report:
        """The report of this run."""
        parts = (self.rig, self.identified, self.diagnosed, self.table, self.rides)
        return report(config or ReportConfig(), self.simulate, *parts, self.control, self.setting, folder, jobs)

    def with_diagnosis(self, damper: Damper = BASELINE, **changes: object) -> Run:
        """The same run with another verdict."""
        diagnosis = self.diagnosed.diagnosis.model_copy(update=changes)
        return replace(self, diagnosed=Diagnosed(diagnosis, damper, BASELINE))

    def with_rides(self, made: Sequence[Made]) -> Run:
        """The same run with other rides."""
        return replace(self, rides=rides_of(made))


def record(name: str, frequency: float, amplitude: float, voltage: float | None) -> Record:
    """A sine on the final damper, four cycles, with a little of what no model knows."""
    time = np.arange(round(4.0 / frequency * 500.0) + 1) / 500.0
    w = 2.0 * np.pi * frequency
    x, v, a = (amplitude * f for f in (np.sin(w * time), w * np.cos(w * time), -(w**2) * np.sin(w * time)))
    volts, degrees = np.full(time.size, 0.0 if voltage is None else voltage), np.full(time.size, 22.0)
    force = respond(FINAL, Motion(time, x, v, a, volts, degrees))
    force = force + 21.0 * np.sin(2.0 * np.pi * 41.3 * time)
    return Record(name, "gap 0.25 mm", time, x, v, a, force, volts if voltage is not None else None, degrees)


def entry(of: Record, findings: tuple[Finding, ...] = ()) -> RecordEntry:
    return RecordEntry(
        name=of.name,
        setting=of.setting,
        voltage_V=of.median_voltage(),
        temperature_degC=of.median_temperature(),
        rate_Hz=of.rate,
        cycles=4.0,
        findings=findings,
    )


def rig() -> Rig:
    tests = [
        (f"r{i:02d}", *test)
        for i, test in enumerate(((2.0, 0.03, 0.0), (2.0, 0.03, 150.0), (1.0, 0.022, 0.0), (1.0, 0.022, 150.0)))
    ]
    records = tuple(record(*test) for test in tests)
    spike = Finding(
        check="spike",
        where="0.412 s",
        size=312.0,
        unit="N",
        follows="one sample of the force stands out; W_s rises a little",
    )
    return Rig(records, (entry(records[0], (spike,)), *(entry(r) for r in records[1:])))


def identified() -> Identified:
    rows = tuple(
        ParameterRow(
            setting="gap 0.25 mm",
            voltage_V=base.voltage_V,
            temperature_degC=22.0,
            T0_N=base.T0_N,
            T0_N_low95=base.T0_N - 9.0,
            T0_N_high95=base.T0_N + 11.0,
            C_Ns_per_m=base.C_Ns_per_m,
            C_Ns_per_m_low95=base.C_Ns_per_m - 31.0,
            C_Ns_per_m_high95=base.C_Ns_per_m + 33.0,
            k_N_per_m=None if i else base.k_N_per_m,
            k_N_per_m_low95=None if i else 2.4e5,
            k_N_per_m_high95=None if i else 2.9e5,
            W_s=0.0121,
            rmse_N=88.2,
            status="undetermined: k (the stroke hardly reaches slip)" if i else "ok",
        )
        for i, base in enumerate(BASELINE.base)
    )
    measures = (
        MeasureRow(
            record="r00",
            setting="gap 0.25 mm",
            voltage_V=0.0,
            temperature_degC=22.0,
            frequency_Hz=2.0,
            amplitude_m=0.03,
            peak_velocity_m_per_s=0.377,
            peak_force_N=1514.0,
            force_at_zero_velocity_N=470.0,
            work_per_cycle_J=120.0,
            equivalent_damping_Ns_per_m=3400.0,
            dynamic_range=None,
        ),
    )
    shown = characteristics(*conditions(rig().records))
    return Identified(rows, measures, characteristics=replace(shown, steps=(STEP,)))


def diagnosis() -> Diagnosis:
    return Diagnosis(
        verdict="named",
        reason="orifice_quadratic closes 99 % of the gap and agrees between two halves of the tests",
        effects=("orifice_quadratic",),
        confidence=0.97,
        gap=Gap(
            before=0.0121,
            after=0.0009,
            noise_floor=0.0008,
            standard_error=0.00004,
            held_out=("r02", "r03"),
            hold_out="records",
        ),
        parameters={"orifice_quadratic": {"q": Value(value=1510.0, low95=1490.0, high95=1530.0, unit="N s2/m2")}},
        ranking=(
            Ranked(
                effect="orifice_quadratic",
                gap_after=0.0009,
                delta_bic=-5120.3,
                parameters={"q": 1510.0},
                reason="adopted",
            ),
            Ranked(
                effect="shear_thinning",
                gap_after=0.004,
                delta_bic=-800.0,
                parameters={"n": 0.9},
                reason="stand-in",
                gap_standard_error=0.0005,
            ),
        ),
        rivals=(),
        where=(Region(region="abs(v) > 0.25 m/s, 150 V", share_of_gap=0.71),),
        prediction=Prediction(
            hold_out="tests",
            by=(HeldOutTest(record="r03", voltage=150.0, W_s_plain=0.0123, W_s=0.00091),),
            W_s_plain=0.0124,
            W_s=0.00092,
            left_out_voltages=(HeldOutVoltage(voltage=75.0, W_s_plain=0.0222, W_s=0.0111),),
        ),
        next_test=NEXT_TEST,
    )


def diagnosed() -> Diagnosed:
    """The verdict, and the final damper with intervals narrower than those of the simple model."""
    fitted = tuple(
        row.model_copy(update={"T0_N_low95": base.T0_N - 5.0, "T0_N_high95": base.T0_N + 6.0, "status": "ok"})
        for row, base in zip(identified().rows, FINAL.base, strict=True)
    )
    return Diagnosed(diagnosis(), FINAL, BASELINE, fitted)


def table() -> Table:
    speeds = [s for v in (0.1, 0.2, 0.377, 0.6) for s in (-v, v)]
    rows = tuple(
        ForceRow(
            temperature_degC=22.0,
            voltage_V=voltage,
            velocity_m_per_s=speed,
            force_N=float(steady_force(FINAL, voltage, 22.0, speed)),
            inside=1 if abs(speed) < 0.4 else 0,
        )
        for voltage in (0.0, 150.0)
        for speed in sorted(speeds)
    )
    notes = TableNotes(outside="model", reached_m_per_s=0.377, lost=("the oil spring's memory",), not_monotone=())
    return Table(rows, (), notes)


@dataclass(frozen=True)
class Made:
    """A ride whose acceleration at K is known, with its row of every table."""

    ride: Ride
    row: SummaryRow
    ridden: RideRow
    wheels: tuple[WheelRow, ...]
    weighted: WeightedRow
    spectrum: tuple[SpectrumRow, ...]

    def rated(self) -> RatedRide:
        """As the report rates it."""
        return rated(rides_of([self]))[0]


def made(
    case: str,
    road: str,
    policy: str,
    fidelity: str,
    harmonics: dict[float, float],
    fundamental: float | None = None,
    settle: float = SETTLE_S,
    held: dict[str, float] | None = None,
) -> Made:
    """A ride whose acceleration at K is a sum of sines, each with its amplitude."""
    time = np.arange(round(DURATION_S * RATE_HZ) + 1) / RATE_HZ
    a = np.sum([size * np.sin(2.0 * np.pi * f * time + 0.4) for f, size in harmonics.items()], axis=0)
    row = SummaryRow(
        case=case,
        road=road,
        policy=policy,
        fidelity=fidelity,
        point="K",
        peak_abs_aK_m_per_s2=float(np.abs(a).max()),
        rms_aK_m_per_s2=float(np.sqrt(np.mean(a**2))),
        rms_jerk_m_per_s3=12.0,
        peak_deflection_m=0.034,
        rms_wheel_load_N=1000.0 if policy == "comfort" else 800.0,
        dissipated_J=950.0,
        energy_error=3e-9,
        outside_table=0.31,
    )
    ridden = RideRow(
        case=case,
        from_s=settle,
        to_s=DURATION_S,
        ending="end of the ride",
        voltage_V=None,
        damping_Ns_per_m=None,
        history="csv",
    ).model_copy(update=held or {})
    wheels = tuple(
        WheelRow(
            case=case,
            axle=axle,
            static_load_N=4600.0,
            rms_dynamic_load_N=800.0,
            min_contact_force_N=-1234.0 if (policy, axle) == ("comfort", 2) else 3210.0,
            pulling=0.26 if (policy, axle) == ("comfort", 2) else 0.0,
        )
        for axle in (1, 2)
    )
    window = settled(settle, 1.0 / RATE_HZ, a.size - 1)
    measured = weighted_row(case, a, RATE_HZ, window)
    spectrum = spectrum_rows(case, a[window.steps], RATE_HZ, fundamental)
    return Made(Ride(case, {"time_s": time, "a_K_m_per_s2": a}), row, ridden, wheels, measured, spectrum)


def rides_of(made: Sequence[Made], responses: tuple[Response, ...] = ()) -> Rides:
    """The artefact of rides made by hand."""
    return Rides(
        tuple(one.ride for one in made),
        tuple(one.row for one in made),
        tuple(one.ridden for one in made),
        tuple(wheel for one in made for wheel in one.wheels),
        tuple(one.weighted for one in made),
        tuple(line for one in made for line in one.spectrum),
        responses,
    )


def rides() -> Rides:
    """Control does better by the table than the best fixed voltage, and worse dynamically."""
    found = []
    for f, constant, controlled in ((2.25, 2.2, 0.75), (4.5, 3.6, 1.05)):
        road = f"sine-{f:g}Hz"
        found.append(
            made(
                f"{road}-constant-ideal", road, "constant", "ideal", {f: constant}, f, held={"damping_Ns_per_m": 4500.0}
            )
        )
        for fidelity, worse in (("ideal", 1.0), ("table", 1.2), ("dynamic", 1.3)):
            parts = {f: worse * controlled, 3.0 * f: 0.2 * controlled}
            found.append(made(f"{road}-comfort-{fidelity}", road, "comfort", fidelity, parts, f))
        for fidelity, level in (("table", 1.5), ("dynamic", 1.0)):
            case = f"{road}-best_fixed_voltage-{fidelity}"
            held = {"voltage_V": 62.0}
            found.append(made(case, road, "best_fixed_voltage", fidelity, {f: level * controlled}, f, held=held))
        case = f"{road}-comfort-dynamic-plain"
        found.append(made(case, road, "comfort", "dynamic", {f: 1.5 * controlled}, f))
    step = Response(
        signal="voltage",
        from_voltage_V=0.0,
        to_voltage_V=150.0,
        velocity_m_per_s=0.2,
        to_63_percent_s=0.0039,
        to_90_percent_s=0.009,
        note="",
    )
    return rides_of(found, (step,))


@pytest.fixture(scope="session")
def run() -> Run:
    """The whole run, with a named verdict."""
    return Run(rig(), identified(), diagnosed(), table(), rides())


@pytest.fixture(scope="session")
def made_ride() -> Callable[..., Made]:
    """The maker of rides of known harmonics."""
    return made
