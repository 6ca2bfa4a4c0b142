"""Force at settings between tested ones, linear in the number of a clicker, gap, shim or gas pressure.

Every setting has the damper that identify found, with the law fitted there: diagnose treats one setting alone, so the
effects that it adopts hold for that one and for no other.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import product

import numpy as np

from pzd.artefacts import Identified, Rig, SettingLeftOutRow, SettingRow, identified_damper
from pzd.artefacts.table import Neighbours, on_axis
from pzd.damper.compose import static_force, steady_force
from pzd.damper.model import Damper
from pzd.force_table.config import TableConfig
from pzd.force_table.force import ReachedSpeeds, TableNodes, grid, reached_speeds, temperatures_of, voltages_of
from pzd.quantities import Control
from pzd.record import CONSTANT_SHARE, SAME_TEMPERATURE, Array
from pzd.schema.errors import ConfigError

COMPARED = 200
"""Number of evenly spaced speeds over which a prediction is compared: as many as draw a smooth curve."""

Place = tuple[float | None, float | None]
"""Temperature [degC] and control signal [V]."""


@dataclass(frozen=True, eq=False)
class TestedSetting:
    """The damper of one tested setting, its operating envelope, and the nodes of its table."""

    name: str
    damper: Damper
    temperatures: tuple[float | None, ...]
    """Of its parameters, rising [degC]."""
    voltages: tuple[float | None, ...]
    """Of its parameters, rising [V]."""
    envelope: ReachedSpeeds
    nodes: TableNodes

    def limit(self, place: Place) -> float:
        """Return the tested speed [m/s] at a place, which may deviate from the tested ones by a sensor's scatter."""
        return self.envelope.speed_at(*self._clamped(place))

    def forces(self, place: Place, velocity: Array) -> Array:
        """Compute the (n,) force at steady slip [N]."""
        temperature, voltage = self._clamped(place)
        return steady_force(self.damper, voltage, temperature, velocity)

    def static_force(self, place: Place) -> float:
        """Compute the force at rest [N]."""
        return float(static_force(self.damper, self._clamped(place)[1]))

    def _clamped(self, place: Place) -> Place:
        """Return a place within the tested ranges, into which a sensor's scatter is clamped."""
        return _clamped(place[0], self.temperatures), _clamped(place[1], self.voltages)


def between_settings(
    config: TableConfig, rig: Rig, identified: Identified, control: Control
) -> tuple[tuple[SettingRow, ...], tuple[SettingLeftOutRow, ...]]:
    """Compute the force at the settings that the config asks for, and the prediction error of tested ones left out.

    Parameters
    ----------
    config : the config's block
    rig : the records, for the operating envelope
    identified : the dampers of all settings
    control : the control signal, for the text of an error

    Returns
    -------
    rows of the settings, at temperatures, control signals and speeds that both neighbours cover; and one row for each
    tested setting that has a tested neighbour on either side, on the axes that were asked for

    Raises
    ------
    ConfigError : when a setting has no neighbours, or these were tested at no common temperature or control signal
    """
    names = [row.setting for row in identified.rows]

    @cache
    def tested(name: str) -> TestedSetting:
        damper = identified_damper(identified, name)
        records = [record for record in rig.records if record.setting == name]
        T, U = temperatures_of(damper), voltages_of(damper)
        envelope = reached_speeds(records, T, U)
        return TestedSetting(name, damper, T, U, envelope, grid(config, damper, T, envelope))

    wanted = config.between(names)
    rows = [row for number, one in enumerate(wanted) for row in _rows(config, number, one, tested, control)]
    axes = {one.wanted.axis: on_axis(one.wanted.axis, names) for one in wanted}
    inner = [three for line in axes.values() for three in zip(line, line[1:], line[2:], strict=False)]
    left_out = [_left_out(config, Neighbours(middle, lower, upper), tested) for lower, middle, upper in inner]
    return tuple(rows), tuple(row for row in left_out if row)


def _rows(
    config: TableConfig, number: int, one: Neighbours, tested: Callable[[str], TestedSetting], control: Control
) -> list[SettingRow]:
    """Return the rows of one wanted setting."""
    lower, upper = tested(one.lower.setting), tested(one.upper.setting)
    found: list[SettingRow] = []
    for place in _common(config, (lower, upper)):
        limit = min(lower.limit(place), upper.limit(place))
        speeds = np.union1d(lower.nodes.speeds, upper.nodes.speeds)
        speeds = np.append(speeds[speeds < limit * (1.0 - 1e-9)], limit)
        velocity = np.concatenate([-speeds[::-1], speeds])  # with -0 and +0 in the middle
        force = _between(one.share, lower.forces(place, velocity), upper.forces(place, velocity))
        static = _between(one.share, lower.static_force(place), upper.static_force(place))
        found += [
            SettingRow(
                setting=one.wanted.setting,
                value=one.wanted.value,
                lower_setting=lower.name,
                upper_setting=upper.name,
                temperature_degC=place[0],
                voltage_V=place[1],
                velocity_m_per_s=float(v),
                force_N=float(f),
                static_force_N=float(static),
            )
            for v, f in zip(velocity, force, strict=True)
        ]
    if not found:
        raise ConfigError(
            f"table.settings.{number}: {lower.name} and {upper.name} were tested at no {control.name} and temperature "
            f"that the table has in common; test them at the same, or leave this setting out (got {one.wanted.setting})"
        )
    return found


def _left_out(config: TableConfig, one: Neighbours, tested: Callable[[str], TestedSetting]) -> SettingLeftOutRow | None:
    """Predict a tested setting from its neighbours; None where the three have no tested condition in common."""
    lower, middle, upper = (tested(each.setting) for each in (one.lower, one.wanted, one.upper))
    three = (lower, middle, upper)
    errors, own, limits = [], [], []
    for place in _common(config, three):
        limits.append(min(each.limit(place) for each in three))
        speeds = limits[-1] * np.arange(1, COMPARED + 1) / COMPARED
        velocity = np.concatenate([-speeds[::-1], speeds])
        low, here, high = (each.forces(place, velocity) + each.static_force(place) for each in three)
        own.append(here)
        errors.append(_between(one.share, low, high) - here)
    if not own:
        return None
    peak = float(np.max(np.abs(own)))
    return SettingLeftOutRow(
        setting=middle.name,
        lower_setting=lower.name,
        upper_setting=upper.name,
        reached_m_per_s=max(limits),
        peak_force_N=peak,
        rms_share_of_peak=float(np.sqrt(np.mean(np.square(errors)))) / peak,
        largest_share_of_peak=float(np.max(np.abs(errors))) / peak,
    )


def _between(share: float, low: Array | float, high: Array | float) -> Array:
    """Interpolate: F = (1 - s) F_lower + s F_upper, s the share of the way in the number of the setting."""
    return np.asarray((1.0 - share) * low + share * high)


def _common(config: TableConfig, tested: Sequence[TestedSetting]) -> list[Place]:
    """Return the temperatures and voltages that all settings cover with tests."""
    temperatures = _covered(
        [one.temperatures for one in tested],
        config.temperatures_degC or [value for one in tested for value in one.nodes.temperatures],
        SAME_TEMPERATURE,
    )
    known = [abs(u) for one in tested for u in one.voltages if u is not None]
    voltages = _covered(
        [one.voltages for one in tested],
        config.voltages_V or [value for one in tested for value in one.nodes.voltages],
        CONSTANT_SHARE * max(known, default=0.0),
    )
    places = product(temperatures, voltages)
    return [place for place in places if min(one.limit(place) for one in tested) > 0.0]


def _covered(
    ranges: Sequence[Sequence[float | None]], nodes: Sequence[float | None], margin: float
) -> list[float | None]:
    """Return the nodes within all ranges, those within the margin of each other once; (None,) where no range is given.

    A node outside a range by up to the margin, a sensor's scatter, counts as within.
    """
    ends = [[value for value in each if value is not None] for each in ranges]
    if not any(ends):
        return [None]
    if not all(ends):
        return []
    low, high = max(map(min, ends)), min(map(max, ends))
    found: list[float | None] = []
    for node in sorted({value for value in nodes if value is not None and low - margin <= value <= high + margin}):
        if not found or node - (found[-1] or 0.0) > margin:
            found.append(node)
    return found


def _clamped(value: float | None, known: Sequence[float | None]) -> float | None:
    """Return a value clamped into the range of the known ones."""
    ends = [each for each in known if each is not None]
    return None if value is None or not ends else float(np.clip(value, min(ends), max(ends)))
