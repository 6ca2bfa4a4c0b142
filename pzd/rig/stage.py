"""The rig stage: measured files or a virtual stand into records in SI, with what the preflight found."""

from __future__ import annotations

import logging
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from pzd.artefacts import RecordEntry, Rig
from pzd.quantities import Control
from pzd.record import Record
from pzd.rig.config import RigConfig
from pzd.schema.errors import ConfigError
from pzd.schema.processes import at_once

if TYPE_CHECKING:
    from pzd.rig.stand import Taken
    from pzd.rig.virtual_config import Planned

log = logging.getLogger(__name__)


def ingest(rig: RigConfig, control: Control, folder: Path) -> Rig:
    """Read the measured files that the config names.

    Parameters
    ----------
    rig : the config's `rig` block, with `files`
    control : the control signal
    folder : the config's folder, which relative paths start from

    Raises
    ------
    ConfigError : when the config does not describe the files
    DataError : when a file cannot be believed; every such file is listed
    FilesError : when a file cannot be read
    """
    from pzd.rig.assembly import measured, overview

    if rig.files is None:
        raise ConfigError("rig: this config has a virtual stand and no files; use synthesise (got rig.virtual)")
    tests = measured(rig.files, rig.limits, control, folder)
    log.info("read %d tests", len(tests))
    return overview(tests)


def synthesise(rig: RigConfig, seed: int, control: Control, folder: Path, jobs: int = 1) -> Rig:
    """Test the virtual dampers that the config names.

    Parameters
    ----------
    rig : the config's `rig` block, with `virtual`
    seed : seed of every draw
    control : the control signal, whose unit stands in the names of the records
    folder : the config's folder, for motions that are read from a file
    jobs : records taken at the same time

    Raises
    ------
    ConfigError : when the config has measured files instead, or two records would have one name
    """
    from pzd.rig.assembly import entry_of, made
    from pzd.rig.stand import taker

    if rig.virtual is None:
        raise ConfigError("rig: this config has measured files and no virtual stand; use ingest (got rig.files)")
    takers = [taker(entry, seed, folder) for entry in rig.virtual]
    planned = [(take, one) for take, entry in zip(takers, rig.virtual, strict=True) for one in entry.plan(control)]

    def tested(plan: tuple[Callable[[Planned], Taken], Planned]) -> tuple[Record, RecordEntry]:
        take, one = plan
        test = made(take(one), rig.limits)
        return test.record, entry_of(test)

    records, entries = zip(*at_once(tested, planned, jobs), strict=True)
    log.info("took %d records", len(records))
    return Rig(records, entries)
