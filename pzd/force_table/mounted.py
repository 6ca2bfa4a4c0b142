"""The stage table without a rig: dampers of measured curves, and those that other runs found, at either axle."""

from __future__ import annotations

import hashlib
import logging
from pathlib import Path

from pzd.artefacts import Diagnosed, Manifest, MountedDamper, MountedDampers, MountedNotes, Table
from pzd.artefacts.mounted import NOTES
from pzd.force_table.config import DamperConfig, OneDamper, TableConfig
from pzd.quantities import Control
from pzd.rig.config import ControlConfig
from pzd.schema.errors import ConfigError
from pzd.schema.validate import read_json
from pzd.schema.yamlfile import read_yaml

log = logging.getLogger(__name__)

_CONFIG, _MANIFEST, _LAW = "config.yaml", "manifest.json", "damper.yaml"
"""Files of a run."""


def tabulate_mounted(table: TableConfig, damper: DamperConfig, control: Control, folder: Path) -> MountedDampers:
    """Tabulate the force of the dampers that the config names, of one or of each axle.

    Parameters
    ----------
    table : the config's block; the table of a run is taken as it stands
    damper : the config's block
    control : the control signal
    folder : of the config, from which paths count

    Raises
    ------
    ConfigError : when a file or run is not there, something is left open, or the axles do not go together
    DataError : when a file is no curve, or one of a run is at fault
    """
    if table.settings is not None:
        raise ConfigError("table.settings: a damper without a rig has no settings to interpolate; take this key away")
    axles: list[MountedDamper] = []
    faults: list[str] = []
    for place, one in damper.axles():
        try:
            mounted = _of_run(one, place, control, folder) if one.run else _of_curve(table, one, place, control, folder)
        except ConfigError as error:
            faults += error.messages
            continue
        axles.append(mounted)
        for line in (mounted.notes.source, *mounted.notes.read):
            log.info("%s: %s", place, line)
    if faults:
        raise ConfigError(faults)
    made = MountedDampers(tuple(axles))
    if len({axle.table.force[0].voltage_V is None for axle in axles}) > 1:
        raise ConfigError(
            f"damper: that of one axle has a {control.name}, and that of the other has none; give it curves for two "
            f"values of the {control.name}, which may be the same"
        )
    return made


def _of_curve(table: TableConfig, asked: OneDamper, place: str, control: Control, folder: Path) -> MountedDamper:
    from pzd.force_table.curve_file import read_curve
    from pzd.force_table.measured_curve import table_of_curve

    found = read_curve(asked, place, control, folder)
    low, high = found.curve.velocity[[0, -1]]
    read = (*found.steps, f"{found.curve.velocity.size} points, {low:.4g} to {high:.4g} m/s, rebound positive")
    return MountedDamper(table_of_curve(table, found.curve), MountedNotes(source=asked.curve or "", read=read), None)


def _of_run(asked: OneDamper, place: str, control: Control, folder: Path) -> MountedDamper:
    """Take damper and table of a run as they stand there; of a run without a rig those of axle 1."""
    run = folder / (asked.run or "")
    if not (run / Table.folder / _MANIFEST).is_file():
        raise ConfigError(
            f"{place}.run: no run with a table is there; give its folder relative to the config's, such as "
            f"../runs/front, or make it with pzd table (got {asked.run!r})"
        )
    theirs = read_yaml(run / _CONFIG).data.get("control", {})
    signal = ControlConfig(**theirs).signal()
    if signal != control:
        raise ConfigError(
            f"{place}.run: its control signal is {signal.name} in {signal.unit}; say control: {{name: {signal.name}, "
            f"unit: {signal.unit}}} at the top (got {control.name} in {control.unit})"
        )
    manifest = read_json(run / Table.folder / _MANIFEST, Manifest, Control())
    marks = (*manifest.marks, *_edited(run / Table.folder, manifest))
    law = run / Diagnosed.folder
    diagnosed = (law / _MANIFEST).is_file() and not (run / Table.folder / NOTES).is_file()
    if diagnosed and manifest.inputs.get(f"{law.name}/{_LAW}") != _digest(law / _LAW):
        raise ConfigError(
            f"{place}.run: its damper is not the one that its table was made of; run pzd table "
            f"{Path(manifest.config).name} there, then this again (got {asked.run!r})"
        )
    damper = Diagnosed.read(law, control).damper if diagnosed else None
    notes = MountedNotes(source=asked.run or "", read=("damper and table as they stand in this run",), marks=marks)
    return MountedDamper(Table.read(run / Table.folder, control), notes, damper)


def _digest(file: Path) -> str:
    return hashlib.sha256(file.read_bytes()).hexdigest()


def _edited(folder: Path, manifest: Manifest) -> tuple[str, ...]:
    """Return a mark where files of a table are not as they were written: its law, where it has one, is another then."""
    files = {name: folder / name for name in manifest.outputs if (folder / name).is_file()}
    edited = [f"{folder.name}/{name}" for name, path in files.items() if _digest(path) != manifest.outputs[name]]
    return (f"{', '.join(edited)} edited by hand",) if edited else ()
