"""The identify stage: the Bingham parameters of every condition and node, and the measures of every test."""

from __future__ import annotations

import logging
from collections.abc import Sequence

from pzd.artefacts import Identified, ParameterRow, Rig
from pzd.identify.config import IdentifyConfig
from pzd.record import Record, conditions

log = logging.getLogger(__name__)


def identify(identify: IdentifyConfig, rig: Rig, seed: int) -> Identified:
    """The Bingham parameters of every condition of every setting, with intervals and their trust.

    Parameters
    ----------
    identify : how they are found
    rig : the records
    seed : of the evolutionary search

    Returns
    -------
    one row a condition or voltage node, one row of measures a record
    """
    from pzd.identify.measures import measures

    rows = _constant_rows(rig.records, identify, seed)
    rows += _moving_rows(rig.records, identify, rows)
    rows.sort(key=_order)
    return Identified(tuple(rows), measures(rig.records))


def _constant_rows(records: Sequence[Record], config: IdentifyConfig, seed: int) -> list[ParameterRow]:
    from pzd.identify.fit import fit_condition

    found, _ = conditions(records, config.group.voltage_V, config.group.temperature_degC)
    rows = []
    for index, condition in enumerate(found):
        rows.append(fit_condition(condition, config, seed + index))
        log.info("%d of %d conditions: %s", index + 1, len(found), _line(rows[-1]))
    return rows


def _moving_rows(
    records: Sequence[Record], config: IdentifyConfig, known: Sequence[ParameterRow]
) -> list[ParameterRow]:
    from pzd.identify.moving import fit_moving

    _, moving = conditions(records, config.group.voltage_V, config.group.temperature_degC)
    rows = []
    for setting in sorted({r.setting for r in moving}, key=lambda s: s or ""):
        of_setting = [row for row in known if row.setting == setting]
        for row in fit_moving([r for r in moving if r.setting == setting], config, of_setting):
            rows.append(row)
            log.info("node from moving records: %s", _line(row))
    return rows


def _order(row: ParameterRow) -> tuple[str, float, float]:
    return row.setting or "", row.temperature_degC or 0.0, row.voltage_V or 0.0


def _line(row: ParameterRow) -> str:
    def shown(value: float | None) -> str:
        return "-" if value is None else f"{value:.4g}"

    place = ", ".join(
        part
        for part in (
            row.setting,
            None if row.voltage_V is None else f"{row.voltage_V:g}",
            None if row.temperature_degC is None else f"{row.temperature_degC:g} degC",
        )
        if part
    )
    return (
        f"{place or 'all records'}: T0 = {shown(row.T0_N)} N, C = {shown(row.C_Ns_per_m)} N s/m,"
        f" k = {shown(row.k_N_per_m)} N/m, W_s = {row.W_s:.3g}, {row.status}"
    )
