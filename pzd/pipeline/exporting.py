"""The damper of a run written for other tools: only where its results are those of the config as it is today."""

from __future__ import annotations

import logging
import re
from collections.abc import Collection, Iterable
from dataclasses import dataclass
from pathlib import Path

from pzd.artefacts import Diagnosed, Identified, MountedDampers, Table, damper_without_force
from pzd.export.content import WRITTEN_BY_PZD, Content
from pzd.export.formats import Format, format_of, formats
from pzd.pipeline.command import Opened, stale_stages
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


def exported(given: Opened, to: str, out: Path | None, remedy: str) -> Exported:
    """Write the damper of a run in one format.

    Parameters
    ----------
    given : config and run
    to : name of the format
    out : folder of the files; None for `FOLDER` in the folder of the run
    remedy : the command that brings the run up to date, as far as `LAST`

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
        raise ConfigError(
            f"--to {to}: it holds the dynamics of a damper, and a measured curve has none; choose a form of its table, "
            f"{', '.join(name for name, one in formats().items() if not one.dynamics)}"
        )
    with given.placed():
        files = {name: data for content in contents for name, data in wanted.files(content).items()}
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
