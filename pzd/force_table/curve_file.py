"""A measured curve of force over velocity, from the file that somebody wrote it into.

Headers tell velocity, force and their units, as `pzd init` reads them; what they leave open is asked for, all at once.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from pzd.damper.curve import ForceCurve, curve_of
from pzd.force_table.config import OneDamper
from pzd.quantities import FORCE, VELOCITY, VOLTAGE, Control, Quantity
from pzd.record import Array
from pzd.rig.config import matching
from pzd.rig.files.formats import read_sheet
from pzd.rig.files.layout import own_quantity
from pzd.rig.files.sheet import Sheet, Wanted
from pzd.rig.files.sniffing import COMPRESSION, DIRECTIONS, REBOUND, Dialect, described, quantity_of, unit_of
from pzd.rig.files.units import UnitError, to_canonical
from pzd.schema.errors import ConfigError, DataError, at
from pzd.schema.yamltree import written

LIKELY = 1.1
"""From this ratio of the forces at equal speeds on it is said which direction is likely rebound.

Reason: dampers of road cars are harder in rebound, mostly by half and more; a tenth may be friction or gas."""
AT_REST = 1e-4
"""Speed at which a force of each direction at rest is put, since there it has two values [m/s]: a tenth of the slowest
speed of a test."""


@dataclass(frozen=True, eq=False)
class ReadCurve:
    """A curve, and how it was read."""

    curve: ForceCurve
    path: Path
    steps: tuple[str, ...]
    """In words, a line each."""


def read_curve(asked: OneDamper, place: str, control: Control, folder: Path) -> ReadCurve:
    """Read the curve that the config names.

    Parameters
    ----------
    asked : the file, and what its headers do not tell
    place : of it in the config
    control : the control signal
    folder : the config's folder

    Raises
    ------
    ConfigError : when there is no such file, or something must be said that its headers leave open; with all of it
    DataError : when the file holds no such curve
    """
    file = _open(asked, place, control, folder)
    columns = _columns(file)
    values = [np.asarray(_cells(file, index), np.float64) for index in columns.used]
    faults = [f"{place}.{line}" for line in (*columns.faults, *_sign_faults(file, columns))]
    if faults:
        raise ConfigError(faults)
    filled = np.all([np.isfinite(one) for one in values], axis=0)
    if not filled.all():
        row = int(np.argmin(filled))
        raise DataError(f"{file.sheet.place(row)}: an empty cell; a curve needs velocity and force in every row")
    try:
        return ReadCurve(_curve(file, columns), file.path, tuple(_steps(file, columns)))
    except ValueError as error:
        raise DataError(f"{at(file.path)}: {error}") from error


# --- The file and its columns ---


@dataclass(frozen=True, eq=False)
class _File:
    """The file of a curve as it is read."""

    path: Path
    asked: OneDamper
    control: Control
    dialect: Dialect
    sheet: Sheet

    @property
    def headers(self) -> tuple[str, ...]:
        return self.sheet.header

    def below(self, index: int) -> str | None:
        """Return what the row of units, or the format, says of a column."""
        units = self.sheet.units or self.dialect.units
        return units[index] if units else None

    def unit(self, index: int, quantity: Quantity) -> str | None:
        """Return the unit of a column, by the config or its header; None where neither tells."""
        own = own_quantity(quantity, self.control)
        given = self.asked.units.get(own.name, self.asked.units.get(quantity.name))
        header = self.headers[index]
        return given or (own.unit if header == own.column else unit_of(header, self.below(index), own))


def _open(asked: OneDamper, place: str, control: Control, folder: Path) -> _File:
    paths = matching(folder, asked.curve or "")
    if len(paths) != 1:
        found = f"{len(paths)} files match, and a curve is one" if paths else f"no such file under {folder}"
        raise ConfigError(f"{place}.curve: {found}; the path is relative to the config's folder (got {asked.curve!r})")
    own = control.name
    keys = {
        "columns": (VELOCITY.name, FORCE.name, REBOUND, COMPRESSION, own),
        "units": (VELOCITY.name, FORCE.name, own),
    }
    wrong = [
        f"{place}.{field}: {key}: one of {', '.join(known)} is needed (got {key!r})"
        for field, known in keys.items()
        for key in getattr(asked, field)
        if key not in known
    ]
    if wrong:
        raise ConfigError(wrong)
    (path,) = paths
    dialect, form = described(path)
    entry = dialect.entry(path, form)
    wanted = Wanted(known=frozenset(dialect.header), numbers=frozenset(dialect.header))
    return _File(path, asked, control, dialect, read_sheet(path, entry, wanted, place))


@dataclass(frozen=True)
class _Columns:
    """Which column is what, and what nobody said of them."""

    velocity: int | None
    forces: tuple[int, ...]
    """One, or one for each value of the control signal; of rebound and of compression where `split`."""
    split: bool
    """Whether rebound and compression have columns of their own."""
    control: int | None
    """The column of the control signal."""
    signals: tuple[float, ...] | None
    """Control signal of each column of force; None where they have none."""
    faults: tuple[str, ...] = ()
    """What is to be said, each with its key."""

    @property
    def used(self) -> tuple[int, ...]:
        """Every column that is read."""
        return tuple(one for one in (self.velocity, *self.forces, self.control) if one is not None)


def _columns(file: _File) -> _Columns:
    given, faults = file.asked.columns, []
    named: dict[str, int] = {}
    for key, header in given.items():
        if header in file.headers:
            named[key] = file.headers.index(header)
        else:
            faults.append(
                f"columns: {key}: no column has this header; there are {_listed(file.headers)} (got {header!r})"
            )
    free = [index for index, header in enumerate(file.headers) if header.strip() and index not in named.values()]
    meant = {index: _meant(file, index) for index in free}
    velocity = named.get(VELOCITY.name, next((index for index in free if meant[index] is VELOCITY), None))
    free = [index for index in free if index != velocity and meant[index] is not VELOCITY]
    directions = _directions(file, named, free)
    signal = named.get(file.control.name, next((i for i in free if meant[i] is VOLTAGE and not _signal(file, i)), None))
    forces = directions or _forces(file, named, meant, [index for index in free if index != signal])
    if velocity is None:
        faults.append(_ask("velocity", file, "m/s"))
    if not forces:
        faults.append(_ask("force", file, "N"))
    signals, fault = _signals(file, forces, split=bool(directions), in_column=signal is not None)
    faults += [fault] if fault else []
    columns = _Columns(velocity, tuple(forces), bool(directions), signal, signals)
    return replace(columns, faults=(*faults, *dict.fromkeys(_unit_faults(file, columns))))


def _meant(file: _File, index: int) -> Quantity | None:
    """Return the quantity of a column by its unit, as of `F at 1 A [N]`, or else by its header."""
    header, below = file.headers[index], file.below(index)
    by_unit = (q for q in (VELOCITY, FORCE) if unit_of(header, below, q) is not None)
    return next(by_unit, None) or quantity_of(header, below, file.control)


def _directions(file: _File, named: dict[str, int], free: Sequence[int]) -> list[int]:
    """Return the columns of rebound and of compression; none where the file has not both."""
    found = []
    for key, pattern in DIRECTIONS.items():
        like = [index for index in free if pattern.search(file.headers[index])]
        index = named.get(key, like[0] if len(like) == 1 else None)
        found += [index] if index is not None else []
    return found if len(found) == len(DIRECTIONS) and FORCE.name not in named else []


def _forces(file: _File, named: dict[str, int], meant: dict[int, Quantity | None], free: Sequence[int]) -> list[int]:
    if FORCE.name in named:
        return [named[FORCE.name]]
    forces = [index for index in free if meant[index] is FORCE or _signal(file, index) is not None]
    return forces or (list(free) if len(free) == 1 or file.asked.voltages_V is not None else [])


def _signal(file: _File, index: int) -> float | None:
    """Return the value of the control signal in a header like `0.5 A`; None without one."""
    found = re.search(
        rf"(?<![\w.])(-?\d+(?:[.,]\d+)?)\s*{re.escape(file.control.unit)}(?![A-Za-z])", file.headers[index]
    )
    return float(found[1].replace(",", ".")) if found else None


def _signals(
    file: _File, forces: Sequence[int], *, split: bool, in_column: bool
) -> tuple[tuple[float, ...] | None, str | None]:
    """Return the control signal of each column of force, and what is wrong with that."""
    given, control = file.asked.voltages_V, file.control
    key = control.renamed("voltages_V")
    count = 1 if split else len(forces)
    if in_column:
        return None, f"{key}: said twice, a column holds it too; take one away" if given else None
    if given is not None:
        fault = f"{key}: {len(given)} values for {count} columns of force; give one for each"
        return given, fault if len(given) != count else None
    found = [_signal(file, index) for index in forces]
    values = tuple(one for one in found if one is not None)
    if not split and len(values) == len(forces) and values:
        return values, None
    if count > 1:
        heads = _listed([file.headers[index] for index in forces])
        return None, (
            f"{key}: {count} columns of force; say the {control.name} of each in their order, e.g. {key}: [0, 1], or "
            f"which one it is, columns: {{force: {written(file.headers[forces[0]])}}} (got {heads})"
        )
    return None, None


def _unit_faults(file: _File, columns: _Columns) -> Iterator[str]:
    pairs = [(columns.velocity, VELOCITY), *((index, FORCE) for index in columns.forces), (columns.control, VOLTAGE)]
    for index, quantity in pairs:
        own = own_quantity(quantity, file.control)
        if index is None:
            continue
        unit = file.unit(index, quantity)
        if unit is None:
            head = written(file.headers[index])
            yield f"units: {own.name}: the header {head} names no unit; say it, e.g. units: {{{own.name}: {own.unit}}}"
            continue
        try:
            to_canonical(np.zeros(1), unit, own)
        except UnitError as error:
            yield f"units: {own.name}: {error}"


def _ask(name: str, file: _File, unit: str) -> str:
    heads = _listed([head for head in file.headers if head.strip()])
    return (
        f"columns: {name}: no header names it; say columns: {{{name}: HEADER}} and units: {{{name}: {unit}}}, or what "
        f"its unit is; HEADER is one of {heads}"
    )


def _listed(headers: Sequence[str]) -> str:
    return ", ".join(map(written, headers))


def _cells(file: _File, index: int) -> Array:
    """Return the (rows,) numbers of a column.

    Raises
    ------
    DataError : when a cell is none
    """
    if index in file.sheet.faults:
        raise DataError(file.sheet.faults[index])
    return file.sheet.numbers[index]


# --- Which direction is rebound ---


def _sign_faults(file: _File, columns: _Columns) -> Iterator[str]:
    """Ask which direction is rebound, with what speaks for either."""
    sign = file.asked.sign
    if columns.split:
        if sign is not None:
            yield "sign: the columns say which force is that of rebound; take this key away"
        return
    if sign is not None or columns.velocity is None or not columns.forces:
        return
    velocity, force = _cells(file, columns.velocity), _cells(file, columns.forces[0])
    known = np.isfinite(velocity) & np.isfinite(force)
    velocity, force = velocity[known], force[known]
    likely = ""
    if velocity.size and velocity.min() < 0.0 < velocity.max():
        reach = min(-velocity.min(), velocity.max())
        order = np.argsort(velocity)
        up, down = (abs(float(np.interp(v, velocity[order], force[order]))) for v in (reach, -reach))
        likely = f"; the force is {up:.4g} at {reach:.4g} and {down:.4g} at {-reach:.4g} as they stand"
        if max(up, down) > LIKELY * min(up, down):
            likely += f", and most dampers are harder in rebound, which would be sign: {1 if up > down else -1}"
    yield (
        "sign: which direction is rebound? say sign: 1 where positive velocities extend the damper (rebound), sign: -1 "
        f"where they compress it{likely}"
    )


# --- The curve ---


def _curve(file: _File, columns: _Columns) -> ForceCurve:
    """Make the curve of the columns, rebound positive, the force with the sign of the velocity as in every damper.

    Raises
    ------
    ValueError : when they are no curve of a damper
    """
    velocity = _converted(file, columns.velocity, VELOCITY)
    forces = np.column_stack([_converted(file, index, FORCE) for index in columns.forces])
    if columns.split:
        return _of_directions(np.abs(velocity), np.abs(forces), columns.signals)
    signals = None if columns.signals is None else np.array(columns.signals)
    if columns.control is not None:
        signal = _converted(file, columns.control, VOLTAGE)
        signals, velocity, forces = _side_by_side(velocity, forces[:, 0], signal)
    if float(np.sum(forces * velocity[:, np.newaxis])) < 0.0:
        forces = -forces  # counted against the velocity
    sign = file.asked.sign or 1
    return curve_of(*_at_rest(sign * velocity, sign * forces), signals, 1)


def _converted(file: _File, index: int | None, quantity: Quantity) -> Array:
    if index is None:
        raise ValueError(f"{quantity.name}: no column holds it")
    return to_canonical(_cells(file, index), file.unit(index, quantity) or "", own_quantity(quantity, file.control))


def _at_rest(velocity: Array, forces: Array) -> tuple[Array, Array]:
    """Put two rows at rest to either side of it: the force of dry friction jumps there, as in a table of force."""
    rest = np.flatnonzero(velocity == 0.0)
    if rest.size != 2:
        return velocity, forces
    if np.array_equal(*forces[rest]):
        return np.delete(velocity, rest[1]), np.delete(forces, rest[1], axis=0)
    moved = velocity.copy()
    moved[rest[np.argsort(forces[rest, 0])]] = -AT_REST, AT_REST
    return moved, forces


def _of_directions(speed: Array, forces: Array, signals: tuple[float, ...] | None) -> ForceCurve:
    """Join the forces of rebound and compression over the speed, given as magnitudes."""
    rest = speed == 0.0
    at = np.where(rest & (forces.max(axis=1) > 0.0), AT_REST, speed)
    both = np.concatenate([at, -at[at > 0.0]])
    joined = np.concatenate([forces[:, 0], -forces[at > 0.0, 1]])
    return curve_of(both, joined[:, np.newaxis], None if signals is None else np.array(signals), 1)


def _side_by_side(velocity: Array, force: Array, signal: Array) -> tuple[Array, Array, Array]:
    """Put the curves of a long table beside each other, over the velocities of all of them.

    Where one has no point at a velocity of another, it is taken from the straight line between its neighbours.
    """
    values = np.unique(signal)
    every = [(velocity[signal == value], force[signal == value]) for value in values]
    low, high = max(v.min() for v, _ in every), min(v.max() for v, _ in every)
    common = np.unique(np.concatenate([v[(v >= low) & (v <= high)] for v, _ in every]))
    columns = []
    for value, (v, f) in zip(values, every, strict=True):
        order = np.argsort(v, kind="stable")
        if np.any(np.diff(v[order]) == 0.0):
            twice = v[order][:-1][np.diff(v[order]) == 0.0][0]
            raise ValueError(f"velocity: {twice:g} m/s stands twice at {value:g}; give the force at each velocity once")
        columns.append(np.interp(common, v[order], f[order]))
    return values, common, np.column_stack(columns)


def _steps(file: _File, columns: _Columns) -> Iterator[str]:
    """Say how the file was read."""
    for index, quantity in ((columns.velocity, VELOCITY), *((index, FORCE) for index in columns.forces)):
        if index is not None:
            yield f"{quantity.name}: {written(file.headers[index])} in {file.unit(index, quantity)}"
    if columns.split:
        yield "rebound and compression: by their columns"
        return
    if columns.control is not None:
        yield f"{file.control.name}: {written(file.headers[columns.control])}; linear between points that not all have"
    yield f"rebound: where velocities are {'positive' if file.asked.sign == 1 else 'negative'}"
    velocity = _converted(file, columns.velocity, VELOCITY)
    if float(np.sum(velocity * _converted(file, columns.forces[0], FORCE))) < 0.0:
        yield "force: turned over, since it is counted against the velocity"
