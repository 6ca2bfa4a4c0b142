"""Accepted tests as records with all their channels, and the names of the records."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from pzd.artefacts import IngestRow
from pzd.quantities import ACCELERATION, PRESSURE, TEMPERATURE, TIME, VELOCITY, VOLTAGE, Control
from pzd.record import Record
from pzd.rig.config import Limits
from pzd.rig.files.fixture import Freed
from pzd.rig.files.sheet import ReadingStep
from pzd.rig.files.splitting import Test
from pzd.rig.preflight import Measured
from pzd.schema.errors import ConfigError
from pzd.schema.filename import safe_name
from pzd.signals.cycles import cycles
from pzd.signals.kinematics import kinematics


def measured(name: str, test: Test, freed: Freed, limits: Limits, control: Control) -> Measured:
    """The record of a test, with velocity and acceleration recorded or derived.

    Parameters
    ----------
    name : what the record is called
    test : the test as the rig measured it
    freed : displacement and force of the damper alone
    limits : what the stand can do
    control : the control signal
    """
    time = test.channels[TIME]
    run = cycles(time, freed.displacement)
    clean = kinematics(time, freed.displacement, run)
    # A velocity recorded on the frame's side is not the damper's: it is derived anew.
    recorded = test.channels if freed.on_the_damper else {}
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
    return Measured(record, run, clean, limits, freed.said or None, control, test.remarks, _ingested(name, test, freed))


def _ingested(name: str, test: Test, freed: Freed) -> tuple[IngestRow, ...]:
    """What was done to the file of a record, as rows of the ingest report."""
    steps = (*test.steps, *([ReadingStep("fixture", None, freed.said, "taken out")] if freed.said else []))
    return tuple(
        IngestRow(record=name, file=test.sheet.path.name, step=s.step, quantity=s.quantity, was=s.was, became=s.became)
        for s in steps
    )


def names(tests: Sequence[tuple[Path, int | None]]) -> tuple[str, ...]:
    """The name of every record, by the file and the number of the test in it.

    Parameters
    ----------
    tests : file, and number of the test in it (None where the file holds one)

    Returns
    -------
    the file's stem; with the parent folder in front where stems are equal; then -1, -2

    Raises
    ------
    ConfigError : when two records would have one name
    """
    files = list(dict.fromkeys(path for path, _ in tests))
    stems = Counter(safe_name(path.stem) for path in files)
    called = [_called(path, number, stems) for path, number in tests]
    first: dict[str, Path] = {}
    faults: list[str] = []
    for name, (path, _) in zip(called, tests, strict=True):
        if name in first:
            faults.append(f"rig.files: two records would be called {name}: {first[name]} and {path}; rename one")
        first.setdefault(name, path)
    if faults:
        raise ConfigError(faults)
    return tuple(called)


def _called(path: Path, number: int | None, stems: Counter[str]) -> str:
    stem = safe_name(path.stem)
    whole = stem if stems[stem] == 1 else safe_name(f"{path.resolve().parent.name}-{path.stem}")
    return whole if number is None else f"{whole}-{number}"
