"""Force at settings between tested ones, linear in the number of a clicker, gap, shim or gas pressure.

Every setting is taken as identify hands it on, by the law that it was given there: diagnose looks at one setting alone,
so the effects that it adopts are of that one and of no other.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from itertools import pairwise

import numpy as np

from pzd.artefacts import Identified, Rig, SettingLeftOutRow, SettingRow, identified_damper
from pzd.artefacts.table import Neighbours, on_axis
from pzd.damper.compose import static_force
from pzd.damper.model import Damper
from pzd.force_table.config import TableConfig
from pzd.force_table.force import ReachedSpeed, TableNodes, forces, grid, reached, temperatures_of, voltages_of
from pzd.quantities import Control
from pzd.record import CONSTANT_SHARE, SAME_TEMPERATURE, Array
from pzd.schema.errors import ConfigError

COMPARED = 200
"""Speeds, evenly spaced, over which a prediction is compared: as many as draw a smooth curve."""

Place = tuple[float | None, float | None]
"""Temperature [degC] and control signal [V]."""


@dataclass(frozen=True, eq=False)
class TestedSetting:
    """The damper of one tested setting, and where its table rests on tests."""

    name: str
    damper: Damper
    reach: ReachedSpeed
    nodes: TableNodes

    def limit(self, place: Place) -> float:
        """The speed that the rig reached at a place, which may lie off the tested ones by a sensor's scatter [m/s]."""
        return self.reach.at(*self._held(place))

    def forces(self, place: Place, velocity: Array) -> Array:
        """(n,) force at steady slip [N]."""
        return forces(self.damper, *self._held(place), velocity)

    def static_force(self, place: Place) -> float:
        """Force at rest [N]."""
        return float(static_force(self.damper, self._held(place)[1]))

    @cached_property
    def places(self) -> tuple[tuple[float | None, ...], tuple[float | None, ...]]:
        """Temperatures and voltages of its parameters, rising."""
        return temperatures_of(self.damper), voltages_of(self.damper)

    def _held(self, place: Place) -> Place:
        temperature, voltage = (_held(value, known) for value, known in zip(place, self.places, strict=True))
        return temperature, voltage


def between_settings(
    config: TableConfig, rig: Rig, identified: Identified, control: Control
) -> tuple[tuple[SettingRow, ...], tuple[SettingLeftOutRow, ...]]:
    """The force at the settings that the config asks for, and how well tested ones would be predicted if left out.

    Parameters
    ----------
    config : the config's block
    rig : the records, for the speeds that were reached
    identified : the dampers of all settings
    control : the control signal, for the words of a refusal

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
        return _tested(config, rig, identified, name)

    wanted = config.between(names)
    rows = [row for number, one in enumerate(wanted) for row in _rows(config, number, one, tested, control)]
    axes = {one.wanted.axis: on_axis(one.wanted.axis, names) for one in wanted}
    left_out = []
    for line in axes.values():
        for (lower, middle), (_, upper) in pairwise(pairwise(line)):
            row = _left_out(config, Neighbours(middle, lower, upper), tested)
            left_out += [row] if row else []
    return tuple(rows), tuple(left_out)


def _tested(config: TableConfig, rig: Rig, identified: Identified, name: str) -> TestedSetting:
    damper = identified_damper(identified, name)
    records = [record for record in rig.records if record.setting == name]
    reach = reached(records, temperatures_of(damper), voltages_of(damper))
    return TestedSetting(name, damper, reach, grid(config, damper, temperatures_of(damper), reach))


def _rows(
    config: TableConfig, number: int, one: Neighbours, tested: Callable[[str], TestedSetting], control: Control
) -> list[SettingRow]:
    lower, upper = tested(one.lower.setting), tested(one.upper.setting)
    found: list[SettingRow] = []
    for place in _common(config, (lower, upper)):
        velocity = _velocities((lower, upper), place)
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
    """None where the three were tested at nothing in common."""
    lower, middle, upper = (tested(each.setting) for each in (one.lower, one.wanted, one.upper))
    three = (lower, middle, upper)
    missed, own, limits = [], [], []
    for place in _common(config, three):
        limits.append(min(each.limit(place) for each in three))
        speeds = limits[-1] * np.arange(1, COMPARED + 1) / COMPARED
        velocity = np.concatenate([-speeds[::-1], speeds])
        low, here, high = (each.forces(place, velocity) + each.static_force(place) for each in three)
        own.append(here)
        missed.append(_between(one.share, low, high) - here)
    if not own:
        return None
    peak = float(np.max(np.abs(own)))
    return SettingLeftOutRow(
        setting=middle.name,
        lower_setting=lower.name,
        upper_setting=upper.name,
        reached_m_per_s=max(limits),
        peak_force_N=peak,
        rms_share_of_peak=float(np.sqrt(np.mean(np.square(missed)))) / peak,
        largest_share_of_peak=float(np.max(np.abs(missed))) / peak,
    )


def _between(share: float, low: Array | float, high: Array | float) -> Array:
    """Equation: F = (1 - s) F_lower + s F_upper      Source: linear interpolation in the number of the setting."""
    return np.asarray((1.0 - share) * low + share * high)


def _common(config: TableConfig, tested: Sequence[TestedSetting]) -> list[Place]:
    """Temperatures and voltages that all cover, where all were moved."""
    temperatures = _covered(
        [one.places[0] for one in tested],
        config.temperatures_degC or [value for one in tested for value in one.nodes.temperatures],
        SAME_TEMPERATURE,
    )
    known = [abs(u) for one in tested for u in one.places[1] if u is not None]
    voltages = _covered(
        [one.places[1] for one in tested],
        config.voltages_V or [value for one in tested for value in one.nodes.voltages],
        CONSTANT_SHARE * max(known, default=0.0),
    )
    places = [(temperature, voltage) for temperature in temperatures for voltage in voltages]
    return [place for place in places if min(one.limit(place) for one in tested) > 0.0]


def _covered(
    ranges: Sequence[Sequence[float | None]], nodes: Sequence[float | None], margin: float
) -> list[float | None]:
    """The nodes within all the ranges, those within the margin of each other once; (None,) where no range has a value.

    A node that a sensor's scatter puts off a range by up to the margin is within.
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


def _held(value: float | None, known: Sequence[float | None]) -> float | None:
    """A value within the range of those known, to which scatter is drawn."""
    ends = [each for each in known if each is not None]
    return None if value is None or not ends else float(np.clip(value, min(ends), max(ends)))


def _velocities(tested: Sequence[TestedSetting], place: Place) -> Array:
    """Velocities of the tables up to the speed that all reached at a place, with -0 and +0 in the middle [m/s]."""
    limit = min(one.limit(place) for one in tested)
    speeds = np.unique(np.concatenate([one.nodes.speeds for one in tested]))
    within = np.append(speeds[speeds < limit * (1.0 - 1e-9)], limit)
    return np.concatenate([-within[::-1], within])
