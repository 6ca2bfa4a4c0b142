"""How often a record enters the modules of pzd/rig/files on its way from the disk to the artefact, and which way.

    python tests/studies/record_trip.py

One small file of text (named columns, units, a constant, a known tare) and one of arrays by a layout are read. The
order of the modules is that in which they are first entered; a return is a call of a function of a module from a
module that comes later in that order. Calls inside a module do not count, nor do calls of a leaf, a module that
imports no other of the room (units, the file's dialect): from there a record cannot go on.
"""

from __future__ import annotations

import ast
import json
import sys
import tempfile
from collections import Counter
from pathlib import Path
from types import FrameType

import numpy as np

from pzd.quantities import Control
from pzd.rig import stage
from pzd.rig.config import RigConfig

FILES = Path(stage.__file__).parent / "files"


def room(frame: FrameType | None) -> str | None:
    """The module of pzd/rig/files that a frame belongs to, None outside."""
    if frame is None or not frame.f_code.co_filename.startswith(str(FILES)):
        return None
    return str(Path(frame.f_code.co_filename).relative_to(FILES))


def leaf(module: str) -> bool:
    """Whether a module imports no other one of the room."""
    tree = ast.parse((FILES / module).read_text(encoding="utf-8"))
    return not any(
        isinstance(n, ast.ImportFrom) and (n.module or "").startswith("pzd.rig.files") for n in ast.walk(tree)
    )


def trip(rig: RigConfig, folder: Path) -> list[tuple[str, str | None]]:
    """Every call into a module of the room from outside it: the module, and the nearest one of the room above it."""
    calls: list[tuple[str, str | None]] = []

    def watch(frame: FrameType, event: str, _: object) -> None:
        here = room(frame) if event == "call" else None
        if here is None or frame.f_code.co_name == "<module>" or room(frame.f_back) == here:
            return
        above = frame.f_back
        while above is not None and room(above) is None:
            above = above.f_back
        if room(above) != here:
            calls.append((here, room(above)))

    sys.setprofile(watch)
    try:
        stage.ingest(rig, Control(), folder)
    finally:
        sys.setprofile(None)
    return calls


def main() -> None:
    """Print entries and returns, module by module, for a file of text and one of tables that a layout reads."""
    time = np.arange(500) * 2e-3
    x = 10.0 * np.sin(2.0 * np.pi * 5.0 * time)
    force = 3.0 * np.gradient(x, time) + 40.0
    rows = [f"{t:.9g},{a:.9g},{f:.9g}" for t, a, f in zip(time, x, force, strict=True)]
    text = {
        "path": "a.csv",
        "columns": {"time": "t", "displacement": "pos [mm]", "force": "load"},
        "units": {"time": "s", "force": "N"},
        "constants": {"voltage": "100 V"},
        "fixture": {"tare_N": 40},
    }
    tables = {"path": "a.json", "layout": "json_units_in_keys", "fixture": {"tare_N": 40}}
    arrays = {"time [s]": time, "displacement [mm]": x, "force [kN]": 1e-3 * force}
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "a.csv").write_text("\n".join(["t,pos [mm],load", *rows]) + "\n", encoding="utf-8")
        content = json.dumps({key: values.tolist() for key, values in arrays.items()})
        (Path(folder) / "a.json").write_text(content, encoding="utf-8")
        for entry in (text, tables):
            config = RigConfig.model_validate_json(json.dumps({"files": [entry]}))
            stage.ingest(config, Control(), Path(folder))  # what is imported late stands now
            told(trip(config, Path(folder)))


def told(calls: list[tuple[str, str | None]]) -> None:
    """Print the entries and returns of one trip."""
    order = list(dict.fromkeys(module for module, _ in calls))
    entered = Counter(module for module, _ in calls)
    later = Counter(m for m, above in calls if above in order and order.index(above) > order.index(m))
    for module in order:
        kind = ", a leaf" if leaf(module) else ""
        sys.stdout.write(f"{module:20} entered {entered[module]:2d} times, from later {later[module]:2d}{kind}\n")
    returns = sum(count for module, count in later.items() if not leaf(module))
    sys.stdout.write(f"{len(order)} modules, {len(calls)} entries, {returns} returns\n")


if __name__ == "__main__":
    main()
