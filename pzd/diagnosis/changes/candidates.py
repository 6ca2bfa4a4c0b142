"""What may have changed, and the force of a damper in which it has: quantities of the damper and doings of the stand.

Every candidate is a set of coordinates, each 0 where nothing changed: a share of T0, a logarithm of C or k, the
difference of an effect's parameter in the scale of its search. The stand acts on the recorded force as a whole, so what
it does includes what no model explains.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal, cast

import numpy as np

from pzd.damper.compose import respond
from pzd.damper.confounders import known
from pzd.damper.effect import NODE_VOLTAGES, EffectValues, Parameter, Scales
from pzd.damper.effects import accumulator, end_stop, library
from pzd.damper.fitted_laws import fitted_laws, knee, seal
from pzd.damper.model import BaseRow, Damper, acts_at_a_place, against_nature
from pzd.damper.parameter_rows import bingham_parameters, rows_per_voltage
from pzd.diagnosis.changes.pairs import Comparison, stacked
from pzd.diagnosis.fit.least_squares import LARGEST_LOG_RATIO
from pzd.diagnosis.fit.problem import BOUND, Unknown
from pzd.diagnosis.search.determination import force_at_rest
from pzd.quantities import BINGHAM
from pzd.record import Array, Complex

Of = Literal["damper", "stand"]

LARGEST_GAIN = 0.05
"""Largest change of the gain that is the load cell's: a larger one is the damper's, by the contract."""
LARGEST_DELAY_S = 0.005
"""Largest change of the delay that is the recorder's [s]: a longer one is the damper's."""
LEAST_FRICTION = 0.01
"""Share of the peak force from which T0 changes in proportion to itself; a smaller one in that of the peak force."""
MOST_IN_PROPORTION = 20.0
"""By how many times itself a size given by control signal changes: as far as e^3 takes C and k."""
FRICTION_STARTS = (0.0, -0.7, 1.5)
RATIO_STARTS = (0.0, -1.2, 1.2)
"""Where a fit of T0 and one of C or k begin: a linearised step is worth little over a factor of three."""
DELAY_STARTS = (0.0, -0.6, 0.6)
"""Where a fit of the delay begins [LARGEST_DELAY_S]: over a jump of dry friction no linearised step reaches far."""
WEAK = 0.9
"""Slope beside C from which an effect without a linear coordinate starts too, as a share of it.

Reason: the linearised step sizes the others; a relief valve that changes the force by a percent does it so."""
CLOSEST = 0.7
"""Largest ratio of two starts of a logarithmic parameter that have another one between them, where a law has several
and no size.

Reason: the force of a valve is no straight line in where it opens and how far; at a start 40 % off it leaves more than
its absence, however well the true one explains the difference."""
FAINT = 1e-3
"""The same for an effect of one logarithmic coordinate: a yield that is rounded over a thousandth of the largest speed.

Reason: no linearised step of a logarithm is longer than one, so that a start a hundred times too large promises nothing
of a change that makes a percent of the force."""
TOLERANCE = 1e-6
"""Tolerance of the simulations, as a share of the force: far below what counts."""
SHARE = "share"
"""Coordinate of a known temperature: 0 at that of the first state, 1 at that recorded in the second."""
FAR = 1.0
"""Share of the half stroke by which the middle of a stop at one side lies off.

Reason: one that begins at 0.3 of the half stroke, where the first do, has its other end at 2.3, beyond what the second
state is run to; the gas is compressed at 1.5 at most, and would have no length left."""
LEAST_WARMING = 0.5
"""Difference of the mean temperatures [K] from which temperature is a candidate: the resolution of a thermocouple."""

ELEMENT_UNITS = {quantity.symbol: quantity.unit for quantity in BINGHAM}
ELEMENT_COLUMNS = {quantity.symbol: quantity.column for quantity in BINGHAM}
STAND: Mapping[str, tuple[str, float]] = {
    "load_cell_zero": ("N", np.inf),
    "load_cell_gain": ("-", LARGEST_GAIN),
    "recorder_delay": ("s", LARGEST_DELAY_S),
}
"""Unit and largest size of what the stand may have done to the force; the zero of the displacement moves no force."""
NOT_HERE = ("sensor_delay", "temperature_drift")
"""Effects that are no change by themselves: one state's delay is in both, and a temperature is recorded."""


@dataclass(frozen=True)
class Coordinate:
    """One number that may have changed, 0 where it has not."""

    name: str
    """T0, C, k, an effect, `temperature`, or what the stand did."""
    parameter: str
    of: Of
    unit: str
    scale: float
    """Change of the parameter by one unit of the coordinate, to first order."""
    node: int | None = None
    """Index of its voltage; None for one change at every voltage."""
    low: float = -np.inf
    high: float = np.inf
    logarithmic: bool = False
    """Whether the coordinate is the logarithm of the ratio to `start`."""
    start: float = 0.0
    """Value at coordinate 0: that of the first state, or the scale of the search where that is absent."""
    absent: bool = False
    """Whether the first state has it not, so that a logarithmic coordinate of 0 is a change."""
    added: bool = False
    """Whether it adds to a parameter that differs by control signal, alike at all; else in proportion to it."""
    side: int = 0
    """1 or -1 of a stop that is reached in extension or in compression alone, 0 of all else."""


@dataclass(frozen=True)
class Candidate:
    """One cause that may have changed the force."""

    name: str
    of: Of
    coordinates: tuple[Coordinate, ...]
    starts: tuple[tuple[float, ...], ...]
    """Starting values of a fit, (coordinates,) each."""
    absent: bool = False
    """Whether the first state does not have it: an effect that is newly there."""
    flexible: bool = False
    """Whether it is a law of several numbers that imitates others: asked where these leave something without a name."""

    @property
    def per_voltage(self) -> bool:
        """Whether it has one change at every voltage."""
        return any(c.node is not None for c in self.coordinates)

    @property
    def side(self) -> int:
        """+1 or -1 of a stop in extension or compression alone, else 0."""
        return next((c.side for c in self.coordinates if c.side), 0)

    @property
    def key(self) -> tuple[tuple[str, str], ...]:
        """What it changes."""
        return tuple(dict.fromkeys((c.name, c.parameter) for c in self.coordinates))


def excludes(one: Candidate, other: Candidate) -> bool:
    """Whether two candidates change the same quantity, or one is a stop at one side and both act at a place."""
    placed = all(acts_at_a_place(each.name) for each in (one, other)) and (one.side or other.side)
    return bool(set(one.key) & set(other.key)) or one.name == other.name or bool(placed)


# --- The damper in which something changed


@dataclass(frozen=True, eq=False)
class FirstState:
    """The damper of the first state, and what is needed to change it."""

    damper: Damper
    force: float
    """Largest force [N]."""
    scales: Scales
    middle_m: float
    """Displacement from which effects count that act at a place of the stroke: the middle of that of all tests."""

    def changed(self, coordinates: Sequence[Coordinate], values: Sequence[float], warmer: float | None) -> Damper:
        """Return the damper in which some coordinates have other values; those of the stand are left out.

        Parameters
        ----------
        coordinates : what changed
        values : of the coordinates
        warmer : temperature of the second state less that of the first [K]
        """
        rows = {id(row): row for row in self.damper.base}
        groups = rows_per_voltage(self.damper.base)
        effects = {name: dict(own) for name, own in self.damper.effects.items()}
        placed = []
        for c, x in zip(coordinates, values, strict=True):
            if c.of == "stand" or c.parameter == SHARE:
                continue
            if c.name == "T0" and {seal.EFFECT.name, knee.EFFECT.name} <= {*effects}:
                self._move_frictions(effects[seal.EFFECT.name], rows, c, x)
            elif c.name in ELEMENT_COLUMNS or c.name == "temperature":
                of_node = range(len(groups)) if c.node is None else (c.node,)
                for original in (row for i in of_node for row in groups[i][1]):
                    rows[id(original)] = self._row(rows[id(original)], c, x, warmer)
            elif acts_at_a_place(c.name):
                placed.append((c, x))
            else:
                self._move_effect(effects, c, x)
        base = tuple(rows[id(row)] for row in self.damper.base)
        if knee.EFFECT.name in effects:
            effects[knee.EFFECT.name] = self._knees_beside(effects[knee.EFFECT.name], rows)
        damper = self.damper.model_copy(update={"base": base, "effects": effects})
        return self._placed(damper, placed) if placed else damper

    @property
    def may_be_moved(self) -> bool:
        """Whether the damper is the same about any zero of the displacement."""
        beyond = [self.middle_m + side * FAR * self.scales.stroke for side in (1, -1)]
        return all(_counted_from(self.damper, zero).zero_m == zero for zero in beyond)

    def _placed(self, damper: Damper, placed: Sequence[tuple[Coordinate, float]]) -> Damper:
        """Return a damper with effects that act at a place of the stroke, about its middle.

        The law of a stop has one at either end. Of one that is reached at one end alone the middle lies so far off that
        the other is out of reach.
        """
        side = next((c.side for c, _ in placed if c.side), 0)
        away = FAR * self.scales.stroke * abs(side)
        zero = self.middle_m - side * away
        damper = _counted_from(damper, zero) if side else damper.about(zero)
        effects = {name: dict(own) for name, own in damper.effects.items()}
        for c, x in placed:
            self._move_effect(effects, c, x)
            if side and known_parameter(c.name, c.parameter).position:
                effects[c.name][c.parameter] = cast("float", effects[c.name][c.parameter]) + away
        return damper.model_copy(update={"effects": effects})

    def _knees_beside(self, law: EffectValues, rows: Mapping[int, BaseRow]) -> dict[str, float | tuple[float, ...]]:
        """Return the knee law beside the T0 of other rows, by the identity of those whose place they take."""
        groups = rows_per_voltage(self.damper.base)
        more = [float(np.mean([rows[id(row)].T0_N - row.T0_N for row in group])) for _, group in groups]
        values = dict(law)
        for name in knee.KNEE_FORCES:
            force, nodes = np.atleast_1d(law[name]), np.atleast_1d(law.get(NODE_VOLTAGES, 0.0))
            rubs = np.interp(nodes, [voltage for voltage, _ in groups], more)
            moved = [knee.with_seal(*each) for each in zip(force.tolist(), rubs.tolist(), strict=True)]
            values[name] = tuple(moved) if isinstance(law[name], tuple) else moved[0]
        return values

    def _row(self, row: BaseRow, c: Coordinate, x: float, warmer: float | None) -> BaseRow:
        if c.name == "temperature":
            column = ELEMENT_COLUMNS["T0" if c.parameter == "beta_T0" else "C"]
            return row.model_copy(update={column: getattr(row, column) * float(np.exp(-x * (warmer or 0.0)))})
        column = ELEMENT_COLUMNS[c.name]
        value = getattr(row, column)
        if c.logarithmic:
            return row.model_copy(update={column: value * float(np.exp(x))})
        return row.model_copy(update={column: max(value + x * self._friction_unit(value, c.node), 0.0)})

    def _move_frictions(
        self, own: dict[str, float | tuple[float, ...]], rows: dict[int, BaseRow], c: Coordinate, x: float
    ) -> None:
        """Change the friction of a seal and what the flow has beside it alike, at one control signal or at all."""

        def factor(friction: float) -> float:
            return max(1.0 + x * self._friction_unit(friction, c.node) / friction, 0.0) if friction > 0.0 else 1.0

        given, moved = own["F_s"], []
        rubs = np.atleast_1d(given).tolist()
        for i, (_, group) in enumerate(rows_per_voltage(self.damper.base)):
            mine = rubs[min(i, len(rubs) - 1)]
            for original in group if c.node in (None, i) else ():
                row = rows[id(original)]
                rows[id(original)] = row.model_copy(update={"T0_N": row.T0_N * factor(row.T0_N + mine)})
            whole = mine + float(np.mean([row.T0_N for row in group]))
            changed = mine * factor(whole) if whole > 0.0 else max(x * self._friction_unit(0.0, c.node), 0.0)
            moved.append(changed if c.node in (None, i) else mine)
        own["F_s"] = tuple(moved) if isinstance(given, tuple) else moved[c.node or 0]

    def _friction_unit(self, friction: float, node: int | None) -> float:
        """Return by how much a T0 [N] changes by one unit of its coordinate, of one control signal or of all [N]."""
        of_all = node is None and any(LEAST_FRICTION * self.force < each for each in frictions(self.damper))
        return friction if of_all or friction > LEAST_FRICTION * self.force else self.force

    def least_friction(self, node: int | None) -> float:
        """Return the coordinate of T0 at which no friction is left, at one control signal or at all."""
        given = frictions(self.damper)
        some = given if node is None else [given[i] for i in rows_of_voltage(self.damper, node)]
        return min(-each / (self._friction_unit(each, node) or 1.0) for each in some)

    def _move_effect(self, effects: dict[str, dict[str, float | tuple[float, ...]]], c: Coordinate, x: float) -> None:
        parameter = known_parameter(c.name, c.parameter)
        own = effects.setdefault(c.name, {p.name: p.neutral for p in known()[c.name].parameters})
        present = own.get(c.parameter, parameter.neutral)
        if isinstance(present, tuple):
            own[c.parameter] = values_by_control(c, present, x)
            return
        own[c.parameter] = parameter_value(c, x)

    def is_natural(self, coordinates: Sequence[Coordinate], values: Sequence[float]) -> bool:
        """Whether the effects that changed have physical values, as far as those of the first state had."""
        before = against_nature(without_laws(self.damper))
        return set(against_nature(without_laws(self.changed(coordinates, values, None)))) <= set(before)


def _counted_from(damper: Damper, zero: float) -> Damper:
    """Return the same damper about another zero of the displacement [m]; as it is where no values make up for that.

    Equation: F_g (1 + (x + s)/L)^-n = F_g (1 + s/L)^-n (1 + x/(L + s))^-n
    """
    gas = accumulator.EFFECT.name
    moved = damper.without_effects(gas).about(zero)
    if gas not in damper.effects or moved.zero_m != zero:
        return damper.about(zero)
    own, by = dict(damper.effects[gas]), zero - damper.zero_m
    force, length = np.asarray(own["F_g"]), np.asarray(own["L"])
    if np.any(length + by <= 0.0):
        return damper
    values = {"F_g": force * (1.0 + by / length) ** -accumulator.POLYTROPIC, "L": length + by}
    own |= {name: tuple(each.tolist()) if each.ndim else float(each) for name, each in values.items()}
    return moved.model_copy(update={"effects": {**moved.effects, gas: own}})


def frictions(damper: Damper) -> list[float]:
    """Return the friction [N] of each base row, of the flow and of a seal on the rod."""
    return [row.T0_N + _seal_friction(damper, row.voltage_V) for row in damper.base]


def rows_of_voltage(damper: Damper, node: int) -> list[int]:
    """Return the indices of the base rows of one of the voltages, counted from the lowest."""
    place = {id(row): i for i, row in enumerate(damper.base)}
    return [place[id(row)] for row in rows_per_voltage(damper.base)[node][1]]


def _seal_friction(damper: Damper, voltage: float | None) -> float:
    """Return the friction of a seal on the rod [N], 0 without one; linear between the control signals of its values."""
    own = damper.effects.get(seal.EFFECT.name, {"F_s": 0.0})
    return float(np.interp(voltage or 0.0, np.atleast_1d(own.get(NODE_VOLTAGES, 0.0)), np.atleast_1d(own["F_s"])))


def element_of(damper: Damper, voltage: float | None, temperature: float | None) -> Array:
    """Return (3,) T0 [N], C [N s/m] and k [N/m] of a damper at a control signal [V] and a temperature [degC].

    T0 is all of the friction, that of a seal on the rod too.
    """
    if temperature is None and len({row.temperature_degC for row in damper.base}) > 1:
        temperature = float(np.median([row.temperature_degC or 0.0 for row in damper.base]))
    found: Array = np.array(bingham_parameters(damper, voltage, temperature)[0])
    found[0] += _seal_friction(damper, voltage)
    return found


def without_laws(damper: Damper) -> Damper:
    """Return a damper without the laws in the place of T0 and C, of which no values are against nature."""
    return damper.without_effects(*fitted_laws())


def known_parameter(name: str, parameter: str) -> Parameter:
    """Return a parameter of an effect."""
    return known()[name].parameter(parameter)


def parameter_value(c: Coordinate, x: float) -> float:
    """Return the value of an effect's parameter at a value of its coordinate."""
    parameter = known_parameter(c.name, c.parameter)
    within = float(np.clip(x, c.low, c.high))
    value = c.start * float(np.exp(within)) if c.logarithmic else c.start + within * c.scale
    return float(np.clip(value, parameter.low, parameter.high))


def values_by_control(c: Coordinate, before: Sequence[float], x: float) -> tuple[float, ...]:
    """Return the values of an effect's parameter that differs by control signal at a value of its coordinate."""
    parameter = known_parameter(c.name, c.parameter)
    moved = (v + x * c.scale if c.added else v * (1.0 + x) for v in before)
    return tuple(float(np.clip(v, parameter.low, parameter.high)) for v in moved)


# --- The candidates


def candidates(first: FirstState, comparisons: Sequence[Comparison]) -> list[Candidate]:
    """List what may have changed, the doings of the stand first, so that what both explain is not the damper's."""
    found = [_of_stand(name, first.force) for name in STAND]
    found += _of_element(first, comparisons)
    warmer = [c.warmer for c in comparisons if c.warmer is not None]
    if len(warmer) == len(comparisons) and max(map(abs, warmer), default=0.0) > LEAST_WARMING:
        found.append(_warming(first.damper, max(map(abs, warmer))))
    for name, effect in {**library(), **fitted_laws()}.items():
        present = name in first.damper.effects
        if name in NOT_HERE or (not present and (name in fitted_laws() or effect.asked_last)):
            continue  # what diagnose asks for the prediction alone is no name of what is newly there
        if name == seal.EFFECT.name:
            continue  # its friction is T0
        alone = effect.beside_gas and not present and not force_at_rest(first.damper)
        if effect.needs is not None or alone:
            continue
        found += _present(first, name) if present else [_absent(first, name)]
        if name == end_stop.EFFECT.name and not present and first.may_be_moved:
            found += [_at_one_side(found[-1], side) for side in (1, -1)]
        if present and name == knee.EFFECT.name:
            found += _parts_of_law(found)
    return [candidate for candidate in found if all(c.low < c.high for c in candidate.coordinates)]


def _of_stand(name: str, force: float) -> Candidate:
    unit, most = STAND[name]
    scale = force if name == "load_cell_zero" else most
    limit = most / scale
    starts = DELAY_STARTS if name == "recorder_delay" else (0.0,)
    coordinate = Coordinate(name, name, "stand", unit, scale, None, -limit, limit)
    return Candidate(name, "stand", (coordinate,), tuple((x,) for x in starts))


def _of_element(first: FirstState, comparisons: Sequence[Comparison]) -> list[Candidate]:
    groups = rows_per_voltage(first.damper.base)
    compared = sorted({nearest_node(groups, c.voltage) for c in comparisons})
    found = []
    for name, unit in ELEMENT_UNITS.items():
        low, high = (first.least_friction(None), np.inf) if name == "T0" else (-LARGEST_LOG_RATIO, LARGEST_LOG_RATIO)
        whole = Coordinate(name, name, "damper", unit, 1.0, None, low, high, name != "T0")
        starts = FRICTION_STARTS if name == "T0" else RATIO_STARTS
        found.append(Candidate(name, "damper", (whole,), tuple((x,) for x in starts)))
        if len(compared) > 1:
            lows = [first.least_friction(node) if name == "T0" else low for node in compared]
            nodes = tuple(replace(whole, node=node, low=least) for node, least in zip(compared, lows, strict=True))
            found.append(Candidate(name, "damper", nodes, tuple((x,) * len(nodes) for x in starts)))
    return found


def nearest_node(groups: Sequence[tuple[float, list[BaseRow]]], voltage: float | None) -> int:
    """Return the index of the voltage of a base that is nearest to a control signal [V]."""
    return min(range(len(groups)), key=lambda i: abs(groups[i][0] - (voltage or 0.0)))


def _warming(damper: Damper, warmer: float) -> Candidate:
    """Return the recorded temperature as a cause: by what the damper knows of it, else by a drift of T0 and C."""
    if knows_temperature(damper):
        share = Coordinate("temperature", SHARE, "damper", "-", 1.0, None, -1.0, 3.0)
        return Candidate("temperature", "damper", (share,), ((1.0,),))
    most = 1.0 / warmer
    betas = tuple(
        Coordinate("temperature", beta, "damper", "1/K", 1.0, None, -most, most) for beta in ("beta_T0", "beta_C")
    )
    return Candidate("temperature", "damper", betas, ((0.0, 0.0),))


def knows_temperature(damper: Damper) -> bool:
    """Whether a damper has T0, C and k at several temperatures, or a drift."""
    rows = {row.temperature_degC for row in damper.base}
    return len(rows) > 1 or "temperature_drift" in damper.effects


def _absent(first: FirstState, name: str) -> Candidate:
    """Return an effect that is newly there, with its starting values."""
    coordinates = []
    for p in known()[name].parameters:
        scale = p.search.scale(first.scales) or 1.0
        low, high = Unknown(name, p, scale).bounds
        if p.search.logarithmic:
            coordinates.append(Coordinate(name, p.name, "damper", p.unit, scale, None, low, high, True, scale, True))
        else:
            neutral = p.neutral if np.isfinite(p.neutral) else 0.0
            limits = low - neutral / scale, high - neutral / scale
            coordinates.append(Coordinate(name, p.name, "damper", p.unit, scale, None, *limits, False, neutral, True))

    def searched(c: Coordinate, x: float) -> float:
        return float(np.log(max(x, 1.0 / BOUND))) if c.logarithmic else x - c.start / c.scale

    effect, gas = known()[name], force_at_rest(first.damper)
    unscaled = all(c.logarithmic for c in coordinates)
    faint = (FAINT,) if unscaled and len(coordinates) == 1 else ()
    several = unscaled and len(coordinates) > 1

    def tried(p: Parameter) -> tuple[float, ...]:
        if effect.beside_gas and p.unit == "N":  # it is passed where the flow undoes the gas
            return (-gas / (p.search.scale(first.scales) or 1.0),)
        weak = (WEAK,) if unscaled and p.unit == "N s/m" else ()
        starts = p.search.starts_on(first.scales)
        return (*(_closer(starts) if several else starts), *weak, *faint)

    grid = itertools.product(*map(tried, effect.parameters))
    starts = tuple(tuple(searched(c, x) for c, x in zip(coordinates, given, strict=True)) for given in grid)
    return Candidate(name, "damper", tuple(coordinates), starts, True, _flexible(name))


def _at_one_side(stop: Candidate, side: int) -> Candidate:
    """Return a stop at one side alone, as a bump stop is."""
    return replace(stop, coordinates=tuple(replace(c, side=side) for c in stop.coordinates))


def _parts_of_law(found: Sequence[Candidate]) -> Iterator[Candidate]:
    """Yield what of the law changes together: what one needle, one stack of shims, one piston face or the oil changes.

    By itself no number of them explains what all did: the tests then seem to differ in their gains.
    """
    (damping,) = next(c for c in found if c.name == "C").coordinates
    law = max((c for c in found if c.name == knee.EFFECT.name), key=lambda c: len(c.coordinates))
    for names in knee.CHANGE_TOGETHER:
        numbers = [c for c in (damping, *law.coordinates) if c.parameter in names]
        yield replace(law, coordinates=tuple(numbers), starts=((0.0,) * len(numbers),))


def _closer(starts: Sequence[float]) -> tuple[float, ...]:
    """Return starts with the geometric mean between any two that are far from each other."""
    own = sorted(starts)
    between = [float(np.sqrt(a * b)) for a, b in itertools.pairwise(own) if a < CLOSEST * b]
    return tuple(sorted([*own, *between]))


def _flexible(name: str) -> bool:
    effect = known()[name]
    return effect.imitates or effect.never_named is not None


def _present(first: FirstState, name: str) -> list[Candidate]:
    """Return each parameter of an effect that the first state has, and all of them together.

    One that differs by control signal may change in proportion or, as a size of force, by as much at all: what is newly
    there beside what the first state has adds to it.
    """
    own, coordinates, added, without = first.damper.effects[name], [], [], []
    for p in known()[name].parameters:
        value = own.get(p.name, p.neutral)
        if p.optional and not np.any(value):
            without.append(p.name)
        if isinstance(value, tuple):
            size, most = float(np.mean(value)), MOST_IN_PROPORTION
            coordinates.append(Coordinate(name, p.name, "damper", p.unit, size, None, -1.0, most))
            if not p.search.logarithmic:
                added.append(replace(coordinates[-1], low=-most, added=True))
        elif p.search.logarithmic and value > 0.0:
            limits = float(np.log(max(p.low / value, 1.0 / BOUND))), float(np.log(min(p.high / value, BOUND)))
            searched = Unknown(name, p, p.search.scale(first.scales) or 1.0)
            low, high = (bound - searched.to_search(value) for bound in searched.bounds)
            if low <= 0.0 <= high:  # what lies outside of what a diagnosis searches was written by hand
                limits = max(limits[0], low), min(limits[1], high)
            coordinates.append(Coordinate(name, p.name, "damper", p.unit, value, None, *limits, True, value))
        else:
            scale = p.search.scale(first.scales) or 1.0
            # What goes away ends at none: a hair beyond, where noise puts every other fit, nature has no value.
            low = max(p.low, p.natural_from) if value >= p.natural_from else p.low
            high = min(p.high, p.natural_to) if value <= p.natural_to else p.high
            limits = (low - value) / scale, (high - value) / scale
            coordinates.append(Coordinate(name, p.name, "damper", p.unit, scale, None, *limits, False, value))
    flexible = _flexible(name)
    single = [Candidate(name, "damper", (c,), _starts(c), flexible=flexible) for c in (*coordinates, *added)]
    # A part of the law that the first state has not is asked for alone.
    there = tuple(c for c in coordinates if c.parameter not in without)
    together = Candidate(name, "damper", there, ((0.0,) * len(there),), flexible=flexible)
    return [*single, together] if len(coordinates) > 1 else single


def _starts(c: Coordinate) -> tuple[tuple[float, ...], ...]:
    """Return where a fit of one number of a present effect begins: as it is, and where it is gone.

    From 0.9 mm of lash no linearised step leads to none.
    """
    neutral = known_parameter(c.name, c.parameter).neutral
    if c.logarithmic or c.start == 0.0 or not np.isfinite(neutral):
        return ((0.0,),)
    gone = (neutral - c.start) / c.scale
    return ((0.0,), (gone,)) if c.low <= gone <= c.high else ((0.0,),)


# --- The difference of force that they make


@dataclass(eq=False)
class Response:
    """Difference of force that changed coordinates make in every comparison; simulations are kept."""

    first: FirstState
    comparisons: tuple[Comparison, ...]
    _simulated: dict[tuple[tuple[Coordinate, float], ...], tuple[Complex, ...]] = field(
        default_factory=dict, repr=False
    )

    def of(self, coordinates: Sequence[Coordinate], values: Sequence[float]) -> tuple[Array, ...]:
        """Compute the (2 H + 1,) stacked difference of force in every comparison [N].

        Equation: D = (1 + g) exp(-i w tau) (F + R' - R) + F_z - F, F as recorded in the first state, R simulated
        """
        stand = {c.name: x * c.scale for c, x in zip(coordinates, values, strict=True) if c.of == "stand"}
        moved = tuple(
            (c, float(x))
            for c, x in zip(coordinates, values, strict=True)
            if c.of == "damper" and (x != 0.0 or (c.logarithmic and c.absent))
        )
        found = []
        for comparison, change in zip(self.comparisons, self._changes(moved), strict=True):
            force = comparison.reference + change
            late = np.exp(-1j * comparison.rate * stand.get("recorder_delay", 0.0))
            seen = (1.0 + stand.get("load_cell_gain", 0.0)) * late * force
            seen[0] += stand.get("load_cell_zero", 0.0)
            found.append(stacked(seen - comparison.reference))
        return tuple(found)

    def _changes(self, moved: tuple[tuple[Coordinate, float], ...]) -> tuple[Complex, ...]:
        if not moved:
            return tuple(np.zeros_like(c.reference) for c in self.comparisons)
        if moved not in self._simulated:
            coordinates, values = [c for c, _ in moved], [x for _, x in moved]
            self._simulated[moved] = tuple(self._change(c, coordinates, values) for c in self.comparisons)
        return self._simulated[moved]

    def _change(self, comparison: Comparison, coordinates: Sequence[Coordinate], values: Sequence[float]) -> Complex:
        damper = self.first.changed(coordinates, values, comparison.warmer)
        motion = comparison.motion
        for c, x in zip(coordinates, values, strict=True):
            if c.parameter == SHARE and motion.temperature is not None:
                motion = replace(motion, temperature=motion.temperature + x * (comparison.warmer or 0.0))
        force = respond(damper, motion, comparison.first_force, TOLERANCE)
        return np.asarray(comparison.spectrum(force) - comparison.simulated)
