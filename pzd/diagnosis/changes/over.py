"""Each quantity over more than two states, all against the first: end of line, warm-up, fade, durability."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from pzd.artefacts import Rig
from pzd.artefacts.changes import Course, CourseRow, Numbers, Verdict
from pzd.diagnosis.changes.candidates import ELEMENT_COLUMNS, Candidate
from pzd.diagnosis.changes.findings import Findings, findings_between
from pzd.diagnosis.changes.pairs import averaged
from pzd.diagnosis.changes.quantities import refitted
from pzd.diagnosis.changes.reason import beside_effects
from pzd.diagnosis.changes.selection import GAIN
from pzd.diagnosis.changes.state import State
from pzd.diagnosis.changes.verdict import changes_of
from pzd.diagnosis.config import ChangesConfig, DiagnoseConfig
from pzd.fit.intervals import LEVEL
from pzd.identification.config import IdentifyConfig
from pzd.quantities import Control
from pzd.record import Record, sliced
from pzd.schema.errors import DataError
from pzd.signals.cycles import cycles_of

MOST_BLOCKS = 8
"""Blocks of cycles of a long test: as many points as a course needs."""
CYCLES_OF_BLOCK = 2
"""Fewest cycles of a block: their scatter is its noise."""
WORST: tuple[Verdict, ...] = ("unchanged", "changed", "ambiguous", "unexplained")
"""Verdicts in the order in which one of a pair of states decides on all."""
NOT_FOLLOWED = "{} changed in no state and is nothing that {} has, so that it is not held against its limits"
"""Why a tolerance is left open."""


@dataclass(frozen=True, eq=False)
class Followed:
    """The course of every quantity, and why it is not to be trusted."""

    course: Course
    undetermined: tuple[str, ...] = ()


def followed_over(
    states: Sequence[State],
    diagnose: DiagnoseConfig,
    identify: IdentifyConfig,
    changes: ChangesConfig,
    control: Control,
) -> Followed:
    """Follow each quantity that changed in any state, or has limits, over all of them.

    Parameters
    ----------
    states : in their order, each compared with the first, whose damper carries small differences of motion
    diagnose, identify, changes : blocks of the config
    control : the control signal, for units

    Raises
    ------
    DataError : when a state has no test that can be compared
    """
    first, *later = states
    slack = first.voltage_slack(identify.group.voltage_V)
    found = [findings_between(first, state, diagnose, identify, control) for state in later]
    results = [changes_of(each) for each in found]
    changed = {key for each in found for c in each.best.candidates if c.of == "damper" for key in c.key}
    adopted = changed | _limited(found, changes.tolerance)
    rows = [*_quantities(found, adopted, control), *_peak_forces(states, changes, slack)]
    judged = [_judged(row, changes.tolerance) for row in rows]
    passes = [row.pass_ for row in judged if _limits(row, changes.tolerance) is not None]
    open_ = [name for name in changes.tolerance if name not in {_quantity(row) for row in rows}]
    verdict = max((result.verdict for result in results), key=WORST.index)
    same = [{(u.name, u.parameter) for u in result.unchanged} for result in results]
    course = Course(
        verdict=verdict,
        from_=first.name,
        to=later[-1].name,
        states=tuple(state.name for state in states),
        compared=results[-1].compared if len({r.compared for r in results}) == 1 else "both",
        difference=results[-1].difference,
        over=tuple(judged),
        unchanged=tuple(u for u in results[-1].unchanged if all((u.name, u.parameter) in each for each in same)),
        rivals=tuple(dict.fromkeys(name for result in results for name in result.rivals)),
        reason="; ".join(
            [f"{r.to}: {r.verdict}" for r in results]
            + [line for row in judged for line in _leaves(row, states)]
            + beside_effects(found[0], [row.name for row in judged])
            + [NOT_FOLLOWED.format(name, first.name) for name in open_]
        ),
        pass_=_together([*passes, *(None for _ in open_)]),
    )
    return Followed(course, tuple(dict.fromkeys(line for state in states for line in state.undetermined)))


# --- The quantities


def _limited(found: Sequence[Findings], tolerance: Mapping[str, tuple[float, float]]) -> set[tuple[str, str]]:
    """Return the quantities with limits that the first damper has: one that stays as it is has to lie within them too.

    Those of an effect that it has not are followed once they changed: next to none, they are told from no other.
    """
    present = {key for each in found for c in each.search.candidates if c.of == "damper" for key in c.key}
    own = {*ELEMENT_COLUMNS, *found[0].first.damper.effects}
    return {key for key in present if key[0] in own and _named(*key) in tolerance}


def _quantities(found: Sequence[Findings], adopted: set[tuple[str, str]], control: Control) -> list[CourseRow]:
    """Return the quantities that changed in any state, T0 and C over the states, fitted together in each."""
    values: dict[tuple[str, str], list[tuple[Numbers, Numbers, Numbers]]] = {}
    starts: dict[tuple[str, str], tuple[Numbers, str, tuple[float, ...] | None]] = {}
    sides = {c.name: c.side for each in found for c in each.best.candidates}
    for number, each in enumerate(found):
        for change in refitted(each, _together_with(each, adopted, sides)):
            key = (change.name, change.parameter)
            if key not in values:
                values[key] = [(None, None, None)] * number
                starts[key] = (change.from_, control.own_unit(change.unit), change.at_voltage_V)
            values[key].append((change.to, change.low95, change.high95))
        for key, course in values.items():
            if len(course) <= number:
                values[key] = [*course, (None, None, None)]
    rows = []
    for key, course in values.items():
        start, unit, at = starts[key]
        to, low, high = zip((start, start, start), *course, strict=True)
        rows.append(
            CourseRow(name=key[0], parameter=key[1], unit=unit, values=to, low95=low, high95=high, at_voltage_V=at)
        )
    return rows


def _together_with(found: Findings, adopted: set[tuple[str, str]], sides: Mapping[str, int]) -> list[Candidate]:
    """Return the candidates of a pair of states that are fitted together: its own, and the others that are followed.

    T0 is always followed, C where it changed in any state or these two would have shown it. A gain that cannot be told
    from T0, C and k of one level is theirs in every state, where they changed in one; a stop keeps its side.
    """
    changed = any(name in ELEMENT_COLUMNS for name, _ in adopted)
    theirs = changed and not any(c.per_voltage for c in found.search.candidates)
    chosen = [c for c in found.best.candidates if not (theirs and c.name == GAIN)]
    followed = adopted | {("T0", "T0")} | {(u.name, u.parameter) for u in changes_of(found).unchanged if u.name == "C"}
    for candidate in found.search.candidates:
        have = {key for c in chosen for key in c.key}
        new = set(candidate.key) <= followed and not set(candidate.key) & have
        if new and not candidate.per_voltage and candidate.side == sides.get(candidate.name, 0):
            chosen.append(candidate)
    return chosen


# --- Peak force over peak velocity

BEYOND = 0.01
"""Share by which the speed of a tolerance may lie beyond those of the tests: a stand reaches a speed no better."""


def _peak_forces(states: Sequence[State], changes: ChangesConfig, slack: float) -> Iterator[CourseRow]:
    """Yield the forces at the speeds of the tolerance, between those of the tests of each state."""
    for band in changes.peak_force:
        for side, name in ((1.0, "rebound"), (-1.0, "compression")):
            forces = [_peak_force(state, band.velocity_m_per_s, side, band.voltage_V, slack) for state in states]
            values = tuple(None if force is None else force[0] for force in forces)
            low = tuple(None if force is None else force[0] - force[1] for force in forces)
            high = tuple(None if force is None else force[0] + force[1] for force in forces)
            parameter = f"{name}_{band.velocity_m_per_s:g}_m_per_s"
            columns: tuple[tuple[Numbers, ...], ...] = (values, low, high)
            at = None
            if band.voltage_V is not None:
                at, columns = (band.voltage_V,), tuple(tuple((v,) for v in column) for column in (values, low, high))
            yield CourseRow(
                name="peak_force", parameter=parameter, unit="N", values=columns[0], low95=columns[1],
                high95=columns[2], at_voltage_V=at, limits=band.limits(name),
            )  # fmt: skip


def _peak_force(
    state: State, velocity: float, side: float, voltage: float | None, slack: float
) -> tuple[float, float] | None:
    """Return the force at a peak speed, linear between tests, and half its interval by noise; None beyond the tests.

    Parameters
    ----------
    state : whose tests are taken
    velocity : peak speed [m/s]
    side : 1 for rebound, -1 for compression
    voltage : control signal of the tests [V]; None for all
    slack : by how much that of a test may differ from it [V]
    """
    points = []
    for test in averaged(state.cleaned):
        if voltage is not None and (test.voltage is None or abs(test.voltage - voltage) > slack):
            continue
        v, force = test.cleaned.mean_motion[1], test.cleaned.folded
        at = int(np.argmax(side * v))
        points.append((side * float(v[at]), float(np.mean(force[:, at])), float(np.std(force[:, at], ddof=1)),
                       len(force)))  # fmt: skip
    points.sort()
    speeds = [p[0] for p in points]
    if not points or not speeds[0] * (1.0 - BEYOND) <= velocity <= speeds[-1] * (1.0 + BEYOND):
        return None
    half = [LEVEL * p[2] / np.sqrt(p[3]) for p in points]
    return float(np.interp(velocity, speeds, [p[1] for p in points])), float(np.interp(velocity, speeds, half))


# --- Tolerance


def _limits(row: CourseRow, tolerance: Mapping[str, tuple[float, float]]) -> tuple[float, float] | None:
    if row.limits is not None:
        return row.limits
    return tolerance.get(f"{row.name}.{row.parameter}") or (
        tolerance.get(row.name) if row.name == row.parameter else None
    )


def _judged(row: CourseRow, tolerance: Mapping[str, tuple[float, float]]) -> CourseRow:
    """Return the row with whether every state lies within its limits."""
    limits = _limits(row, tolerance)
    if limits is None:
        return row
    judged = row.model_copy(update={"limits": limits})
    return judged.model_copy(update={"pass_": _together([judged.within(i) for i in range(len(row.values))])})


def _leaves(row: CourseRow, states: Sequence[State]) -> Iterator[str]:
    """Yield the sentence that names the first state outside the limits."""
    outside = [state.name for i, state in enumerate(states) if row.within(i) is False]
    if outside:
        yield f"{_quantity(row)} is outside its limits from {outside[0]} on"


def _quantity(row: CourseRow) -> str:
    """Return the name of a quantity as `changes.tolerance` has it."""
    return _named(row.name, row.parameter)


def _named(name: str, parameter: str) -> str:
    return name if name == parameter else f"{name}.{parameter}"


def _together(passes: Sequence[bool | None]) -> bool | None:
    """Whether all pass; None where one is open and none fails, or where there is none."""
    if False in passes:
        return False
    return None if None in passes or not passes else True


# --- Blocks of cycles as states


def blocks_of_cycles(rig: Rig, setting: str | None) -> list[tuple[str, Rig]]:
    """Cut the cycles of every test into blocks, the n-th of all tests together a state.

    Parameters
    ----------
    rig : the records
    setting : of the rig's settings, the one that is cut

    Returns
    -------
    names and records of the blocks

    Raises
    ------
    DataError : when no test has cycles enough for two
    """
    records = [(r, run) for r in rig.records if r.setting == setting and (run := cycles_of(r)) is not None]
    longest = max((run.count for _, run in records), default=0)
    blocks = min(MOST_BLOCKS, longest // CYCLES_OF_BLOCK)
    if blocks < 2:
        raise DataError(
            f"--over cycles: no test has {2 * CYCLES_OF_BLOCK} cycles that repeat (got {longest}); record a longer one"
        )
    long = [(record, run) for record, run in records if run.count >= CYCLES_OF_BLOCK * blocks]
    found = []
    for block in range(blocks):
        parts: list[Record] = []
        for record, run in long:
            number, size = run.number(record.time), run.count // blocks
            parts.append(sliced(record, (number >= block * size) & (number < (block + 1) * size)))
        size = long[0][1].count // blocks
        name = f"cycles {block * size + 1}-{(block + 1) * size}"
        found.append((name, replace(rig, records=tuple(parts), entries=())))
    return found
