"""The damper of a run written for other tools: only where its results are those of the config as it is today."""

from __future__ import annotations

import logging
import re
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from pzd.artefacts import Diagnosed, Identified, MountedDampers, Rig, Table, damper_without_force
from pzd.export.content import WRITTEN_BY_PZD, Content
from pzd.export.drive import Drive, drive, plan_of
from pzd.export.formats import Files, Format, format_of, formats
from pzd.export.formats.drive import NAME as DRIVE
from pzd.pipeline.command import Opened, stale_stages
from pzd.record import Record
from pzd.rig.config import Limits
from pzd.runs.disk import as_files_error, refuse_links, versions, write_afresh
from pzd.schema.errors import ConfigError, FilesError

log = logging.getLogger(__name__)

FOLDER = "export"
"""Where the files stand by default, in the folder of the run."""
LAST = "table"
"""The last stage whose results are exported."""
_BEHIND = ("simulate", "report")
"""Stages whose results are not."""


@dataclass(frozen=True)
class Exported:
    """What was written."""

    files: tuple[Path, ...]
    marks: tuple[str, ...]
    """Why the damper is not to be trusted, a line a reason."""


def exported(
    given: Opened, to: str, out: Path | None, remedy: str, certify: bool = False, waveform: str | None = None
) -> Exported:
    """Write the damper of a run in one format.

    Parameters
    ----------
    given : config and run
    to : name of the format
    out : folder of the files; None for `FOLDER` in the folder of the run
    remedy : the command that brings the run up to date, as far as `LAST`
    certify : whether what is exported is run beside pzd on the records of the run, and the certificate goes with it
    waveform : that drives the stand, a block in YAML; None for the test that diagnose asks for next

    Returns
    -------
    the files that were written, and why their numbers are not to be trusted

    Raises
    ------
    ConfigError : when there is no such format, it cannot hold this damper, or the run is not there or stale
    DataError : when a file of the run is at fault
    FilesError : when the disk does not take the files, or one stands there that is not from an export
    """
    wanted = format_of(to)
    _check_fresh(given, remedy)
    contents = (content_of(given),) if given.config.damper is None else _mounted_contents(given)
    edited = list(dict.fromkeys(name for content in contents for name in content.edited))
    if edited:
        log.warning("%s: edited by hand: %s; exported as it is", given.run.folder, ", ".join(edited))
    if wanted.dynamics and any(content.by_curve for content in contents):
        adjustable = all(content.adjustable for content in contents)
        forms = [
            f.name for f in formats().values() if not f.dynamics and f.name != DRIVE and f.adjustable <= adjustable
        ]
        raise ConfigError(
            f"--to {to}: it holds the dynamics of a damper, and a measured curve has none; choose a form of its table, "
            f"{', '.join(forms)}"
        )
    if wanted.name == DRIVE:
        contents = tuple(replace(one, drive=_drive(given, one, waveform)) for one in contents)
    elif waveform is not None:
        raise ConfigError(f"--waveform: is what drives the stand, with --to {DRIVE} (got --to {to})")
    with given.placed():
        files = _written(given, wanted, contents, certify)
    folder = out or given.run.folder / FOLDER
    with as_files_error(folder):
        if out is None:
            refuse_links((given.run.folder, folder))
        else:  # that of the run is pzd's own
            _check_own(folder / name for name in files)
        folder.mkdir(parents=True, exist_ok=True)
        for name, data in files.items():
            fresh = folder / f".{name}.new"
            write_afresh(fresh, data)
            fresh.replace(folder / name)
        for path in _outdated(folder, wanted, given.run.config, files):
            path.unlink()
            log.info("%s: removed, as the damper of %s has no such part any more", path, given.run.config.name)
    marks = dict.fromkeys(mark for content in contents for mark in content.marks)
    return Exported(tuple(folder / name for name in files), tuple(marks))


def _written(given: Opened, wanted: Format, contents: Sequence[Content], certify: bool) -> Files:
    """Return the files of every damper of a run.

    Raises
    ------
    ConfigError : when two of them would write one file
    """
    found: dict[str, bytes] = {}
    for content in contents:
        files = _certified(given, wanted, content) if certify else wanted.files(content)
        if twice := sorted(found.keys() & files.keys()):
            raise ConfigError(
                f"--to {wanted.name}: both dampers of the config would write {twice[0]}; export each from a config of "
                "its own"
            )
        found |= files
    return found


def _records(given: Opened, content: Content) -> list[Record]:
    """Return the records of the damper's setting.

    Raises
    ------
    ConfigError : when the config has no rig
    """
    if given.config.rig is None:
        raise ConfigError(f"{given.run.config}: has no rig, so that there are no records and no stand to drive")
    return [record for record in given.run.read(Rig).records if content.setting in (None, record.setting)]


def _drive(given: Opened, content: Content, waveform: str | None) -> Drive:
    """Return the history that drives the stand."""
    records, rig = _records(given, content), given.config.rig
    found, folder = given.run.read(Diagnosed).diagnosis.next_test, given.run.config.parent
    return drive(plan_of(found, waveform, records, rig.limits if rig else Limits(), content.damper, folder))


def _certified(given: Opened, wanted: Format, content: Content) -> Files:
    """Return the files of a format with the certificate, on the records of the damper's setting."""
    if wanted.certified is None:
        able = ", ".join(one.name for one in formats().values() if one.certified)
        raise ConfigError(f"--certify: runs a form that has dynamics: --to {able} (got {wanted.name})")
    return wanted.certified(content, _records(given, content), versions())


def _outdated(folder: Path, wanted: Format, config: Path, files: Collection[str]) -> list[Path]:
    """Return files that an earlier export of this config in this form left and the new one does not write."""
    if wanted.ending is None:
        return []
    ours = re.compile(WRITTEN_BY_PZD.pattern + re.escape(config.name.encode()) + rb"(?![\w.-])")
    left = [path for path in sorted(folder.glob(f"*{wanted.ending}")) if path.name not in files]
    return [path for path in left if path.name.startswith(config.stem) and ours.search(path.read_bytes())]


def _check_own(files: Iterable[Path]) -> None:
    """Refuse to write over what is not from an export."""
    foreign = [path for path in files if path.is_file() and not WRITTEN_BY_PZD.search(path.read_bytes())]
    if foreign:
        raise FilesError(
            f"{path}: pzd export did not write this; move it away, or choose another folder by --out"
            for path in foreign
        )


def content_of(given: Opened) -> Content:
    """Return what there is to export of a run.

    Raises
    ------
    DataError : when a file of the run is at fault
    """
    simulate = given.config.simulate
    stages = {kind: given.run.stage_folder(kind.folder) for kind in (Identified, Diagnosed, Table)}
    return Content(
        name=given.run.config.stem,
        version=versions()["pzd"],
        config=given.run.config.name,
        control=given.run.control,
        damper=given.run.read(Diagnosed).damper,
        table=given.run.read(Table),
        force_levels=given.config.table.force_levels,
        car=simulate.car.car(),
        tie_break=simulate.tie_break,
        setting=given.config.setting,
        edited=tuple(f"{kind.folder}/{name}" for kind in (Diagnosed, Table) for name in stages[kind].edited),
        marks=tuple(
            dict.fromkeys(mark for stage in stages.values() if stage.manifest for mark in stage.manifest.marks)
        ),
    )


def _mounted_contents(given: Opened) -> tuple[Content, ...]:
    """Return what there is to export of dampers that are known without a rig, called after their axles.

    Raises
    ------
    DataError : when a file of the run is at fault
    """
    stage, simulate = given.run.stage_folder(MountedDampers.folder), given.config.simulate
    return tuple(
        Content(
            name="-".join(filter(None, (given.run.config.stem, name))),
            version=versions()["pzd"],
            config=given.run.config.name,
            control=given.run.control,
            damper=axle.damper or damper_without_force(axle.table),
            table=axle.table,
            force_levels=given.config.table.force_levels,
            car=simulate.car.car(),
            tie_break=simulate.tie_break,
            edited=tuple(f"{MountedDampers.folder}/{name}" for name in stage.edited),
            marks=stage.manifest.marks if stage.manifest else (),
            by_curve=axle.damper is None,
        )
        for name, axle in given.run.read(MountedDampers).named_axles
    )


def _check_fresh(given: Opened, remedy: str) -> None:
    for kind in (Diagnosed, Table) if given.config.damper is None else (MountedDampers,):
        if given.run.stage_folder(kind.folder).manifest is None:
            raise ConfigError(f"{given.run.folder / kind.folder}: there is no result to export yet; {remedy} makes it")
    for stage, reason in stale_stages(given).items():
        if stage not in _BEHIND:
            raise ConfigError(f"{given.run.folder}: {stage} is stale: {reason}; {remedy} brings it up to date")
