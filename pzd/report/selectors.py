"""Which numbers of a run can be asked for by name, in which unit, and how one of them is found.

`measures`, `parameters`, `summary` and `response` are the files of the run, `comfort` the measures of comfort.csv,
`simulate` the inputs of the ride. Which row of a file is meant, conditions say:

    measures     setting, voltage_V, temperature_degC, frequency_Hz, amplitude_m, record
    parameters   setting, voltage_V, temperature_degC
    summary, comfort     road (or frequency_Hz and amplitude_m of a sine), policy, fidelity; or case
    response, simulate   none: the step of voltage is the rising one over the whole range

What is left open must not matter: where rows differ in it, none is taken, and the note says what to add.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from pzd.artefacts.matching import ANY, Conditions

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
