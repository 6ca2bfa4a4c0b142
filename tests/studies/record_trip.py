"""How often the trip of a record through pzd/rig/files, or of a campaign through pzd/diagnose, comes back to a module.

    PYTHONPATH=. python tests/studies/record_trip.py rig
    PYTHONPATH=. python tests/studies/record_trip.py diagnose

rig: one small file of text (named columns, units, a constant, a known tare) and one of arrays by a layout are read.
diagnose: eight
sines at two voltages, with an orifice hidden in the damper, are diagnosed. The order of the modules is that in which
they are first entered; a return is a call of a function of a module from a module that comes later in that order.
Calls inside a module do not count, nor do calls of a leaf, a module that imports no other of its package: from there a
record cannot go on. A search calls the same functions over and over, so the pairs of modules with a return are
counted beside the calls.
"""

from __future__ import annotations

import ast
import concurrent.futures
import json
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from types import FrameType
from typing import Any, Self

import numpy as np

import pzd
from pzd.quantities import Control
from pzd.rig.config import RigConfig

PACKAGE = Path(pzd.__file__).parent
Call = tuple[str, str | None]


class _InTurn:
    """In the place of a pool of threads: each item in the calling thread, so that a call knows where it came from."""

    def __init__(self, _: int) -> None: ...

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None: ...

    def map(self, function: Callable[[Any], Any], items: Iterable[Any]) -> Iterator[Any]:
        """The builtin."""
        return map(function, items)


def module_in(folder: Path, frame: FrameType | None) -> str | None:
    """The module below a folder that a frame belongs to, None outside."""
    if frame is None or not frame.f_code.co_filename.startswith(str(folder)):
        return None
    return str(Path(frame.f_code.co_filename).relative_to(folder))


def leaf(folder: Path, module: str) -> bool:
    """Whether a module imports no other one of its package."""
    package = ".".join(("pzd", *folder.relative_to(PACKAGE).parts))
    tree = ast.parse((folder / module).read_text(encoding="utf-8"))
    return not any(isinstance(n, ast.ImportFrom) and (n.module or "").startswith(package) for n in ast.walk(tree))


def trip(folder: Path, act: Callable[[], object]) -> list[Call]:
    """Every call into a module below a folder from outside it: the module, and the nearest one of the folder above."""
    calls: list[Call] = []

    def watch(frame: FrameType, event: str, _: object) -> None:
        here = module_in(folder, frame) if event == "call" else None
        if here is None or frame.f_code.co_name == "<module>" or module_in(folder, frame.f_back) == here:
            return
        above = frame.f_back
        while above is not None and module_in(folder, above) is None:
            above = above.f_back
        if module_in(folder, above) != here:
            calls.append((here, module_in(folder, above)))

    sys.setprofile(watch)
    try:
        act()
    finally:
        sys.setprofile(None)
    return calls


def of_records(folder: Path) -> list[list[Call]]:
    """The trips of a file of text and of one of arrays, which a layout reads, through pzd/rig/files."""
    from pzd.rig.stage import ingest

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
    (folder / "a.csv").write_text("\n".join(["t,pos [mm],load", *rows]) + "\n", encoding="utf-8")
    tables = {"path": "a.json", "layout": "json_units_in_keys", "fixture": {"tare_N": 40}}
    arrays = {"time [s]": time, "displacement [mm]": x, "force [kN]": 1e-3 * force}
    content = json.dumps({key: values.tolist() for key, values in arrays.items()})
    (folder / "a.json").write_text(content, encoding="utf-8")
    trips = []
    for entry in (text, tables):
        config = RigConfig.model_validate_json(json.dumps({"files": [entry]}))
        ingest(config, Control(), folder)  # what is imported late is there now
        trips.append(trip(PACKAGE / "rig" / "files", lambda config=config: ingest(config, Control(), folder)))
    return trips


def of_campaign(folder: Path) -> list[Call]:
    """The trip of eight tests through pzd/diagnose."""
    concurrent.futures.ThreadPoolExecutor = _InTurn  # type: ignore[assignment,misc]  # before diagnose imports it
    from pzd.diagnosis.config import DiagnoseConfig
    from pzd.diagnosis.stage import diagnose
    from pzd.identification.config import IdentifyConfig
    from pzd.identification.stage import identify
    from pzd.rig.stage import synthesise

    base = [{"voltage_V": 0, "T0_N": 301, "C_Ns_per_m": 2720, "k_N_per_m": 199e3}]
    base += [{"voltage_V": 100, "T0_N": 796, "C_Ns_per_m": 3040, "k_N_per_m": 375e3}]
    tests = [
        {"waveform": {"kind": "sine", "frequency_Hz": f, "amplitude_m": a}, "duration_s": 6 / f}
        for f in (1.0, 2.0)
        for a in (0.01, 0.03)
    ]
    stand = {
        "damper": {"base": base, "effects": {"orifice_quadratic": {"q": 2500.0}}},
        "voltages_V": [0, 100],
        "tests": tests,
        "noise": {"force": {"share_of_peak": 0.005, "rho": 0.5}},
    }
    config = RigConfig.model_validate_json(json.dumps({"virtual": [stand]}))
    rig = synthesise(config, 1, Control(), folder)
    found = identify(IdentifyConfig(), rig, 1)

    def act() -> object:
        return diagnose(DiagnoseConfig(), IdentifyConfig(), config, rig, found, Control(), None, 1)

    act()
    return trip(PACKAGE / "diagnose", act)


def printed(folder: Path, calls: list[Call]) -> Iterator[str]:
    """Entries and returns, a line a module, and their sums."""
    order = list(dict.fromkeys(module for module, _ in calls))
    entered = Counter(module for module, _ in calls)
    back = Counter((m, above) for m, above in calls if above in order and order.index(above) > order.index(m))
    for module in order:
        later = sum(count for (entry, _), count in back.items() if entry == module)
        kind = ", a leaf" if leaf(folder, module) else ""
        yield f"{module:30} entered {entered[module]:6d} times, from later {later:6d}{kind}"
    returns = {pair: count for pair, count in back.items() if not leaf(folder, pair[0])}
    yield f"{len(order)} modules, {len(calls)} entries, {len(returns)} pairs, {sum(returns.values())} returns"


def main(what: str) -> None:
    """Print the trips."""
    with tempfile.TemporaryDirectory() as folder:
        trips = of_records(Path(folder)) if what == "rig" else [of_campaign(Path(folder))]
    for calls in trips:
        for line in printed(PACKAGE / ("rig/files" if what == "rig" else "diagnose"), calls):
            sys.stdout.write(f"{line}\n")


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "rig")
