"""The identify stage: the Bingham parameters of every condition and node, and the measures of every test."""

from __future__ import annotations

import logging
from collections.abc import Sequence

from pzd.artefacts import Identified, ParameterRow, Rig
from pzd.identify.config import IdentifyConfig
from pzd.record import Condition, Record, conditions
from pzd.schema.progress import Listener, Progress, unheard
from pzd.schema.wording import supported

Labels = tuple[str | None, float | None, float | None]

log = logging.getLogger(__name__)


def identify(identify: IdentifyConfig, rig: Rig, seed: int, progress: Listener = unheard) -> Identified:
    """The Bingham parameters of every condition of every setting, with intervals and their trust.

    Parameters
    ----------
    identify : how they are found
    rig : the records
    seed : of the evolutionary search
    progress : hears of every condition that is done

    Returns
    -------
    one row a condition or voltage node, one row of measures a record
    """
    from pzd.identify.measures import measures

    constant, moving = conditions(rig.records, identify.group.voltage_V, identify.group.temperature_degC)
    rows = {_labels(row): row for row in _constant_rows(constant, identify, seed, progress)}
    rows |= {_labels(row): row for row in _moving_rows(moving, constant, list(rows.values()), identify)}
    return Identified(tuple(rows[labels] for labels in sorted(rows, key=_order)), measures(rig.records))


def _constant_rows(
    found: Sequence[Condition], config: IdentifyConfig, seed: int, progress: Listener
) -> list[ParameterRow]:
    from pzd.identify.fit import fit_condition

    rows = []
    for index, condition in enumerate(found):
        rows.append(fit_condition(condition, config, seed + index))
        progress(Progress(index + 1, len(found), f"conditions: {_line(rows[-1])}"))
    return rows


def _moving_rows(
    moving: Sequence[Record], constant: Sequence[Condition], known: Sequence[ParameterRow], config: IdentifyConfig
) -> list[ParameterRow]:
    from pzd.identify.moving import fit_moving

    rows = []
    for setting in sorted({r.setting for r in moving}, key=lambda s: s or ""):
        mine = [(c, row) for c, row in zip(constant, known, strict=True) if c.setting == setting]
        of_setting = [r for r in moving if r.setting == setting]
        for row in fit_moving(of_setting, [c for c, _ in mine], [row for _, row in mine], config):
            rows.append(row)
            log.info("node from records with moving voltage: %s", _line(row))
    return rows


def _labels(row: ParameterRow) -> Labels:
    return row.setting, row.voltage_V, row.temperature_degC


def _order(labels: Labels) -> tuple[str, float, float]:
    setting, voltage, temperature = labels
    return setting or "", temperature or 0.0, voltage or 0.0


def _line(row: ParameterRow) -> str:
    def shown(value: float | None, low: float | None, high: float | None) -> str:
        if value is None:
            return "-"
        return f"{value:.4g}" if low is None or high is None else supported(value, low, high)

    place = ", ".join(
        part
        for part in (
            row.setting,
            None if row.voltage_V is None else f"{row.voltage_V:.4g}",
            None if row.temperature_degC is None else f"{row.temperature_degC:.4g} degC",
        )
        if part
    )
    return (
        f"{place or 'all records'}: T0 = {shown(row.T0_N, row.T0_N_low95, row.T0_N_high95)} N,"
        f" C = {shown(row.C_Ns_per_m, row.C_Ns_per_m_low95, row.C_Ns_per_m_high95)} N s/m,"
        f" k = {shown(row.k_N_per_m, row.k_N_per_m_low95, row.k_N_per_m_high95)} N/m, W_s = {row.W_s:.3g}, {row.status}"
    )
