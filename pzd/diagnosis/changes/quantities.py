"""Each quantity before and after a change with its interval, and the quantities that stayed as they were."""

from __future__ import annotations

from collections.abc import Sequence
from typing import cast

import numpy as np

from pzd.artefacts.changes import Change, Numbers, Unchanged, holds_what_was
from pzd.damper.confounders import known
from pzd.damper.effect import NODE_VOLTAGES
from pzd.damper.parameter_rows import rows_per_voltage
from pzd.diagnosis.changes.candidates import (
    ELEMENT_COLUMNS,
    Candidate,
    Coordinate,
    Of,
    element_of,
    known_parameter,
    nearest_node,
    parameter_value,
    values_by_control,
)
from pzd.diagnosis.changes.findings import Findings
from pzd.diagnosis.changes.regression import Fitted
from pzd.diagnosis.changes.uncertainty import Uncertainty
from pzd.fit.intervals import LEVEL

SHOWN = 0.3
"""Change of a coordinate that must be visible for a quantity to be told unchanged: a third of T0, C, k or the scale of
an effect. What moves the force by less is not shown by the tests."""
LITTLE = 0.05
"""Share of the difference (mean square) below which a change is believed only where its intervals leave out what was
before. Not tuned."""
GONE = 1e-3
"""Share of an interval by which a value may differ from that of an effect that is off, and be it.

Reason: far less than any interval tells; the search ends so near to a limit. Not tuned."""
ZERO_SHARE = 0.01
"""Shift of the mean displacement that is reported, as a share of the half stroke: an actuator centres so well."""


def refitted(found: Findings, candidates: Sequence[Candidate]) -> list[Change]:
    """Return the quantities of some candidates fitted together, whether they changed or not."""
    if not candidates:
        return []
    kept = [c for c in found.best.candidates if c in candidates]
    start = [found.best.values_of(c) if c in kept else np.array(c.starts[0]) for c in candidates]
    fitted = found.search.regression.fit(candidates, np.concatenate(start), found.best.scatter)
    return [change for change in changed_quantities(found, fitted) if change.of == "damper"]


def changed_quantities(found: Findings, best: Fitted) -> list[Change]:
    """Return every quantity of the changes of a fit, with its share of the difference."""
    if not best.candidates:
        return []
    errors = Uncertainty(found.search, best).errors
    whole = float(np.mean([c.difference @ c.difference for c in found.comparisons]))
    told = []
    for candidate in best.candidates:
        less = found.search.without(best, candidate)
        share = float(np.clip((less.mean_square - best.mean_square) / whole, 0.0, 1.0)) if whole > 0.0 else 0.0
        for name, parameter in candidate.key:
            mine = [
                (c, float(x), float(e))
                for c, x, e in zip(best.coordinates, best.values, errors, strict=True)
                if (c.name, c.parameter) == (name, parameter)
            ]
            told.append(_change(found, mine, share))
    unique = {(c.name, c.parameter): c for c in told}
    return list(unique.values())


def _change(found: Findings, mine: Sequence[tuple[Coordinate, float, float]], share: float) -> Change:
    c = mine[0][0]
    at, start, to, low, high = _values(found, mine)
    name, parameter, unit = c.name, c.parameter, found.control.own_unit(c.unit)
    if c.name == "temperature":
        parameter, unit = "temperature", "degC"
    visible = "beyond what the tests of one state differ by"
    return Change(
        name=name,
        parameter=parameter,
        of=c.of,
        unit=unit,
        from_=start,
        to=to,
        low95=low,
        high95=high,
        at_voltage_V=at,
        share=share,
        reason=f"adopted: it makes {100.0 * share:.3g} % of the difference, {visible}",
    )


def unchanged_of_laws(best: Fitted, reported: Sequence[Change]) -> list[Change]:
    """Return the numbers of laws of both states that may be as they were, where others of the same law are not."""
    by_key = {(change.name, change.parameter): change for change in reported}
    as_they_were: list[Change] = []
    for candidate in best.candidates:
        own = [by_key[key] for key in candidate.key if key in by_key]
        held = [change for change in own if _holds_what_was(change)]
        as_they_were += held if len(held) < len(own) and not candidate.absent else []
    return as_they_were


def displacement_zero(found: Findings) -> list[Change]:
    """Return the shift of the mean displacement, where it is large: the zero of its sensor, or of the stroke."""
    shifts = np.array([c.displacement_zero for c in found.comparisons if c.before is not None])
    if not shifts.size:
        return []
    mean = float(np.mean(shifts))
    spread = float(np.std(shifts, ddof=1)) / np.sqrt(shifts.size) if shifts.size > 1 else 0.0
    if abs(mean) < max(ZERO_SHARE * max(c.amplitude for c in found.comparisons), 2.0 * LEVEL * spread):
        return []
    return [
        Change(
            name="displacement_zero", parameter="displacement_zero", of="stand", unit="m", from_=0.0, to=mean,
            low95=mean - LEVEL * spread, high95=mean + LEVEL * spread, share=0.0,
            reason="the displacement has another middle; forces are compared about the middle of each",
        )
    ]  # fmt: skip


def unchanged_quantities(found: Findings, best: Fitted) -> tuple[Unchanged, ...]:
    """List what would have shown a visible change, and has not changed visibly.

    No T0 that is not told from 0 where a branch holds the friction: none of the damper would seem to be there.
    """
    uncertainty = Uncertainty(found.search, best)
    branched = any(known()[name].place == "branch" for name in found.first.damper.effects)
    shown: dict[tuple[str, str], Unchanged] = {}
    for candidate in filter(uncertainty.tells, found.search.candidates):
        if candidate.key[0] in shown:
            continue
        (c,) = candidate.coordinates
        if_changed = uncertainty.if_changed(candidate)
        most = found.diagnose.visible / if_changed.force if if_changed.force > 0.0 else np.inf
        if most > SHOWN or LEVEL * if_changed.alone > most or abs(if_changed.value) > most:
            continue
        at, start, to, low, high = _values(found, [(c, if_changed.value, if_changed.error)])
        if branched and c.name == "T0" and any(not end for end in (low if isinstance(low, tuple) else (low,))):
            continue
        shown[candidate.key[0]] = Unchanged(
            name=c.name, parameter=c.parameter, unit=found.control.own_unit(c.unit), from_=start, to=to,
            low95=low, high95=high, at_voltage_V=at,
        )  # fmt: skip
    return tuple(shown.values())


def as_it_was(change: Change) -> Unchanged:
    """Return a quantity that is as it was."""
    return Unchanged(
        name=change.name, parameter=change.parameter, unit=change.unit, from_=change.from_, to=change.to,
        low95=change.low95, high95=change.high95, at_voltage_V=change.at_voltage_V,
    )  # fmt: skip


# --- Values and their intervals


def _values(
    found: Findings, mine: Sequence[tuple[Coordinate, float, float]]
) -> tuple[tuple[float, ...] | None, Numbers, Numbers, Numbers, Numbers]:
    """Return the voltages, and the value in the first state, in the second, and the ends of its interval.

    What no test shows, its error infinite, has neither a value in the second state nor an interval.
    """
    c, x, e = mine[0]
    if c.name == "temperature":
        start, to = found.temperatures()
        return None, start, to, to, to
    if c.of == "stand":
        return None, 0.0, x * c.scale, (x - LEVEL * e) * c.scale, (x + LEVEL * e) * c.scale
    if c.name in ELEMENT_COLUMNS:
        return _element_values(found, mine)
    own = found.first.damper.effects.get(c.name, {}).get(c.parameter)
    nodes = found.first.damper.effects[c.name][NODE_VOLTAGES] if isinstance(own, tuple) else None
    at = cast("tuple[float, ...] | None", nodes)
    if not np.isfinite(e):
        return at, own, None, None, None
    if isinstance(own, tuple):
        ends = np.sort([values_by_control(c, own, x + s * LEVEL * e) for s in (-1.0, 0.0, 1.0)], axis=0)
        return at, own, tuple(ends[1].tolist()), tuple(ends[0].tolist()), tuple(ends[2].tolist())
    neutral = known_parameter(c.name, c.parameter).neutral
    start_value = own if own is not None else (neutral if np.isfinite(neutral) else None)
    low, to, high = sorted(parameter_value(c, x + s * LEVEL * e) for s in (-1.0, 0.0, 1.0))
    if abs(to - neutral) < GONE * (high - low):
        to = neutral  # a fit ends a hair inside its limits
    return None, start_value, to, low, high


def _element_values(
    found: Findings, mine: Sequence[tuple[Coordinate, float, float]]
) -> tuple[tuple[float, ...] | None, Numbers, Numbers, Numbers, Numbers]:
    c = mine[0][0]
    column = list(ELEMENT_COLUMNS).index(c.name)
    voltages = found.voltages()
    groups = rows_per_voltage(found.first.damper.base)
    temperature = found.temperatures()[0]

    def at(values: Sequence[float]) -> list[float]:
        damper = found.first.changed([each for each, _, _ in mine], values, None)
        return [float(element_of(damper, v, temperature)[column]) for v in voltages]

    start = at([0.0] * len(mine))
    shown = [e if np.isfinite(e) else 0.0 for _, _, e in mine]
    after, one, other = (
        at([x + s * LEVEL * e for (_, x, _), e in zip(mine, shown, strict=True)]) for s in (0.0, -1.0, 1.0)
    )
    unseen = {c.node for c, _, e in mine if not np.isfinite(e)}
    seen = [None not in unseen and (v is None or nearest_node(groups, v) not in unseen) for v in voltages]
    least, most = [*map(min, one, other)], [*map(max, one, other)]
    if c.name == "T0":  # a fit ends a hair inside its limit of none
        after = [0.0 if to < GONE * (high - low) else to for to, low, high in zip(after, least, most, strict=True)]
    columns = (after, least, most)
    to, low, high = (tuple(v if k else None for v, k in zip(column, seen, strict=True)) for column in columns)
    if len(groups) < 2 or len(voltages) < 2:
        return None, start[0], to[0], low[0], high[0]
    return tuple(cast("list[float]", voltages)), tuple(start), to, low, high


# --- Which changes are open


def _holds_what_was(change: Change) -> bool:
    """Whether the interval of a changed quantity holds its value in the first state, at every control signal.

    What no test shows may be anything.
    """
    if change.to is None:
        return True
    nodes = range(len(change.at_voltage_V or (None,)))
    return all(holds_what_was(change, i) is True for i in nodes)  # of what no test shows none is held


def is_determined(change: Change) -> bool:
    """Whether the interval of a quantity is no wider than `SHOWN` of itself, at every control signal."""
    ends = [np.asarray(each, dtype=float) for each in (change.low95, change.high95, change.from_) if each is not None]
    if len(ends) < 3:
        return False
    low, high, before = ends
    return bool(np.all(high - low <= SHOWN * np.maximum(np.abs(before), np.abs(high))))


def is_little(changes: Sequence[Change], name: str) -> bool:
    """Whether a change makes next to nothing of the difference."""
    return all(change.share < LITTLE for change in changes if change.name == name)


def may_be_as_before(changes: Sequence[Change], of: Sequence[Of] = ("damper",)) -> list[str]:
    """Return the names of changes of the damper, or of the stand too, whose intervals all hold what was before."""
    asked = [change for change in changes if change.of in of]
    differ = {change.name for change in asked if not _holds_what_was(change)}
    return list(dict.fromkeys(change.name for change in asked if change.name not in differ))
