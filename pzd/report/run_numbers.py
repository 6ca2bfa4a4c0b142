"""Numbers of a run, asked for by name and by the conditions that say which row is meant.

`UNITS` lists the names, with the unit in which the run has each number. `measures`, `parameters`, `summary` and
`response` are the files of the run, `comfort` the measures of comfort.csv, `simulate` the inputs of the ride. Which row
of a file is meant, a `Selection` says:

    measures             setting, voltage_V, temperature_degC, frequency_Hz, amplitude_m, record
    parameters           setting, voltage_V, temperature_degC
    summary, comfort     road (or frequency_Hz and amplitude_m of a sine), policy, fidelity; or case
    response, simulate   none: the step of voltage is the rising one over the whole range

What is left open must not matter: where rows differ in it, none is taken, and the note says what to add.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from pzd.artefacts import ComfortRow, Identified, Rides, SummaryRow
from pzd.artefacts.csv_rows import Estimate
from pzd.artefacts.rig import ANY, Conditions, ambiguous_conditions, matching
from pzd.quantities import BINGHAM, Control
from pzd.simulate.config import SimulateConfig
from pzd.simulate.roads.sine import Sine
from pzd.simulate.study.plan import PLAIN_SUFFIX

PURE = "-"
"""The unit of a pure number."""
_MEASURES = {
    "peak_velocity_m_per_s": "m/s",
    "peak_force_N": "N",
    "force_at_zero_velocity_N": "N",
    "work_per_cycle_J": "J",
    "equivalent_damping_Ns_per_m": "N s/m",
    "dynamic_range": PURE,
}
_PARAMETERS = {**{quantity.column: quantity.unit for quantity in BINGHAM}, "W_s": PURE, "rmse_N": "N"}
_SUMMARY = {
    "peak_abs_aK_m_per_s2": "m/s2",
    "rms_aK_m_per_s2": "m/s2",
    "rms_jerk_m_per_s3": "m/s3",
    "peak_deflection_m": "m",
    "rms_wheel_load_N": "N",
    "dissipated_J": "J",
    "outside_table": PURE,
}
_COMFORT = {
    "a_w": "m/s2",
    "weighted_peak": "m/s2",
    "crest_factor": PURE,
    "VDV": "m/s^1.75",
    "MTVV": "m/s2",
    "exposure_time_reduced_comfort": "min",
    "exposure_time_fatigue_decreased_proficiency": "min",
    "exposure_time_exposure_limit": "min",
    "A(8)": "m/s2",
    "VDV_day": "m/s^1.75",
    "time_to_action_value": "h",
    "time_to_limit_value": "h",
}
_RESPONSE = {f"{signal}_to_{share}_percent_s": "s" for signal in ("force", "voltage") for share in (63, 90)}
_CAR_INPUTS = {
    "mass_kg": "kg",
    "pitch_inertia_kgm2": "kg m2",
    "a1_m": "m",
    "a2_m": "m",
    "x_K_m": "m",
    "spring_stiffness_1_N_per_m": "N/m",
    "spring_stiffness_2_N_per_m": "N/m",
}
_RIDE_INPUTS = {
    "constant_damping_Ns_per_m": "N s/m",
    "c_min_Ns_per_m": "N s/m",
    "c_max_Ns_per_m": "N s/m",
    "vehicle_speed_km_per_h": "km/h",
}
"""Keys of the block `simulate`."""
_INPUTS = {**_CAR_INPUTS, **_RIDE_INPUTS, "road_amplitude_m": "m"}


@dataclass(frozen=True)
class Selection:
    """Which row of a file is meant; None where any will do."""

    conditions: Conditions = ANY
    """Of a test, of identified parameters, or of a sine under the wheels."""
    record: str | None = None
    case: str | None = None
    road: str | None = None
    policy: str | None = None
    fidelity: str | None = None


@dataclass(frozen=True)
class Computed:
    """One number of a run."""

    value: float | None
    """None where the run does not give it."""
    note: str
    """Where it comes from, or why there is none."""


@dataclass(frozen=True, eq=False)
class RunNumbers:
    """The artefacts that numbers are taken from."""

    identified: Identified
    rides: Rides
    comfort: tuple[ComfortRow, ...]
    simulate: SimulateConfig
    control: Control


def computed_number(run: RunNumbers, name: str, selection: Selection) -> Computed:
    """Look up one number of a run.

    Parameters
    ----------
    run : the artefacts
    name : one of `UNITS`
    selection : which row is meant

    Returns
    -------
    the number in the unit of `UNITS`, or why there is none

    Raises
    ------
    KeyError : when there is no such name
    """
    file, _, column = name.partition(".")
    return _FILES[file][1](run, column, selection)


# --- Tests and identified conditions ---


def _measure(run: RunNumbers, column: str, selection: Selection) -> Computed:
    wanted = selection.conditions
    rows = [row for row in run.identified.measures if selection.record in (None, row.record)]
    matches = matching(rows, wanted)
    if not matches:
        return Computed(None, f"the rig has no test at {selection.record or wanted}")
    if open_columns := ambiguous_conditions(rows, matches, wanted):
        return _ambiguous("tests", [row.record for row in matches], open_columns, run.control)
    row, value = matches[0], getattr(matches[0], column)
    power = f", {row.work_per_cycle_J * row.frequency_Hz:.0f} W" if row.frequency_Hz is not None else ""
    repetitions = f"; alike: {', '.join(other.record for other in matches[1:])}" if matches[1:] else ""
    return Computed(value, f"test {row.record}{power}{repetitions}" + ("" if value is not None else ": it has none"))


def _parameter(run: RunNumbers, column: str, selection: Selection) -> Computed:
    rows, wanted = run.identified.rows, selection.conditions
    matches = matching(rows, wanted)
    if not matches:
        return Computed(None, f"nothing was identified at {wanted}")
    if open_columns := ambiguous_conditions(rows, matches, wanted):
        return _ambiguous(
            "conditions", [row.words(run.control) or "the rig" for row in matches], open_columns, run.control
        )
    row, estimate = matches[0], Estimate.of(matches[0], column)
    low, high = estimate.low95, estimate.high95
    interval = "" if low is None else f", 95 % above {low:.4g}" if high is None else f", 95 % {low:.4g} to {high:.4g}"
    return Computed(estimate.value, f"identified at {row.words(run.control) or 'the rig'}{interval}, {row.status}")


def _ambiguous(what: str, names: list[str], open_columns: tuple[str, ...], control: Control) -> Computed:
    """Return no number, with what to add to the selection."""
    listed = ", ".join(names[:3]) + (f" and {len(names) - 3} more" if len(names) > 3 else "")
    columns = ", ".join(control.renamed(column) for column in open_columns)
    return Computed(None, f"{len(names)} {what} meet this ({listed}): give {columns}")


# --- Rides ---


def _summary(run: RunNumbers, column: str, selection: Selection) -> Computed:
    ride = _ride(run, selection)
    if isinstance(ride, Computed):
        return ride
    values = {row.case: getattr(row, column) for row in run.rides.summary}
    others = _other_fidelities(run, ride, values, UNITS[f"summary.{column}"])
    return Computed(values[ride.case], f"ride {ride.case}{others}")


def _comfort(run: RunNumbers, measure: str, selection: Selection) -> Computed:
    ride = _ride(run, selection)
    if isinstance(ride, Computed):
        return ride
    rows = {row.case: row for row in run.comfort if row.measure == measure}
    if ride.case not in rows:
        return Computed(None, f"ride {ride.case}: the standard of {measure} is none of report.editions")
    values = {case: row.value for case, row in rows.items()}
    row, others = rows[ride.case], _other_fidelities(run, ride, values, UNITS[f"comfort.{measure}"])
    return Computed(row.value, f"ride {ride.case}{others}; {row.edition}, {row.status}")


def _ride(run: RunNumbers, selection: Selection) -> Computed | SummaryRow:
    """Return the one ride that is meant, or why there is none."""
    matches = [row for row in run.rides.summary if _is_ride(run, row, selection)]
    if len(matches) == 1:
        return matches[0]
    if not matches:
        return Computed(None, "the run has no such ride")
    differing = [name for name in ("road", "policy", "fidelity") if len({getattr(row, name) for row in matches}) > 1]
    return _ambiguous("rides", [row.case for row in matches], tuple(differing) or ("case",), run.control)


def _is_ride(run: RunNumbers, row: SummaryRow, selection: Selection) -> bool:
    if selection.case is not None:
        return row.case == selection.case
    on_final = not row.case.endswith(PLAIN_SUFFIX)  # rides on the baseline only where they are asked for by name
    names = ("road", "policy", "fidelity")
    named = all(getattr(selection, name) in (None, getattr(row, name)) for name in names)
    return on_final and named and _is_sine(run, row.road, selection.conditions)


def _is_sine(run: RunNumbers, name: str, wanted: Conditions) -> bool:
    """Tell whether a road has the frequency and amplitude that are asked for, if any."""
    road = next((road for road in run.simulate.roads if road.name == name), None)
    pairs = ((wanted.frequency_Hz, "frequency_Hz"), (wanted.amplitude_m, "amplitude_m"))
    return all(
        value is None or (isinstance(road, Sine) and math.isclose(getattr(road, key), value, rel_tol=1e-9))
        for value, key in pairs
    )


def _other_fidelities(run: RunNumbers, ride: SummaryRow, values: Mapping[str, float | None], unit: str) -> str:
    """Return the same number of the ride at its other fidelities, in words."""
    same_ride = f"{ride.road}-{ride.policy}"
    others = [row for row in run.rides.summary if row.case == f"{same_ride}-{row.fidelity}" and row is not ride]
    pairs = [(row.fidelity, values.get(row.case)) for row in others]
    return "".join(f"; {fidelity} {value:.3g} {unit}" for fidelity, value in pairs if value is not None)


# --- The step of voltage, and inputs ---


def _response(run: RunNumbers, column: str, selection: Selection) -> Computed:
    signal, _, time = column.partition("_")
    rising = {row.signal: row for row in run.rides.responses if row.to_voltage_V > row.from_voltage_V}
    row = rising.get("force" if signal == "force" else "voltage")
    if row is None or getattr(row, time) is None:
        return Computed(None, "the run has no such response to a step of voltage")
    step = f"{row.from_voltage_V:g} to {row.to_voltage_V:g} {run.control.unit} at {row.velocity_m_per_s:g} m/s"
    valve = rising.get("voltage") if signal == "force" else None
    valve_time = None if valve is None else getattr(valve, time)
    valve_note = "" if valve_time is None else f"; the valve alone {1000.0 * valve_time:.3g} ms, an input"
    return Computed(getattr(row, time), f"step from {step}{valve_note}")


def _input(run: RunNumbers, name: str, selection: Selection) -> Computed:
    if name == "road_amplitude_m":
        amplitudes = {getattr(road, "amplitude_m", None) for road in run.simulate.roads}
        if len(amplitudes) != 1 or None in amplitudes:
            return Computed(None, "the roads of the run have no one amplitude")
        return Computed(amplitudes.pop(), "input of the run")
    if name in _RIDE_INPUTS:
        value = getattr(run.simulate, name)
        return Computed(value, "input of the run" if value is not None else "the run has no such bound")
    car = run.simulate.car.car()
    values = (car.mass, car.pitch_inertia, *car.distances, car.comfort_point, *car.stiffnesses)
    return Computed(dict(zip(_CAR_INPUTS, values, strict=True))[name], "input of the run")


_FILES: Mapping[str, tuple[Mapping[str, str], Callable[[RunNumbers, str, Selection], Computed]]] = {
    "measures": (_MEASURES, _measure),
    "parameters": (_PARAMETERS, _parameter),
    "summary": (_SUMMARY, _summary),
    "comfort": (_COMFORT, _comfort),
    "response": (_RESPONSE, _response),
    "simulate": (_INPUTS, _input),
}
"""Numbers of each file with their units, and how one of them is looked up."""
UNITS: Mapping[str, str] = {
    f"{file}.{name}": unit for file, (units, _) in _FILES.items() for name, unit in units.items()
}
"""Every number that can be asked for, with the unit in which the run has it."""
