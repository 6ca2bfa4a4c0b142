"""Rig files into records: each step once and in this order.

listing -> layout -> format reader -> channels -> tests -> refusals -> clock -> fixture -> work -> record
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from pzd.artefacts import Finding, IngestRow
from pzd.parallel.on_disk import OnDisk, one_at_a_time
from pzd.parallel.processes import parallel_each
from pzd.quantities import (
    ACCELERATION,
    DISPLACEMENT,
    FORCE,
    PRESSURE,
    TEMPERATURE,
    TIME,
    VELOCITY,
    VOLTAGE,
    Control,
    Quantity,
)
from pzd.record import Array, Record
from pzd.rig.config import FilesEntry, Fixture, Limits, matching
from pzd.rig.files.channels import DamperAlone, RawRecord, channels, split_into_tests, without_fixture
from pzd.rig.files.child import end_child
from pzd.rig.files.clock import clock_remarks
from pzd.rig.files.counted import beside_counted
from pzd.rig.files.formats import lines_above, read_sheet
from pzd.rig.files.layout import Layout, Values, layouts
from pzd.rig.files.refusals import refuse, sign_faults, works_on_the_rig
from pzd.rig.files.sheet import ReadingStep, Sheet
from pzd.rig.preflight import PreflightRecord
from pzd.rig.preflight.motion import recorded_velocity
from pzd.schema.errors import Advised, ConfigError, DataError, counted, no_file
from pzd.schema.model import safe_name
from pzd.signals.cycles import cycles
from pzd.signals.kinematics import kinematics
from pzd.signals.measures import one_record

# --- Listing ---


@dataclass(frozen=True)
class Listed:
    """One file, and the entry of the config that names it."""

    path: Path
    entry: FilesEntry
    number: int
    """Number of the entry in the config, from 0."""


def _said_once(faults: Iterable[tuple[Path, str]]) -> list[str]:
    """Say a fault that several files show alike once, of the first of them, and of how many more.

    Parameters
    ----------
    faults : each with its file; two are alike where they say the same but for the names of their files
    """
    alike: dict[str, list[str]] = {}
    for path, fault in faults:
        alike.setdefault(fault.replace(str(path), "").replace(path.name, ""), []).append(fault)
    return [_of_several(first, len(more)) if more else first for first, *more in alike.values()]


def _of_several(fault: str, more: int) -> str:
    """Return a fault with the number of further files that have it, before its advice."""
    so = f" (and so in {counted(more, 'more file')})"
    if isinstance(fault, Advised):
        return Advised(f"{fault.fault.rstrip(';')}{so};", *fault.advice)
    return f"{fault}{so}"


def listed(entries: Sequence[FilesEntry], folder: Path) -> tuple[Listed, ...]:
    """List the files of every entry, sorted by path.

    Parameters
    ----------
    entries : `rig.files` of the config
    folder : the config's folder, which relative paths start from

    Raises
    ------
    ConfigError : when a path matches no file, or two entries read the same of a file
    """
    found: list[Listed] = []
    faults: list[str] = []
    for number, entry in enumerate(entries):
        place = f"rig.files.{number}"
        paths = matching(folder, entry.path)
        found += [Listed(path, entry, number) for path in paths]
        if not paths and (folder / entry.path).is_dir():
            faults.append(f"{place}.path: {no_file(folder / entry.path, entry.path)} (got {entry.path!r})")
        elif not paths:
            hint = f"; {entry.source}" if entry.source else "; the path is relative to the config's folder"
            faults.append(f"{place}.path: no such file under {folder}{hint} (got {entry.path!r})")
    faults += _conflicts(found)
    if faults:
        raise ConfigError(faults)
    return tuple(sorted(found, key=lambda one: (one.path.as_posix(), one.number)))


def _conflicts(found: Sequence[Listed]) -> list[str]:
    """Describe pairs of entries that read the same of a file; each may take other tables, columns or tests."""
    first: dict[tuple[Path, str], Listed] = {}
    pairs: dict[tuple[int, int], list[tuple[Listed, Listed]]] = {}
    for one in found:
        way = one.entry.model_dump_json(include={"layout", "columns", "table", "split"})
        before = first.setdefault((one.path.resolve(), way), one)
        if before is not one:
            pairs.setdefault((before.number, one.number), []).append((before, one))
    faults: list[str] = []
    for same in pairs.values():
        earlier, later = same[0]
        more = f" and {len(same) - 1} more" if len(same) > 1 else ""
        settings = [one.entry.setting for one in same[0]]
        named = f", as setting {' and '.join(setting or 'without a name' for setting in settings)}"
        faults.append(
            f"rig.files.{later.number}.path: reads {later.path.name}{more}, which rig.files.{earlier.number} reads too"
            f"{named if settings[0] != settings[1] else ''}; each test belongs to one entry: narrow one of the paths "
            f"(got {earlier.entry.path!r} and {later.entry.path!r})"
        )
    return faults


# --- Records, and their names ---


def preflight_record(
    name: str, test: RawRecord, alone: DamperAlone, limits: Limits, control: Control
) -> PreflightRecord:
    """Make the record of a test, with velocity and acceleration recorded or derived.

    Parameters
    ----------
    name : of the record
    test : as the rig measured it
    alone : displacement and force of the damper alone
    limits : of the stand
    control : the control signal
    """
    time = test.channels[TIME]
    periodic = cycles(time, alone.displacement)
    clean = kinematics(time, alone.displacement, periodic)
    # A velocity recorded on the frame's side is not the damper's: it is derived anew.
    recorded = test.channels if alone.displacement_measured else {}
    record = Record(
        name,
        test.setting,
        time,
        alone.displacement,
        recorded.get(VELOCITY, clean.velocity),
        recorded.get(ACCELERATION, clean.acceleration),
        alone.force,
        *(test.channels.get(quantity) for quantity in (VOLTAGE, TEMPERATURE, PRESSURE)),
    )
    steps = test.steps
    if alone.removed:
        steps = (*steps, ReadingStep("fixture", None, alone.removed, "taken out"))
    ingested = tuple(
        IngestRow(record=name, file=test.sheet.path.name, step=s.step, quantity=s.quantity, was=s.was, became=s.became)
        for s in steps
    )
    examined = PreflightRecord(record, periodic, clean, limits, alone.removed or None, control, test.remarks, ingested)
    at_odds = tuple(recorded_velocity(examined))
    if not at_odds:
        return examined
    left_out = IngestRow(
        record=name,
        file=test.sheet.path.name,
        step="left out",
        quantity=VELOCITY.name,
        was="at odds with the displacement",
        became="derived",
    )
    return replace(
        examined,
        record=replace(record, velocity=clean.velocity),
        remarks=(*test.remarks, *at_odds),
        ingested=(*ingested, left_out),
    )


def names(tests: Sequence[tuple[Path, int | None]]) -> tuple[str, ...]:
    """Name every record by its file and the number of the test in it.

    Parameters
    ----------
    tests : file, and number of the test in it (None where the file holds one)

    Returns
    -------
    the file's stem; where stems are equal with as many folders in front as tell them apart; then -1, -2

    Raises
    ------
    ConfigError : when two records would have one name
    """
    files = list(dict.fromkeys(path for path, _ in tests))
    by_stem: dict[str, list[Path]] = {}
    for path in files:
        by_stem.setdefault(safe_name(path.stem), []).append(path)
    of_files = {path: name for same in by_stem.values() for path, name in zip(same, _apart(same), strict=True)}
    called: list[str] = []
    first: dict[str, Path] = {}
    faults: list[str] = []
    for path, number in tests:
        name = of_files[path] if number is None else f"{of_files[path]}-{number}"
        called.append(name)
        if name in first:
            faults.append(f"rig.files: two records would be called {name}: {first[name]} and {path}; rename one")
        first.setdefault(name, path)
    if faults:
        raise ConfigError(faults)
    return tuple(called)


def _apart(paths: Sequence[Path]) -> list[str]:
    """Return names of files of one stem, with the fewest folders in front that tell them apart."""
    found = [safe_name(path.stem) for path in paths]
    for folders in range(1, max(len(path.resolve().parts) for path in paths)):
        if len({*found}) == len(paths):
            break
        found = [safe_name("-".join((*path.resolve().parts[-1 - folders : -1], path.stem))) for path in paths]
    return found


# --- Rounded time stamps of a regular clock ---
#
# At 512 Hz and stamps of 1 ms the steps are 1 and 2 ms; a speed derived over them would be wrong by as much.

FEWEST = 50
"""Fewer samples do not tell a rounded clock from one that wavers."""
FEWEST_OF_EACH = 10
"""Rounding makes two steps of one, multiples of the resolution that are neighbours, each so often at least.

Reason: a sample that was lost is a step of two as well, and evenly spaced only by chance from some of them on."""
ROUNDED_BY = 0.75
"""Of the resolution, how far a stamp may lie from the line through all.

Reason: rounding moves it by half the resolution to either side, and the line itself is found from rounded stamps."""
SAME_STEP = 1e-3
"""Steps that differ by less than this share of the usual one are the same, written with many digits."""


def on_regular_clock(test: RawRecord) -> RawRecord:
    """Put the samples of a test at the instants of its regular clock, where its time stamps are rounded.

    Parameters
    ----------
    test : time strictly increasing

    Returns
    -------
    the test as it is where its clock shows no rounding
    """
    time = test.channels[TIME]
    unrounded = _unrounded(time)
    if unrounded is None:
        return test
    regular, resolution = unrounded
    rate = (time.size - 1) / (regular[-1] - regular[0])
    step = ReadingStep("clock", TIME.name, f"stamps rounded to {resolution:.3g} s", f"a regular clock of {rate:.6g} Hz")
    return replace(test, channels={**test.channels, TIME: regular}, steps=(*test.steps, step))


def _unrounded(time: Array) -> tuple[Array, float] | None:
    """Fit a regular clock to its stamps: its instants (n,) [s] and its resolution [s]; None where none is rounded.

    Equation: t_i = t_0 + i/f, least squares over all stamps
    """
    if time.size < FEWEST:
        return None
    steps = np.sort(np.diff(time))
    usual = float(steps[steps.size // 2])
    groups = np.split(steps, np.flatnonzero(np.diff(steps) > SAME_STEP * usual) + 1)
    shorter, longer = groups[0], groups[-1]
    if len(groups) != 2 or min(shorter.size, longer.size) < FEWEST_OF_EACH:
        return None
    resolution = float(longer.mean() - shorter.mean())
    order = np.arange(time.size)
    slope, begin = np.polyfit(order, time, 1)
    regular: Array = begin + slope * order
    if np.max(np.abs(time - regular)) > ROUNDED_BY * resolution:
        return None
    return regular, resolution


# --- All files ---


BYTES_WORTH_A_PROCESS = 2_000_000
"""Bytes of files from which they are read by several processes: half a second's work, and a process takes a tenth."""


def read(
    entries: Sequence[FilesEntry], limits: Limits, control: Control, folder: Path, jobs: int = 1
) -> tuple[Callable[[], PreflightRecord], ...]:
    """Read every test of every file.

    Parameters
    ----------
    entries : `rig.files` of the config
    limits : of the stand
    control : the control signal
    folder : the config's folder, which relative paths start from
    jobs : files read at the same time, where they are worth it

    Returns
    -------
    functions that make the record of each test, in any order

    Raises
    ------
    ConfigError : when the config does not describe the files; every fault is listed
    DataError : when a file cannot be used; every such file is listed
    FilesError : when a file cannot be read
    """
    files = listed(entries, folder)
    described = layouts(entries, control, folder)
    tests: list[tuple[RawRecord, DamperAlone]] = []
    layout_of: dict[Path, Layout] = {}
    config_faults: list[tuple[Path, str]] = []
    data_faults: list[tuple[Path, str]] = []

    def read_one(file: Listed) -> tuple[Layout | None, list[tuple[RawRecord, DamperAlone]]] | ConfigError | DataError:
        layout = described[file.number]
        try:
            with one_record():
                used, found = _read_file(file.path, layout, folder)
        except (ConfigError, DataError) as error:
            return error
        return (None if used is layout else used), found  # one layout for all its files, wherever they were read

    # What a second logger adds to a layout is told apart by its identity, which another process has not.
    alone = any(entry.beside is not None for entry in entries)
    worth = sum(file.path.stat().st_size for file in files) > BYTES_WORTH_A_PROCESS
    store = OnDisk()
    for file, made in zip(files, parallel_each(read_one, files, jobs if worth and not alone else 1), strict=True):
        if isinstance(made, ConfigError):
            config_faults += [(file.path, fault) for fault in made.messages]
        elif isinstance(made, DataError):
            data_faults += [(file.path, fault) for fault in made.messages]
        else:
            layout_of[file.path] = made[0] or described[file.number]
            tests += [(store.kept(test), store.kept(alone)) for test, alone in made[1]]
    end_child()
    if config_faults:
        raise ConfigError(_said_once(dict.fromkeys(config_faults)))
    by_work: dict[bool, list[tuple[RawRecord, DamperAlone]]] = {False: [], True: []}
    for both in one_at_a_time(tests):
        by_work[works_on_the_rig(both[1])].append(both)
    wrong_signs = sign_faults(by_work[True], layout_of, by_work[False])
    if data_faults or wrong_signs:
        raise DataError([*_said_once(data_faults), *wrong_signs])
    called = names([(test.sheet.path, test.number) for test, _ in tests])
    told = with_copies_told([(name, *both) for name, both in zip(called, tests, strict=True)])
    return tuple(partial(preflight_record, name, test, alone, limits, control) for name, test, alone in told)


# --- Copies ---

Named = tuple[str, RawRecord, DamperAlone]


def with_copies_told(tests: Sequence[Named]) -> list[Named]:
    """Report tests whose every sample is that of another of the same label, on the first of them.

    Parameters
    ----------
    tests : each with its name

    Returns
    -------
    the tests; identification and diagnosis count copies once
    """
    alike: dict[bytes, list[Named]] = {}
    digests = [_digest(*one[1:]) for one in one_at_a_time(tests)]
    for one, digest in zip(tests, digests, strict=True):
        alike.setdefault(digest, []).append(one)
    found: list[Named] = []
    for (name, test, alone), digest in one_at_a_time(zip(tests, digests, strict=True)):
        same = [mate[0] for mate in alike[digest] if len(alike[digest]) > 1 and _label(mate[1]) == _label(test)]
        told = test.remarks
        if len(same) > 1 and name == same[0]:
            finding = Finding(
                check="copies",
                where="the whole record",
                size=float(len(same)),
                unit="records",
                follows=f"{', '.join(same[1:])}: copies of it, sample by sample; they count once",
            )
            told = (*told, finding)
        found.append((name, replace(test, remarks=told), alone))
    return found


def _digest(test: RawRecord, alone: DamperAlone) -> bytes:
    """Return a digest of force and motion, as far as it was recorded."""
    moved = [test.channels[quantity] for quantity in (VELOCITY, ACCELERATION) if quantity in test.channels]
    samples = hashlib.sha256()
    for values in (alone.displacement, alone.force, *moved):
        samples.update(np.ascontiguousarray(values).tobytes())
    return samples.digest()


def _label(test: RawRecord) -> tuple[str | None, tuple[float, ...]]:
    """Return the setting and the medians of the control signal and the temperature; -273.15 where there is none.

    Reason: labels are compared, and NaN does not equal itself; no test is run at absolute zero, nor with a control
    signal set to that number.
    """
    channels = (test.channels.get(quantity) for quantity in (VOLTAGE, TEMPERATURE))
    return test.setting, tuple(-273.15 if values is None else float(np.median(values)) for values in channels)


def _read_file(path: Path, layout: Layout, folder: Path) -> tuple[Layout, list[tuple[RawRecord, DamperAlone]]]:
    """Read the tests of one file, with displacement and force of the damper alone in each, and the layout they have."""
    values, setting = layout.values(path)
    beside = layout.entry.beside
    if beside is None:
        sheet = read_sheet(path, layout.entry, layout.wanted(), layout.place)
    else:
        from pzd.rig.files.two_loggers import with_other_logger

        placed = beside.model_copy(update={"path": str(folder / beside.path)})
        sheet, layout = with_other_logger(path, layout, placed)
    if layout.entry.preamble is not None:
        more, named = layout.values_above(lines_above(path, layout.entry, sheet, layout.place), path)
        values, setting = values | more, named or setting
    return layout, _tests_of(sheet, layout, values, setting)


def _tests_of(sheet: Sheet, layout: Layout, values: Values, setting: str | None) -> list[tuple[RawRecord, DamperAlone]]:
    """Cut a sheet into tests, with displacement and force of the damper alone in each."""
    entry = layout.entry
    by_rate = beside_counted(sheet, layout)
    tests = split_into_tests(channels(sheet, layout), sheet, layout, values, setting)
    refuse(tests, layout)
    found = []
    bare = replace(sheet, numbers={}, texts={})  # the channels are made of them
    for asked in tests:
        remarks = (*asked.remarks, *by_rate, *clock_remarks(asked, layout))
        test = on_regular_clock(replace(asked, sheet=bare, remarks=remarks))
        time, displacement, force = (test.channels[quantity] for quantity in (TIME, DISPLACEMENT, FORCE))
        alone = without_fixture(entry.fixture or Fixture(), time, displacement, force, test.force_sign)
        found.append((test, alone))
    return found


# --- Arrays ---


def from_arrays(
    name: str,
    channels: Mapping[Quantity, Array | float],
    setting: str | None,
    limits: Limits,
    control: Control,
) -> PreflightRecord:
    """Make the record of one test that is given as arrays, on the way of a file with canonical columns.

    Parameters
    ----------
    name : of the record
    channels : (n,) each, in SI and degC; a label such as the control signal may be one number
    setting : of the damper
    limits : of the stand
    control : the control signal

    Raises
    ------
    DataError : when the test cannot be used
    """
    (layout,) = layouts((FilesEntry(path=name),), control, Path())
    columns = {quantity: values for quantity, values in channels.items() if isinstance(values, np.ndarray)}
    labels: Values = {q: (float(value),) for q, value in channels.items() if not isinstance(value, np.ndarray)}
    sheet = Sheet(
        path=Path(name),
        header=tuple(control.renamed(quantity.column) for quantity in columns),
        header_line=None,
        units=None,
        rows=columns[TIME].size,
        numbers=dict(enumerate(columns.values())),
    )
    ((test, alone),) = _tests_of(sheet, layout, labels, setting)
    if works_on_the_rig(alone):
        raise DataError(sign_faults([(test, alone)], {test.sheet.path: layout}, ()))
    return preflight_record(name, test, alone, limits, control)
