"""The identify stage: the Bingham parameters of every condition and node, and the measures of every test."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import replace

from pzd.artefacts import AuxiliaryRow, Characteristics, Identified, Knees, ParameterRow, Rig
from pzd.identification.config import IdentifyConfig
from pzd.parallel.processes import Listener, Progress, no_listener, parallel_map
from pzd.quantities import BINGHAM, TEMPERATURE, Control
from pzd.record import Condition, Labels, Record, conditions, distinct, merged_voltages
from pzd.schema.errors import ConfigError, DataError, counted, supported
from pzd.signals.cycles import Cycles, cycles_of, remember_cycles

log = logging.getLogger(__name__)

SAMPLES_WORTH_A_PROCESS = 2_000_000
"""Fewest samples in all for which conditions and records are worked on in separate processes, which have to start."""

_VOLTAGE = Control()


def identify(
    identify: IdentifyConfig,
    rig: Rig,
    seed: int,
    progress: Listener = no_listener,
    control: Control = _VOLTAGE,
    jobs: int = 1,
    described: bool = True,
) -> Identified:
    """Identify the Bingham parameters of every condition of every setting, with intervals and status.

    Parameters
    ----------
    identify : the `identify` block of the config
    rig : the records
    seed : of the evolutionary search
    progress : called after every condition
    control : the control signal, which names the voltage in messages
    jobs : conditions that are fitted, and records that are described, at the same time
    described : whether the tests are described without a model as well, which changes no parameter

    Returns
    -------
    one row a condition or voltage node, one row of measures a record, one of auxiliary forces a condition that shows
    any, and the characteristics of the tests without a model

    Raises
    ------
    ConfigError : when `identify.group` makes one condition of all voltages
    """
    from pzd.identification.characteristics import characteristics
    from pzd.identification.strokes_and_loops import measures

    jobs = jobs if sum(record.time.size for record in rig.records) > SAMPLES_WORTH_A_PROCESS else 1
    refuse_one_condition(identify, rig, control)
    refuse_partly_recorded(rig, control)
    constant, moving = conditions(distinct(rig.records), identify.group.voltage_V, identify.group.temperature_degC)
    found = _constant_rows(constant, identify, seed, progress, jobs)
    rows = {_labels(row): row for row, _ in found}
    auxiliary = {_labels(row): row for _, row in found if row is not None}
    known = list(zip(constant, rows.values(), strict=True))
    rows |= {_labels(row): row for row in _moving_rows(moving, known, list(auxiliary.values()), identify)}
    knees = Knees()
    if identify.law != "bingham":
        from pzd.identification.knee import identify_knees

        settings = tuple(dict.fromkeys(record.setting for record in rig.records))
        knees = identify_knees(known, settings, identify, control, progress)
    return Identified(
        tuple(rows[labels] for labels in sorted(rows, key=_sort_key)),
        measures(rig.records, jobs) if described else (),
        tuple(auxiliary[labels] for labels in sorted(auxiliary, key=_sort_key)),
        characteristics(constant, moving, jobs) if described else Characteristics(),
        knees,
    )


def refuse_one_condition(config: IdentifyConfig, rig: Rig, control: Control) -> None:
    """Refuse a group of voltages as wide as all that the rig has.

    Parameters
    ----------
    config : the config's `identify` block
    rig : the records
    control : the control signal, which names the voltage in messages

    Raises
    ------
    ConfigError : when `identify.group` makes one condition of all voltages
    """
    within = config.group.voltage_V
    merged = merged_voltages(rig.records, within) if within is not None else None
    if merged is not None:
        key, span = control.renamed("voltage_V"), f"{merged[0]:.4g} to {merged[1]:.4g} {control.unit}"
        raise ConfigError(
            f"identify.group.{key}: merges every {control.quantity.name} of the rig ({span}) into one condition, so "
            "that T0, C and k could not depend on it; say less than lies between two of them, or leave it empty "
            f"(got {within:g})"
        )


def refuse_partly_recorded(rig: Rig, control: Control) -> None:
    """Refuse a setting of which some tests have a voltage or a temperature and others have none.

    Parameters
    ----------
    rig : the records
    control : the control signal, which names the voltage in messages

    Raises
    ------
    DataError : with the first test that lacks one
    """
    for setting in dict.fromkeys(record.setting for record in rig.records):
        of_setting = [record for record in rig.records if record.setting == setting]
        for name, unit, without in (
            (control.quantity.name, control.unit, [r.name for r in of_setting if r.voltage is None]),
            (TEMPERATURE.name, TEMPERATURE.unit, [r.name for r in of_setting if r.temperature is None]),
        ):
            if 0 < len(without) < len(of_setting):
                more = f" and {counted(len(without) - 1, 'more test')}" if len(without) > 1 else ""
                raise DataError(
                    f"{without[0]}{more}: no {name}, which other tests of the setting have: say what it was, "
                    f"constants: {{{name}: ... {unit}}}, or leave it out of all, columns: {{{name}: ''}}; "
                    f"of a pzd.Test by its {name}"
                )


def _constant_rows(
    found: Sequence[Condition], config: IdentifyConfig, seed: int, progress: Listener, jobs: int
) -> list[tuple[ParameterRow, AuxiliaryRow | None]]:
    """Identify the conditions, several at the same time where they are worth a process."""
    from pzd.identification.condition import Estimate, estimate_condition, rows_of

    Made = tuple[Estimate | ParameterRow, AuxiliaryRow | None, list[Cycles | None]]
    estimates: list[Estimate | ParameterRow] = []
    auxiliaries: list[AuxiliaryRow | None] = []

    def fitted(number: int) -> Made:
        condition = found[number]
        return *estimate_condition(condition, config, seed + number), [cycles_of(r) for r in condition.records]

    def collected(made: Made) -> None:
        estimate, auxiliary, runs = made
        for record, run in zip(found[len(estimates)].records, runs, strict=True):
            remember_cycles(record, run)
        estimates.append(estimate)
        auxiliaries.append(auxiliary)
        (row,) = rows_of([estimate])
        said = f"conditions: {_parameter_text(row)}{_auxiliary_text(auxiliary)}"
        progress(Progress(len(estimates), len(found), said))

    parallel_map(fitted, range(len(found)), jobs, collected)
    return list(zip(rows_of(estimates), auxiliaries, strict=True))


def _moving_rows(
    moving: Sequence[Record],
    known: Sequence[tuple[Condition, ParameterRow]],
    auxiliaries: Sequence[AuxiliaryRow],
    config: IdentifyConfig,
) -> list[ParameterRow]:
    """Identify the voltage nodes from records of moving voltage, setting by setting."""
    from pzd.identification.condition import subtract_auxiliary
    from pzd.identification.moving_voltage import fit_moving

    rows = []
    for setting in sorted({r.setting for r in moving}, key=lambda s: s or ""):
        auxiliary = [row for row in auxiliaries if row.setting == setting]
        of_setting = [(c, row) for c, row in known if c.setting == setting]
        still = [replace(c, records=tuple(subtract_auxiliary(r, auxiliary) for r in c.records)) for c, _ in of_setting]
        moving_of_setting = [subtract_auxiliary(r, auxiliary) for r in moving if r.setting == setting]
        for row in fit_moving(moving_of_setting, still, [row for _, row in of_setting], config):
            rows.append(row)
            log.info("node from records with moving voltage: %s", _parameter_text(row))
    return rows


def _labels(row: ParameterRow | AuxiliaryRow) -> Labels:
    """Return setting, voltage and temperature of a row."""
    return row.setting, row.voltage_V, row.temperature_degC


def _sort_key(labels: Labels) -> tuple[str, float, float]:
    """Order rows by setting, temperature and voltage."""
    setting, voltage, temperature = labels
    return setting or "", temperature or 0.0, voltage or 0.0


def _parameter_text(row: ParameterRow) -> str:
    """Return the parameters of one row as a line of progress."""
    voltage = None if row.voltage_V is None else f"{row.voltage_V:.4g}"
    temperature = None if row.temperature_degC is None else f"{row.temperature_degC:.4g} degC"
    place = ", ".join(part for part in (row.setting, voltage, temperature) if part)
    T0, C, k = (_supported(row, quantity.column) for quantity in BINGHAM)
    return f"{place or 'all records'}: T0 = {T0} N, C = {C} N s/m, k = {k} N/m, W_s = {row.W_s:.3g}, {row.status}"


def _auxiliary_text(row: AuxiliaryRow | None) -> str:
    """Return the forces beside the element as the end of a line of progress."""
    if row is None:
        return ""
    return f"; beside the element {_supported(row, 'F_0_N')} N and {_supported(row, 'k_g_N_per_m')} N/m"


def _supported(row: ParameterRow | AuxiliaryRow, name: str) -> str:
    """Return a value with the digits that its interval supports, `-` where there is none."""
    value, low, high = (getattr(row, f"{name}{end}") for end in ("", "_low95", "_high95"))
    if value is None:
        return "-"
    return f"{value:.4g}" if low is None or high is None else supported(value, low, high)
