"""Why the paper's identified parameters cannot give its measured forces, and what could close the gap.

From the printed numbers alone. At gap 0.25 mm and 0 V the paper gives most of them for one condition:
the peak at 1 and at 2 Hz, the peak at 43 degC, and the force at zero velocity at both temperatures.
Every effect of the library is tried on these five, over three bases: the element with T0, C and k of
Tables 2 and 3; with their k alone; with nothing of them. An effect closes the gap where every force
lies within 2 % (or within the range that the paper prints for one test), those at zero velocity within 10 %.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from pzd.damper.effect import Effect, Scales
from pzd.damper.effects import nameable
from pzd.damper.model import BaseRow, Damper
from pzd.paper.loop import loop_in, loop_of
from pzd.paper.published import AT_ZERO, LARGE_GAP, PEAK, TABLES, WARM_DEGC, rig_tests, span, table_damper
from pzd.paper.valve import peak_speed
from pzd.record import Array
from pzd.report.reference import Expected

Base = Literal["tables", "stiffness of the tables", "nothing of the tables"]
BASES: tuple[Base, ...] = ("tables", "stiffness of the tables", "nothing of the tables")
NO_EFFECT = "no effect"
TOLERANCES = {PEAK: 0.02, AT_ZERO: 0.10}
"""What counts as closed, as a share of the published force."""
_SAMPLES = 160
_LARGEST = {"T0": 1000.0, "C": 20000.0, "k": 1e8}
_FREE = {"T0": 150.0, "C": 3700.0, "k": 3e6}
"""Where the parameters of the base start where they are free."""


@dataclass(frozen=True)
class Miss:
    """One measured force beside that of the element with the parameters of its table."""

    id: str
    table: str
    measured: float
    element: float
    orifice: float | None
    """What a peak lacks over the square of its speed: the coefficient of an orifice that would close it [N s2/m2].
    None for a force at zero velocity."""

    @property
    def share(self) -> float:
        """How far the element is from the measurement, as a share of it; negative where it is short."""
        return self.element / self.measured - 1.0


@dataclass(frozen=True)
class Attempt:
    """One effect, fitted to the five forces over one base."""

    base: Base
    effect: str
    unknowns: int
    """Parameters that were fitted to the five numbers."""
    worst: float
    """Largest miss in units of what is admitted."""
    worst_id: str
    parameters: Mapping[str, float]

    @property
    def closes(self) -> bool:
        """Whether every force is met."""
        return self.worst <= 1.0


def misses() -> tuple[Miss, ...]:
    """Every measured force of Figures 4, 5, 6, 8 and 9 beside the element with the parameters of Tables 1 to 3."""
    return tuple(_miss_of(row) for row in rig_tests())


def _miss_of(row: Expected) -> Miss:
    table = next(
        name
        for name, (setting, temperature) in TABLES.items()
        if setting == row.setting and (temperature > WARM_DEGC) == ((row.temperature_degC or 0.0) > WARM_DEGC)
    )
    loop = loop_in(Damper(base=table_damper(table)), row)
    if row.quantity == AT_ZERO:
        return Miss(row.id, table, row.number, loop.at_zero, None)
    return Miss(row.id, table, row.number, loop.peak, (row.number - loop.peak) / peak_speed(row) ** 2)


def condition() -> tuple[Expected, ...]:
    """The published forces at gap 0.25 mm and 0 V."""
    return tuple(row for row in rig_tests() if row.setting == LARGE_GAP and row.voltage_V == 0.0)


def attempts() -> tuple[Attempt, ...]:
    """Every effect over every base, best first within a base."""
    found = [_attempt(base, effect) for base in BASES for effect in (None, *candidates())]
    return tuple(sorted(found, key=lambda one: (BASES.index(one.base), one.worst)))


def candidates() -> tuple[Effect, ...]:
    """The effects that can act at a constant voltage and temperature."""
    return tuple(effect for effect in nameable().values() if effect.needs is None)


def excluded() -> tuple[str, ...]:
    """The effects that cannot: what they need does not move inside any published test."""
    return tuple(effect.name for effect in nameable().values() if effect.needs is not None)


def _attempt(base: Base, effect: Effect | None) -> Attempt:
    trials: list[Attempt] = []
    for start in _starts(effect):
        trials.append(_fit(base, effect, start))
        if trials[-1].closes:
            break
    return min(trials, key=lambda one: one.worst)


def _scales() -> Scales:
    rows = {row.id: row for row in condition()}
    largest, table = rows["F6-2"], table_damper("Table 2")[0]
    speed, amplitude = peak_speed(largest), largest.amplitude_m or 0.0
    return Scales(
        force=largest.number,
        low_force=largest.number,
        speed=speed,
        stroke=amplitude,
        acceleration=speed**2 / amplitude,
        damping=table.C_Ns_per_m,
        voltage=0.0,
    )


def _starts(effect: Effect | None) -> Iterator[dict[str, float]]:
    """Starting values of an effect: each parameter's first, then each other one of the parameters with several."""
    if effect is None:
        yield {}
        return
    scales = _scales()
    first = {p.name: p.search.starts[0] * p.search.scale(scales) for p in effect.parameters}
    yield first
    for p in effect.parameters:
        for start in p.search.starts[1:]:
            yield {**first, p.name: start * p.search.scale(scales)}


@dataclass(frozen=True)
class _Unknown:
    """One fitted number: where it starts, its limits and the size that it is counted in."""

    name: str
    start: float
    low: float
    high: float
    size: float


def _unknowns(base: Base, effect: Effect | None, start: Mapping[str, float]) -> list[_Unknown]:
    found = []
    if base != "tables":
        for name in ("T0 cold", "C cold", "T0 hot", "C hot"):
            symbol = name.split()[0]
            found.append(_Unknown(name, _FREE[symbol], 0.0 if symbol == "T0" else 1.0, _LARGEST[symbol], _FREE[symbol]))
    if base == "nothing of the tables":
        found.append(_Unknown("k", _FREE["k"], 1e4, _LARGEST["k"], _FREE["k"]))
    for parameter in effect.parameters if effect else ():
        value = float(np.clip(start[parameter.name], parameter.low, parameter.high))
        size = abs(value) or abs(parameter.search.scale(_scales())) or 1.0
        found.append(_Unknown(parameter.name, value, parameter.low, parameter.high, size))
    return found


def _fit(base: Base, effect: Effect | None, start: Mapping[str, float]) -> Attempt:
    from scipy.optimize import least_squares

    unknowns = _unknowns(base, effect, start)
    sizes = np.array([unknown.size for unknown in unknowns])

    def values(scaled: Array) -> dict[str, float]:
        return {unknown.name: float(v) for unknown, v in zip(unknowns, scaled * sizes, strict=True)}

    def misses_at(scaled: Array) -> Array:
        found = values(np.clip(scaled * sizes, low, high) / sizes)
        return np.array(list(_misses(effect, found).values()))

    low, high = np.array([u.low for u in unknowns]), np.array([u.high for u in unknowns])
    best = np.array([u.start for u in unknowns]) / sizes
    if unknowns:
        inside = np.clip(best, low / sizes + 1e-6, high / sizes - 1e-6)
        limits = (low / sizes, high / sizes)
        best = least_squares(
            misses_at, inside, bounds=limits, diff_step=[1e-5] * len(unknowns), ftol=1e-6, xtol=1e-6, max_nfev=40
        ).x
    found = _misses(effect, values(best))
    worst = max(found, key=lambda name: abs(found[name]))
    return Attempt(base, effect.name if effect else NO_EFFECT, len(unknowns), abs(found[worst]), worst, values(best))


def _misses(effect: Effect | None, found: Mapping[str, float]) -> dict[str, float]:
    """Miss of each of the published forces, 1 at the edge of what is admitted."""
    dampers = {warm: _damper(effect, found, warm=warm) for warm in (False, True)}
    missed, loops = {}, {}
    for row in condition():
        warm, frequency = (row.temperature_degC or 0.0) > WARM_DEGC, row.frequency_Hz or 0.0
        if (warm, frequency) not in loops:
            loops[warm, frequency] = loop_of(dampers[warm], frequency, row.amplitude_m or 0.0, None, None, _SAMPLES)
        loop = loops[warm, frequency]
        missed[row.id] = _miss(loop.peak if row.quantity == PEAK else loop.at_zero, row)
    return missed


def _miss(force: float, row: Expected) -> float:
    low, high = span(row)
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    return (force - middle) / max(half, TOLERANCES[row.quantity] * middle)


def _damper(effect: Effect | None, found: Mapping[str, float], *, warm: bool) -> Damper:
    table = table_damper("Table 3" if warm else "Table 2")[0]
    suffix = "hot" if warm else "cold"
    row = BaseRow(
        T0_N=found.get(f"T0 {suffix}", table.T0_N),
        C_Ns_per_m=found.get(f"C {suffix}", table.C_Ns_per_m),
        k_N_per_m=found.get("k", table.k_N_per_m),
    )
    damper = Damper(base=(row,))
    return damper.with_effect(effect.name, {p.name: found[p.name] for p in effect.parameters}) if effect else damper
