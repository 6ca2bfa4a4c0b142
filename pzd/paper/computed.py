"""Every number of the paper computed from a run: by its rig tests, its identified rows, its rides and their comfort."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

from pzd.artefacts import ComfortRow, Identified, MeasureRow, ParameterRow, Rides
from pzd.paper.published import AT_ZERO, PEAK, Published, published, span
from pzd.paper.valve import FULL_STROKE, VALVE
from pzd.simulate.config import SimulateConfig

_SAME_VOLTAGE, _SAME_TEMPERATURE, _SAME_SINE = 3.0, 2.5, 0.05
"""How far voltage [V], temperature [degC], frequency and amplitude (as shares) may be from the paper's."""
_POLICIES = {"c": "constant", "ctrl": "comfort"}
_BOUNDARY = "reduced_comfort"
"""The boundary of ISO 2631:1978 that "exposition time in comfort conditions" must mean."""
_MS = 1000.0
_COLUMNS = {"T0": "T0_N", "C": "C_Ns_per_m", "k": "k_N_per_m"}


@dataclass(frozen=True)
class Computed:
    """One number of the paper as a run gives it."""

    value: float | None
    """In the unit of the paper; None where the run does not give it."""
    note: str
    """Where it comes from, or why there is none."""


@dataclass(frozen=True, eq=False)
class Made:
    """What a run made, as far as the paper's numbers need it."""

    identified: Identified
    rides: Rides
    comfort: tuple[ComfortRow, ...]
    simulate: SimulateConfig


def computed(row: Published, made: Made) -> Computed:
    """The number that a run gives in place of a published one.

    Parameters
    ----------
    row : the published number
    made : the run

    Returns
    -------
    the number, or why there is none
    """
    if row.quantity in (PEAK, AT_ZERO):
        return _measured(row, made)
    if row.kind == "identified":
        return _identified(row, made)
    if row.kind == "input":
        return Computed(_inputs(made.simulate)[row.id], "input of the run")
    return _SINGLE[row.id](made) if row.id in _SINGLE else _ridden(row, made)


def measure_of(row: Published, identified: Identified) -> MeasureRow | None:
    """The rig test that a published force tells of, the nearest in temperature; None without one."""
    found = [measure for measure in identified.measures if _is_test(measure, row)]
    return min(found, key=lambda measure: _apart(measure.temperature_degC, row), default=None)


def row_of(row: Published, identified: Identified) -> ParameterRow | None:
    """The identified condition that a published parameter tells of; None without one."""
    found = [one for one in identified.rows if _is_condition(one, row)]
    return min(found, key=lambda one: _apart(one.temperature_degC, row), default=None)


def _is_condition(one: MeasureRow | ParameterRow, row: Published) -> bool:
    same_voltage = abs((one.voltage_V or 0.0) - (row.voltage_V or 0.0)) <= _SAME_VOLTAGE
    return one.setting == row.setting and same_voltage and _apart(one.temperature_degC, row) <= _SAME_TEMPERATURE


def _is_test(measure: MeasureRow, row: Published) -> bool:
    pairs = ((measure.frequency_Hz, row.frequency_Hz), (measure.amplitude_m, row.amplitude_m))
    return _is_condition(measure, row) and all(
        math.isclose(found or 0.0, wanted or 0.0, rel_tol=_SAME_SINE) for found, wanted in pairs
    )


def _apart(temperature: float | None, row: Published) -> float:
    return abs((temperature or 0.0) - (row.temperature_C or 0.0))


def _force(name: str, made: Made) -> float | None:
    row = published()[name]
    measure = measure_of(row, made.identified)
    if measure is None:
        return None
    return measure.peak_force_N if row.quantity == PEAK else measure.force_at_zero_velocity_N


def _measured(row: Published, made: Made) -> Computed:
    measure = measure_of(row, made.identified)
    if measure is None:
        return Computed(None, "the rig has no such test")
    low, high = span(row)
    said = f"virtual stand, {measure.record}"
    if low < high:
        said += f"; the paper prints {low:g} to {high:g} {row.unit} for this test"
    return Computed(_force(row.id, made), said)


def _identified(row: Published, made: Made) -> Computed:
    found = row_of(row, made.identified)
    column = _COLUMNS[row.quantity]
    value = None if found is None else getattr(found, column)
    if found is None or value is None:
        return Computed(None, "not identified from this rig" if found is None else found.status)
    low, high = getattr(found, f"{column}_low95"), getattr(found, f"{column}_high95")
    interval = "" if low is None or high is None else f", 95 % {low:.4g} to {high:.4g}"
    return Computed(value, f"identified from the virtual stand{interval}, {found.status}")


def _inputs(simulate: SimulateConfig) -> Mapping[str, float | None]:
    car = simulate.car.car()
    amplitudes = {getattr(road, "amplitude_m", None) for road in simulate.roads}
    return {
        "IN-m": car.mass,
        "IN-k1": car.stiffnesses[0],
        "IN-k2": car.stiffnesses[1],
        "IN-c": simulate.constant_damping_Ns_per_m,
        "IN-cmin": simulate.c_min_Ns_per_m,
        "IN-cmax": simulate.c_max_Ns_per_m,
        "IN-A": amplitudes.pop() if len(amplitudes) == 1 else None,
        "IN-V": simulate.vehicle_speed_km_per_h,
    }


# ---------------------------------------------------------------- rides


def _ridden(row: Published, made: Made) -> Computed:
    policy = _POLICIES[row.id.rpartition("-")[2]]
    cases = {f: f"sine-{row.frequency_Hz:g}Hz-{policy}-{f}" for f in ("ideal", "table", "dynamic")}
    given = _peaks if row.unit == "m/s2" else _times
    values = given(made, cases)
    if values["ideal"] is None:
        return Computed(None, f"the run has no number for {cases['ideal']}")
    how = f"constant c on {made.simulate.constant_damping_Ns_per_m:g} N s/m" if policy == "constant" else _box(made)
    others = [
        f"{name} {value:.3g} {row.unit}" for name, value in values.items() if name != "ideal" and value is not None
    ]
    said = "; ".join([f"ideal, {how}", *others])
    return Computed(values["ideal"], said + ("" if row.unit == "m/s2" else f"; {_status(made, cases['ideal'])}"))


def _box(made: Made) -> str:
    simulate = made.simulate
    return f"forces in [{simulate.c_min_Ns_per_m:g}, {simulate.c_max_Ns_per_m:g}] N s/m, {simulate.tie_break}"


def _peaks(made: Made, cases: Mapping[str, str]) -> dict[str, float | None]:
    found = {row.case: row.peak_abs_aK_m_per_s2 for row in made.rides.summary}
    return {fidelity: found.get(case) for fidelity, case in cases.items()}


def _times(made: Made, cases: Mapping[str, str]) -> dict[str, float | None]:
    found = {row.case: row.value for row in _exposures(made)}
    return {fidelity: found.get(case) for fidelity, case in cases.items()}


def _exposures(made: Made) -> Iterator[ComfortRow]:
    return (row for row in made.comfort if row.measure == f"exposure_time_{_BOUNDARY}")


def _status(made: Made, case: str) -> str:
    return next(f"{row.edition} {_BOUNDARY}, {row.status}" for row in _exposures(made) if row.case == case)


# ---------------------------------------------------------------- single numbers


def _response(made: Made) -> Computed:
    rising = {r.signal: r for r in made.rides.responses if r.to_voltage_V > r.from_voltage_V}
    if not {"force", "voltage"} <= set(rising) or rising["force"].to_90_percent_s is None:
        return Computed(None, "the run has no response to a step of voltage")
    valve = (rising["voltage"].to_90_percent_s or math.nan) * _MS
    speed = rising["force"].velocity_m_per_s
    said = f"force to 90 % of a step over the whole range at {speed:g} m/s; the valve alone {valve:.3g} ms, an input"
    return Computed(rising["force"].to_90_percent_s * _MS, said)


def _stroke(made: Made) -> Computed:
    stated = FULL_STROKE * 1e6
    said = f"what the calibration leaves of the {stated:g} um: free stroke at 150 V, before the pressure opens the slot"
    return Computed(VALVE.stroke_150 * 1e6, said)


def _power(made: Made) -> Computed:
    return Computed(None, "not computed: the paper gives neither capacitance of the stack nor how often it is charged")


def _temperature(made: Made) -> Computed:
    measure = measure_of(published()["F8-23"], made.identified)
    if measure is None or measure.frequency_Hz is None:
        return Computed(None, "an observation of the casing, not computed")
    power = measure.work_per_cycle_J * measure.frequency_Hz
    said = f"an observation of the casing, not computed; the test of F8-23 dissipates {power:.0f} W on the stand"
    return Computed(None, said)


def _rise(made: Made) -> Computed:
    slow, fast = _force("F6-1", made), _force("F6-2", made)
    if slow is None or fast is None:
        return Computed(None, "the rig has no such tests")
    said = f"{slow:.0f} -> {fast:.0f} N; the paper's own 870 -> 1530 N is 76 %, and 43 % is the fall from 1530 to 870"
    return Computed(100.0 * (fast / slow - 1.0), said)


def _range(made: Made) -> Computed:
    ratios = []
    for low, high in (("F4-0", "F4-150"), ("F5-0", "F5-150")):
        off, on = _force(low, made), _force(high, made)
        if off is None or on is None:
            return Computed(None, "the rig has no such tests")
        ratios.append(100.0 * on / off)
    said = (
        f"force at 150 V in percent of that at 0 V at gap 0.15 mm, {ratios[1]:.0f} at gap 0.25 mm; "
        f"as a rise {ratios[0] - 100.0:.0f} and {ratios[1] - 100.0:.0f} percent"
    )
    return Computed(ratios[0], said)


def _fall(cold: str, hot: str) -> Callable[[Made], Computed]:
    def fall(made: Made) -> Computed:
        before, after = _force(cold, made), _force(hot, made)
        if before is None or after is None:
            return Computed(None, "the rig has no such tests")
        return Computed(before - after, f"{before:.0f} -> {after:.0f} N, {100.0 * (1.0 - after / before):.0f} %")

    return fall


_SINGLE: Mapping[str, Callable[[Made], Computed]] = {
    "RESP": _response,
    "STROKE": _stroke,
    "POWER": _power,
    "TEMP-start": _temperature,
    "TEMP-end": _temperature,
    "CL-43": _rise,
    "CL-range": _range,
    "CL-dT0": _fall("F8-23", "F8-43"),
    "CL-dT150": _fall("F9-23", "F9-43"),
}
