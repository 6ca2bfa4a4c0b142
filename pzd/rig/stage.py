"""The rig stage: measured files or a virtual stand into records in SI, with what the preflight found."""

from __future__ import annotations

import logging
from pathlib import Path

from pzd.artefacts import Rig
from pzd.quantities import Control
from pzd.rig.config import RigConfig
from pzd.schema.errors import ConfigError

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


def synthesise(rig: RigConfig, seed: int, control: Control, folder: Path) -> Rig:
    """Test the virtual dampers that the config names.

    Parameters
    ----------
    rig : the config's `rig` block, with `virtual`
    seed : seed of every draw
    control : the control signal, whose unit stands in the names of the records
    folder : the config's folder, for motions that are read from a file

    Raises
    ------
    ConfigError : when the config has measured files instead, or two records would have one name
    """
    from pzd.rig.assembly import made, overview
    from pzd.rig.stand import take

    if rig.virtual is None:
        raise ConfigError("rig: this config has measured files and no virtual stand; use ingest (got rig.files)")
    tests = [made(taken, rig.limits) for entry in rig.virtual for taken in take(entry, seed, folder, control)]
    log.info("took %d records", len(tests))
    return overview(tests)
