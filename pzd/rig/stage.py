"""The rig stage: records in SI from measured files or a virtual stand, with the findings of the preflight."""

from __future__ import annotations

import logging
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from pzd.artefacts import Rig
from pzd.quantities import Control
from pzd.rig.config import RigConfig
from pzd.schema.errors import ConfigError

if TYPE_CHECKING:
    from pzd.rig.stand.config import PlannedRecord

log = logging.getLogger(__name__)


def ingest(rig: RigConfig, control: Control, folder: Path, jobs: int = 1, preflight: bool = True) -> Rig:
    """Read the measured files that the config names.

    Parameters
    ----------
    rig : the config's `rig` block, with `files`
    control : the control signal
    folder : the config's folder, which relative paths start from
    jobs : tests worked on at the same time
    preflight : whether the records are examined, which changes nothing about them

    Raises
    ------
    ConfigError : when the config does not describe the files
    DataError : when a file cannot be used; every such file is listed
    FilesError : when a file cannot be read
    """
    from pzd.rig.files.reading import read
    from pzd.rig.preflight import examined

    if rig.files is None:
        raise ConfigError("rig: this config has a virtual stand and no files; use synthesise (got rig.virtual)")
    found = examined(read(rig.files, rig.limits, control, folder, jobs), jobs, preflight)
    log.info("read %d tests", len(found.records))
    return found


def synthesise(rig: RigConfig, seed: int, control: Control, folder: Path, jobs: int = 1, preflight: bool = True) -> Rig:
    """Test the virtual dampers that the config names.

    Parameters
    ----------
    rig : the config's `rig` block, with `virtual`
    seed : seed of every draw
    control : the control signal, whose unit stands in the names of the records
    folder : the config's folder, for motions that are read from a file
    jobs : records taken at the same time
    preflight : whether the records are examined, which changes nothing about them

    Raises
    ------
    ConfigError : when the config has measured files instead, or two records would have one name
    """
    from pzd.rig.preflight import PreflightRecord, examined
    from pzd.rig.stand.recording import StandRecord, recorder
    from pzd.signals.cycles import cycles
    from pzd.signals.kinematics import kinematics

    if rig.virtual is None:
        raise ConfigError("rig: this config has measured files and no virtual stand; use ingest (got rig.files)")

    def tested(record_one: Callable[[PlannedRecord], StandRecord], planned: PlannedRecord) -> PreflightRecord:
        raw = record_one(planned)
        periodic = cycles(raw.time, raw.displacement)
        clean = kinematics(raw.time, raw.displacement, periodic)
        return PreflightRecord(raw.as_record(clean), periodic, clean, rig.limits, control=control)

    recorders = [(entry, recorder(entry, seed, folder)) for entry in rig.virtual]
    tests = [partial(tested, record_one, planned) for entry, record_one in recorders for planned in entry.plan(control)]
    log.info("taking %d records", len(tests))
    return examined(tests, jobs, preflight)
