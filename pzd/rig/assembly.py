"""Tests into records with all their channels, and records into the artefact with its findings."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from pzd.artefacts import RecordEntry, Rig
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
)
from pzd.record import Record
from pzd.rig.config import FilesEntry, Limits
from pzd.rig.files.channels import check_keys
from pzd.rig.files.fixture import Freed, free
from pzd.rig.files.listing import Listed, listed, names
from pzd.rig.files.reading import Test, read
from pzd.rig.files.refusals import faults, reversals, sign_faults
from pzd.rig.measured import Measured
from pzd.rig.preflight import findings
from pzd.rig.stand.config import Planned
from pzd.rig.stand.recording import Taken, record_of
from pzd.schema.errors import ConfigError, DataError
from pzd.schema.processes import parallel_map
from pzd.signals.cycles import cycles
from pzd.signals.kinematics import kinematics


def measured(entries: Sequence[FilesEntry], limits: Limits, control: Control, folder: Path, jobs: int = 1) -> Rig:
    """The artefact: every test of every file as a record, so many at the same time, and an entry with its findings.

    Raises
    ------
    ConfigError : when the config does not describe the files; every fault is listed
    DataError : when a file cannot be believed; every such file is listed
    """
    files = listed(entries, folder)
    for number, entry in enumerate(entries):
        check_keys(entry, f"rig.files.{number}", control)
    tests = _read_all(files, control)
    called = names([(test.path, test.number) for test, _ in tests])
    return overview([partial(_measured, name, *of, limits) for name, of in zip(called, tests, strict=True)], jobs)


def _read_all(files: Sequence[Listed], control: Control) -> list[tuple[Test, Freed]]:
    tests: list[tuple[Test, Freed]] = []
    config_faults: list[str] = []
    data_faults: list[str] = []
    for file in files:
        try:
            tests += [(test, _believed(test, file.entry)) for test in read(file, control)]
        except ConfigError as error:
            config_faults += error.messages
        except DataError as error:
            data_faults += error.messages
    if config_faults:
        raise ConfigError(dict.fromkeys(config_faults))
    if data_faults:
        raise DataError(data_faults)
    return tests


def _believed(test: Test, entry: FilesEntry) -> Freed:
    """The damper's own displacement and force, of a test that can be believed."""
    wrong = faults(test)
    if wrong:
        raise DataError(wrong)
    x, force = test.channels[DISPLACEMENT], test.channels[FORCE]
    freed = Freed(x, force, "") if entry.fixture is None else free(entry.fixture, test.channels[TIME], x, force)
    wrong = sign_faults(test, freed.displacement, freed.force)
    if wrong:
        raise DataError(wrong)
    return freed


def _measured(name: str, test: Test, freed: Freed, limits: Limits) -> Measured:
    """The record with velocity and acceleration, recorded or derived."""
    time = test.channels[TIME]
    run = cycles(time, freed.displacement)
    clean = kinematics(time, freed.displacement, run)
    # A velocity recorded on the frame's side is not the damper's: it is derived anew.
    recorded = test.channels if freed.displacement is test.channels[DISPLACEMENT] else {}
    record = Record(
        name,
        test.setting,
        time,
        freed.displacement,
        recorded.get(VELOCITY, clean.velocity),
        recorded.get(ACCELERATION, clean.acceleration),
        freed.force,
        *(test.channels.get(quantity) for quantity in (VOLTAGE, TEMPERATURE, PRESSURE)),
    )
    return Measured(record, run, clean, limits, freed.said or None)


def made(take: Callable[[Planned], Taken], planned: Planned, limits: Limits) -> Measured:
    """A record of the virtual stand, with its cycles and clean motion."""
    taken = take(planned)
    run = cycles(taken.time, taken.displacement)
    clean = kinematics(taken.time, taken.displacement, run)
    return Measured(record_of(taken, clean), run, clean, limits)


def overview(tests: Sequence[Callable[[], Measured]], jobs: int) -> Rig:
    """The artefact: the records, and an entry with the findings of each.

    Parameters
    ----------
    tests : what gives them
    jobs : tests worked on at the same time
    """

    def listed(given: Callable[[], Measured]) -> tuple[Record, RecordEntry]:
        test = given()
        return test.record, _entry(test)

    found = parallel_map(listed, tests, jobs)
    return Rig(tuple(record for record, _ in found), tuple(entry for _, entry in found))


def _entry(test: Measured) -> RecordEntry:
    record = test.record
    return RecordEntry(
        name=record.name,
        setting=record.setting,
        voltage_V=record.median_voltage(),
        temperature_degC=record.median_temperature(),
        rate_Hz=record.rate,
        cycles=float(test.run.count) if test.run else 0.5 * reversals(record.displacement),
        findings=findings(test),
        removed=test.removed,
    )
