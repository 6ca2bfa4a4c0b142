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


def synthesise(rig: RigConfig, seed: int) -> Rig:
    """Test the virtual dampers that the config names.

    Parameters
    ----------
    rig : the config's `rig` block, with `virtual`
    seed : seed of every draw

    Raises
    ------
    ConfigError : when the config has measured files instead
    """
    from pzd.rig.assembly import made, overview
    from pzd.rig.stand import records

    if rig.virtual is None:
        raise ConfigError("rig: this config has measured files and no virtual stand; use ingest (got rig.files)")
    tested = [record for number, entry in enumerate(rig.virtual) for record in records(entry, [seed, number])]
    log.info("tested %d records", len(tested))
    return overview([made(record, rig.limits) for record in tested])
