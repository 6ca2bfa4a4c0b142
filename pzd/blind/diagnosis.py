"""Diagnoses a case from its rig files alone."""

from __future__ import annotations

import time
import traceback
from dataclasses import dataclass
from pathlib import Path

from pzd.blind.case import Cost
from pzd.diagnose.config import DiagnoseConfig
from pzd.identify.config import IdentifyConfig
from pzd.quantities import Control
from pzd.rig.config import FilesEntry, Limits, RigConfig
from pzd.schema.jsonfile import write_json

COST = "cost.json"


@dataclass(frozen=True)
class Methods:
    """How a case is diagnosed: the config's ordinary blocks."""

    identify: IdentifyConfig
    diagnose: DiagnoseConfig
    limits: Limits
    """What the stand can do."""
    control: Control
    seed: int
    """Of the evolutionary search, where identify uses it."""


def diagnose_case(methods: Methods, folder: Path) -> None:
    """Run ingest, identify and diagnose on the files of `folder`/rig, and write the diagnosis into `folder`.

    What goes wrong is written down as the case's failure.

    Parameters
    ----------
    methods : how
    folder : holds the rig files and nothing else
    """
    begun = time.perf_counter()
    spent, failure = 0.0, None
    try:
        spent = _diagnosed(methods, folder)
    except Exception as error:  # noqa: BLE001  # whatever fails counts against the diagnosis
        failure = "".join(traceback.format_exception_only(error)).strip() + f" ({_place(error)})"
    cost = Cost(
        seconds=round(time.perf_counter() - begun, 3),
        diagnose_seconds=round(spent, 3),
        peak_memory_MB=round(_peak_memory(), 1),
        failure=failure,
    )
    write_json(folder / COST, cost, methods.control)


def _diagnosed(methods: Methods, folder: Path) -> float:
    """Write the diagnosis; the seconds that diagnose took."""
    from pzd.diagnose.stage import diagnose
    from pzd.identify.stage import identify
    from pzd.rig.stage import ingest

    config = RigConfig(files=(FilesEntry(path="rig/*.csv"),), limits=methods.limits)
    rig = ingest(config, methods.control, folder)
    identified = identify(methods.identify, rig, methods.seed)
    begun = time.perf_counter()
    found = diagnose(methods.diagnose, methods.identify, config, rig, identified, methods.control, None, jobs=1)
    spent = time.perf_counter() - begun
    found.write(folder, methods.control)
    return spent


def _place(error: BaseException) -> str:
    last = traceback.extract_tb(error.__traceback__)[-1]
    return f"{Path(last.filename).name}:{last.lineno}"


def _peak_memory() -> float:
    """Largest memory of this process so far [MB]; 0 where the system does not say."""
    try:
        import resource
    except ImportError:
        return 0.0
    import sys

    unit = 1e-6 if sys.platform == "darwin" else 1024e-6
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit
