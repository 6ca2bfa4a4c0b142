"""The rows of one condition: the knee law with its intervals, and its force at the trade's speeds."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from pzd.artefacts import KneeForceRow, KneeRow
from pzd.artefacts.knee import DIRECTIONS, knee_damper
from pzd.damper.compose import static_force, steady_force
from pzd.identify.intervals import half_widths
from pzd.identify.knee.data import Tests
from pzd.identify.knee.fit import KneeFit
from pzd.identify.misfit import Misfit, misfit_of
from pzd.identify.part import parts_of
from pzd.identify.trial import trial_of
from pzd.identify.trust import WEAK_WIDTH, friction_scale
from pzd.record import Array
from pzd.signals.nuisance import NuisanceConfig
from pzd.signals.root_mean_square import rms

Labels = tuple[str | None, float | None, float | None]
"""Setting, voltage and temperature of a condition."""

TRADE_SPEEDS = tuple(float(np.round(np.pi * 0.1 * turns / 60.0, 3)) for turns in (10, 25, 50, 75, 100, 200, 300))
"""Peak speeds of a crank of 100 mm stroke at 10 to 300 revolutions a minute, at which dampers are specified [m/s]."""
BEYOND = 1.001
"""A test is as fast as a speed within this factor, which its rounding to millimetres a second takes."""
_NONE = Misfit(0.0, 0.0)


def knee_row(labels: Labels, tests: Tests, fit: KneeFit, nuisance: NuisanceConfig) -> KneeRow:
    """The row of one condition.

    Parameters
    ----------
    labels : of the condition
    tests : that were fitted
    fit : their optimum
    nuisance : what the sensors may differ by from test to test
    """
    misfit, widths = _half_widths(tests, fit, nuisance)
    curve, (force, spring) = fit.curve, fit.gas.tolist()
    values: dict[str, float] = {"friction_N": curve.friction, "gas_force_N": force, "gas_spring_N_per_m": spring}
    values["k_N_per_m"] = curve.stiffness
    for way, direction in enumerate(DIRECTIONS):
        values[f"{direction}_bleed_Ns_per_m"] = curve.bleed[way]
        if fit.form.bent[way]:
            values[f"{direction}_knee_force_N"] = curve.knee_force(way)
            values[f"{direction}_knee_velocity_m_per_s"] = curve.knee_speed[way]
            values[f"{direction}_blow_off_Ns_per_m"] = curve.blow_off[way]
    cells: dict[str, float | None] = {}
    for name in _quantities():
        cells |= _with_interval(name, values.get(name), widths.get(name))
    return KneeRow.model_validate(
        {
            **dict(zip(("setting", "voltage_V", "temperature_degC"), labels, strict=True)),
            **cells,
            "zero_m": tests.middle,
            "reached_m_per_s": tests.fastest,
            "W_s": fit.criterion,
            "rmse_N": rms(fit.residuals),
            "missed_share": misfit.share,
            "status": _status(values, widths, misfit, tests.measured),
        }
    )


def knee_forces(row: KneeRow) -> Iterator[KneeForceRow]:
    """The force of a row at the trade's speeds, up to the first that no test reached."""
    damper, voltage = knee_damper([row]), row.voltage_V
    rest = float(static_force(damper, voltage))
    for speed in TRADE_SPEEDS:
        rebound, compression = steady_force(damper, voltage, row.temperature_degC, np.array([speed, -speed])) + rest
        inside = speed <= BEYOND * row.reached_m_per_s
        yield KneeForceRow(
            setting=row.setting,
            voltage_V=row.voltage_V,
            temperature_degC=row.temperature_degC,
            velocity_m_per_s=speed,
            rebound_force_N=float(rebound),
            compression_force_N=float(compression),
            gas_force_N=rest,
            inside=int(inside),
        )
        if not inside:
            return


def _quantities() -> list[str]:
    """The columns that have an interval."""
    return [name.removesuffix("_low95") for name in KneeRow.model_fields if name.endswith("_low95")]


def _half_widths(tests: Tests, fit: KneeFit, nuisance: NuisanceConfig) -> tuple[Misfit, dict[str, float]]:
    """What the law misses, and the half widths of the 95 % intervals by column.

    The force of a knee takes the place of its speed: dF/dF_k = (dF/dw_k) / C, and T0 and C act at a constant F_k. Two
    straight lines are read off a curve that is round in any damper, so an interval holds what the same reading of other
    tests would give; what the law misses of the curve stands in the status and widens none.
    """
    form, curve = fit.form, fit.curve
    columns = ["friction_N", *(f"{name}_bleed_Ns_per_m" for name in DIRECTIONS), "k_N_per_m"]
    for way in form.ways:
        columns += [f"{DIRECTIONS[way]}_knee_velocity_m_per_s", f"{DIRECTIONS[way]}_blow_off_Ns_per_m"]
    columns += ["gas_force_N", "gas_spring_N_per_m"]
    by_force, forces = fit.slopes.copy(), list(columns)
    for way in form.ways:
        place, C = columns.index(f"{DIRECTIONS[way]}_knee_velocity_m_per_s"), curve.bleed[way]
        slope = fit.slopes[:, place] / C
        by_force[:, place] = slope
        by_force[:, 0] -= slope
        by_force[:, 1 + way] -= slope * curve.knee_speed[way]
        forces[place] = f"{DIRECTIONS[way]}_knee_force_N"
    records = [test.record for test in tests.tests]
    trials = [trial_of(record) for record in records]
    misfit = misfit_of(parts_of(records, trials, (fit.residuals, fit.slopes), nuisance))
    # Told not to be constant, a part takes the speed of the rod for that of the flow: here no one C stands for it.
    widths, of_force = (
        half_widths(
            [replace(p, constant=False) for p in parts_of(records, trials, (fit.residuals, s), nuisance)], _NONE
        )
        for s in (fit.slopes, by_force)
    )
    return misfit, dict(zip(columns, widths.tolist(), strict=True)) | {
        name: width for name, width in zip(forces, of_force.tolist(), strict=True) if name not in columns
    }


def _with_interval(name: str, value: float | None, width: float | None) -> dict[str, float | None]:
    """A value and its 95 % interval: in the logarithm for slopes and knees, linear for friction and gas."""
    if value is None or width is None:
        return {name: None, f"{name}_low95": None, f"{name}_high95": None}
    if name in ("friction_N", "gas_force_N", "gas_spring_N_per_m"):
        low, high = value - width, value + width
        low = max(low, 0.0) if name == "friction_N" else low
    else:
        ratio = float(np.exp(min(width / value, _WIDEST)))
        low, high = value / ratio, value * ratio
    return {name: value, f"{name}_low95": low, f"{name}_high95": high}


_WIDEST = 20.0
"""Half width of an interval in the logarithm at most: it then says that nothing is known."""


_UNITS = ("_Ns_per_m", "_N_per_m", "_m_per_s", "_N")


def _words(column: str) -> str:
    """A column as a sentence names it: without its unit."""
    unit = next(unit for unit in _UNITS if column.endswith(unit))
    return column.removesuffix(unit).replace("_", " ")


def _status(values: Mapping[str, float], widths: Mapping[str, float], misfit: Misfit, measured: Array) -> str:
    """`ok`, or which parameters are weak and why; the gas is judged against the friction's scale."""
    least = {"friction_N": friction_scale(values["friction_N"], measured)}
    least["gas_force_N"] = max(abs(values["gas_force_N"]), least["friction_N"])
    wide = [
        f"{_words(name)} to +-{min(widths[name] / least.get(name, value), 9.99):.0%}"
        for name, value in values.items()
        if name != "gas_spring_N_per_m" and widths[name] > WEAK_WIDTH * least.get(name, value)
    ]
    missed = (
        [f"the law misses {misfit.share:.1%} of peak: the parameters are the model's, not the damper's"]
        if misfit.is_large
        else []
    )
    return f"weak: {'; '.join([*wide, *missed])}" if wide or missed else "ok"
