"""What the config may ask of a table: a temperature and a voltage that it covers."""

from __future__ import annotations

from pzd.artefacts import Table
from pzd.schema.errors import ConfigError
from pzd.simulate.config import SimulateConfig

_SAME_DEGREES = 2.0
"""Temperatures this close are one condition of the rig, see `identify.group` [K]."""
_SAME_VOLTAGE = 0.02
"""Voltages closer than this share of the largest are one condition of the rig, see `identify.group`."""


def checked_temperature(config: SimulateConfig, table: Table) -> float | None:
    """The temperature of the dampers [degC]: the config's, by default the lowest of the table; None without any.

    Raises
    ------
    ConfigError : when the table does not cover it
    """
    known = sorted({row.temperature_degC for row in table.force if row.temperature_degC is not None})
    asked = config.temperature_degC
    if asked is None:
        return known[0] if known else None
    if not known:
        raise ConfigError(f"simulate.temperature_degC: the table has no temperature; leave it out (got {asked:g})")
    if not known[0] - _SAME_DEGREES <= asked <= known[-1] + _SAME_DEGREES:
        raise ConfigError(
            f"simulate.temperature_degC: must lie within the table, {_span(known)} degC; "
            f"test the damper at it, or ride at a temperature that was tested (got {asked:g})"
        )
    return asked


def checked_voltage(config: SimulateConfig, table: Table) -> None:
    """Refuse a voltage of the policy `passive` that the table does not cover; without a control signal none is held.

    Raises
    ------
    ConfigError : when it does not
    """
    known = sorted({row.voltage_V for row in table.force if row.voltage_V is not None})
    asked = config.passive_voltage_V
    if asked is None or not known:
        return
    apart = _SAME_VOLTAGE * max(abs(known[0]), abs(known[-1]))
    if not known[0] - apart <= asked <= known[-1] + apart:
        raise ConfigError(f"simulate.passive_voltage_V: must lie within the table, {_span(known)} (got {asked:g})")


def _span(known: list[float]) -> str:
    return f"{known[0]:g}" if known[0] == known[-1] else f"{known[0]:g} to {known[-1]:g}"
