"""Finds one number of a run by its name and by the conditions that say which row is meant."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

from pzd.artefacts import ComfortRow, Identified, Rides, SummaryRow
from pzd.artefacts.csv_rows import Estimate
from pzd.artefacts.rig import ANY, Conditions, ambiguous_conditions, matching
from pzd.quantities import Control
from pzd.simulate.config import SimulateConfig
from pzd.simulate.roads.sine import Sine
from pzd.simulate.study.plan import PLAIN_SUFFIX

# ----------------------------------------------------------------------------------------------------
# Which numbers of a run can be asked for by name, in which unit, and how one of them is found.
#
# `measures`, `parameters`, `summary` and `response` are the files of the run, `comfort` the measures of comfort.csv,
# `simulate` the inputs of the ride. Which row of a file is meant, conditions say:
#
#     measures     setting, voltage_V, temperature_degC, frequency_Hz, amplitude_m, record
#     parameters   setting, voltage_V, temperature_degC
#     summary, comfort     road (or frequency_Hz and amplitude_m of a sine), policy, fidelity; or case
#     response, simulate   none: the step of voltage is the rising one over the whole range
#
# What is left open must not matter: where rows differ in it, none is taken, and the note says what to add.


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
_PARAMETERS = {"T0_N": "N", "C_Ns_per_m": "N s/m", "k_N_per_m": "N/m", "W_s": PURE, "rmse_N": "N"}
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
_SIMULATE = {
    "mass_kg": "kg",
    "pitch_inertia_kgm2": "kg m2",
    "a1_m": "m",
    "a2_m": "m",
    "x_K_m": "m",
    "spring_stiffness_1_N_per_m": "N/m",
    "spring_stiffness_2_N_per_m": "N/m",
    "constant_damping_Ns_per_m": "N s/m",
    "c_min_Ns_per_m": "N s/m",
    "c_max_Ns_per_m": "N s/m",
    "vehicle_speed_km_per_h": "km/h",
    "road_amplitude_m": "m",
}
UNITS: Mapping[str, str] = {
    f"{file}.{name}": unit
    for file, names in (
        ("measures", _MEASURES),
        ("parameters", _PARAMETERS),
        ("summary", _SUMMARY),
        ("comfort", _COMFORT),
        ("response", _RESPONSE),
        ("simulate", _SIMULATE),
    )
    for name, unit in names.items()
}
"""Every number that can be asked for, with the unit in which the run has it."""


@dataclass(frozen=True)
class Asked:
    """Which row of a file is meant; None where any will do."""

    conditions: Conditions = ANY
    """Of a test, of identified parameters, or of a sine under the wheels."""
    record: str | None = None
    """Name of a rig record."""
    case: str | None = None
    """Name of a ride."""
    road: str | None = None
    """Name of a road."""
    policy: str | None = None
    fidelity: str | None = None


# ----------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Found:
    """One number of a run."""

    value: float | None
    """None where the run does not give it."""
    note: str
    """Where it comes from, or why there is none."""


@dataclass(frozen=True, eq=False)
class RunNumbers:
    """What the numbers of a run are taken from."""

    identified: Identified
    rides: Rides
    comfort: tuple[ComfortRow, ...]
    simulate: SimulateConfig
    control: Control


def found_in(run: RunNumbers, name: str, asked: Asked) -> Found:
    """One number of a run.

    Parameters
    ----------
    run : what it is taken from
    name : one of `UNITS`
    asked : which row is meant

    Returns
    -------
    the number in the unit of `UNITS`, or why there is none

    Raises
    ------
    KeyError : when nothing is called so
    """
    file, _, column = name.partition(".")
    return _FILES[file](run, column, asked)


def _measure(run: RunNumbers, column: str, asked: Asked) -> Found:
    rows = [row for row in run.identified.measures if asked.record in (None, row.record)]
    met = matching(rows, asked.conditions)
    if not met:
        return Found(None, f"the rig has no test at {asked.record or asked.conditions}")
    if open_columns := ambiguous_conditions(rows, met, asked.conditions):
        return Found(None, _undecided("tests", [row.record for row in met], open_columns, run.control))
    row, value = met[0], getattr(met[0], column)
    power = f", {row.work_per_cycle_J * row.frequency_Hz:.0f} W" if row.frequency_Hz is not None else ""
    more = f"; alike: {', '.join(other.record for other in met[1:])}" if met[1:] else ""
    return Found(value, f"test {row.record}{power}{more}" + ("" if value is not None else ": it has none"))


def _parameter(run: RunNumbers, column: str, asked: Asked) -> Found:
    met = matching(run.identified.rows, asked.conditions)
    if not met:
        return Found(None, f"nothing was identified at {asked.conditions}")
    if open_columns := ambiguous_conditions(run.identified.rows, met, asked.conditions):
        return Found(
            None,
            _undecided("conditions", [row.words(run.control) or "the rig" for row in met], open_columns, run.control),
        )
    row, estimate = met[0], Estimate.of(met[0], column)
    interval = "" if estimate.interval is None else ", 95 % {:.4g} to {:.4g}".format(*estimate.interval)
    return Found(estimate.value, f"identified at {row.words(run.control) or 'the rig'}{interval}, {row.status}")


def _undecided(what: str, names: list[str], open_columns: tuple[str, ...], control: Control) -> str:
    listed = ", ".join(names[:3]) + (f" and {len(names) - 3} more" if len(names) > 3 else "")
    return f"{len(names)} {what} meet this ({listed}): give {', '.join(control.renamed(c) for c in open_columns)}"


# ---------------------------------------------------------------- rides


def _ride(run: RunNumbers, asked: Asked) -> Found | SummaryRow:
    """The one ride that is meant, or why there is none."""
    met = [row for row in run.rides.summary if _is_ride(run, row, asked)]
    if len(met) == 1:
        return met[0]
    if not met:
        return Found(None, "the run has no such ride")
    given = {"road": "road", "policy": "policy", "fidelity": "fidelity"}
    differing = [name for name in given if len({getattr(row, name) for row in met}) > 1]
    return Found(None, _undecided("rides", [row.case for row in met], tuple(differing) or ("case",), run.control))


def _is_ride(run: RunNumbers, row: SummaryRow, asked: Asked) -> bool:
    if asked.case is not None:
        return row.case == asked.case
    names = ((asked.road, row.road), (asked.policy, row.policy), (asked.fidelity, row.fidelity))
    on_final = not row.case.endswith(PLAIN_SUFFIX)  # the others only where they are asked for by name
    return on_final and all(wanted in (None, found) for wanted, found in names) and _is_sine(run, row.road, asked)


def _is_sine(run: RunNumbers, name: str, asked: Asked) -> bool:
    road = next((road for road in run.simulate.roads if road.name == name), None)
    pairs = ((asked.conditions.frequency_Hz, "frequency_Hz"), (asked.conditions.amplitude_m, "amplitude_m"))
    return all(
        wanted is None or (isinstance(road, Sine) and math.isclose(getattr(road, field), wanted, rel_tol=1e-9))
        for wanted, field in pairs
    )


def _other_fidelities(
    run: RunNumbers, ride: SummaryRow, value_of: Callable[[SummaryRow], float | None], unit: str
) -> str:
    """The same number of the ride at the other fidelities, in words."""
    others = [row for row in run.rides.summary if row.case in _others(run, ride)]
    values = [(row.fidelity, value_of(row)) for row in others]
    return "".join(f"; {fidelity} {value:.3g} {unit}" for fidelity, value in values if value is not None)


def _others(run: RunNumbers, ride: SummaryRow) -> set[str]:
    cases = {f"{ride.road}-{ride.policy}-{row.fidelity}" for row in run.rides.summary}
    return cases - {ride.case}


def _summary(run: RunNumbers, column: str, asked: Asked) -> Found:
    ride = _ride(run, asked)
    if isinstance(ride, Found):
        return ride
    others = _other_fidelities(run, ride, lambda row: getattr(row, column), UNITS[f"summary.{column}"])
    return Found(getattr(ride, column), f"ride {ride.case}{others}")


def _comfort(run: RunNumbers, measure: str, asked: Asked) -> Found:
    ride = _ride(run, asked)
    if isinstance(ride, Found):
        return ride
    rows = {row.case: row for row in run.comfort if row.measure == measure}
    if ride.case not in rows:
        return Found(None, f"ride {ride.case}: the standard of {measure} is none of report.editions")

    def value_of(row: SummaryRow) -> float | None:
        return rows[row.case].value if row.case in rows else None

    row, others = rows[ride.case], _other_fidelities(run, ride, value_of, UNITS[f"comfort.{measure}"])
    return Found(row.value, f"ride {ride.case}{others}; {row.edition}, {row.status}")


# ---------------------------------------------------------------- the step of voltage, and inputs


def _response(run: RunNumbers, column: str, asked: Asked) -> Found:
    signal, _, time = column.partition("_")
    rising = {row.signal: row for row in run.rides.responses if row.to_voltage_V > row.from_voltage_V}
    row = rising.get("force" if signal == "force" else "voltage")
    if row is None or getattr(row, time) is None:
        return Found(None, "the run has no such response to a step of voltage")
    step = f"{row.from_voltage_V:g} to {row.to_voltage_V:g} {run.control.unit} at {row.velocity_m_per_s:g} m/s"
    valve = rising.get("voltage") if signal == "force" else None
    alone = None if valve is None else getattr(valve, time)
    beside = "" if alone is None else f"; the valve alone {1000.0 * alone:.3g} ms, an input"
    return Found(getattr(row, time), f"step from {step}{beside}")


def _input(run: RunNumbers, name: str, asked: Asked) -> Found:
    simulate, car = run.simulate, run.simulate.car.car()
    amplitudes = _distinct(getattr(road, "amplitude_m", None) for road in simulate.roads)
    values: Mapping[str, float | None] = {
        "mass_kg": car.mass,
        "pitch_inertia_kgm2": car.pitch_inertia,
        "a1_m": car.distances[0],
        "a2_m": car.distances[1],
        "x_K_m": car.comfort_point,
        "spring_stiffness_1_N_per_m": car.stiffnesses[0],
        "spring_stiffness_2_N_per_m": car.stiffnesses[1],
        "constant_damping_Ns_per_m": simulate.constant_damping_Ns_per_m,
        "c_min_Ns_per_m": simulate.c_min_Ns_per_m,
        "c_max_Ns_per_m": simulate.c_max_Ns_per_m,
        "vehicle_speed_km_per_h": simulate.vehicle_speed_km_per_h,
        "road_amplitude_m": amplitudes[0] if len(amplitudes) == 1 else None,
    }
    value = values[name]
    if value is not None:
        return Found(value, "input of the run")
    roads = name == "road_amplitude_m"
    return Found(None, "the roads of the run have no one amplitude" if roads else "the run has no such bound")


def _distinct(values: Iterable[float | None]) -> list[float | None]:
    return list(dict.fromkeys(values))


_FILES: Mapping[str, Callable[[RunNumbers, str, Asked], Found]] = {
    "measures": _measure,
    "parameters": _parameter,
    "summary": _summary,
    "comfort": _comfort,
    "response": _response,
    "simulate": _input,
}
