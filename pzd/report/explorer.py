"""The explorer of the records: what its script draws, thinned, and which scripts a page with it may run.

BokehJS draws it, the script that the package bokeh installs, inlined: the page asks nothing of the net, and its content
security policy lets these very scripts run, by their hashes, and nothing else. Without scripts and on paper the page
has its static pictures alone.
"""

from __future__ import annotations

import base64
import hashlib
import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from pzd.record import Array, Record
from pzd.report.context import ReportContext

_LIBRARY = ("bokeh.min.js", "bokeh-api.min.js")
"""Of the package bokeh: the core, and the functions that make figures."""
_POLICY = "default-src 'none'; img-src data:; style-src 'unsafe-inline'; base-uri 'none'; form-action 'none'"
"""Styles stand in the page, and the library writes its own; pictures and icons are data."""
_MOST_TESTS = 200
"""Tests that can be chosen, every n-th where there are more."""
_MOST_SAMPLES = 600
"""Samples of a test: two cycles are smooth with these."""
_ALL_SAMPLES = 30_000
"""Samples of all tests: some 1.3 MB, so that the page stays below 5 MB."""
_DIGITS = 5
"""Significant digits of a sample: a load cell has four."""


@dataclass(frozen=True)
class Explorer:
    """What the page needs for it."""

    tests: tuple[str, ...]
    """Labels of the tests."""
    first: int
    """The test that is shown at first."""
    voltages: tuple[str, ...]
    """Labels of the curves of the table."""
    curves: tuple[tuple[str, str], ...]
    """Key and name of each curve of a test."""
    data: str
    """JSON that the script reads; no character of it ends a script."""
    note: str
    """What was left out."""


def explorer(context: ReportContext) -> Explorer | None:
    """Return the records, the simulated forces and the table for the script; None where there is no record."""
    every = context.tests.records
    if not every:
        return None
    records = context.tests.by_motion(every[:: -(-len(every) // _MOST_TESTS)])
    most = min(_MOST_SAMPLES, _ALL_SAMPLES // len(records))
    curves = [("measured", "measured"), ("baseline", context.damper.baseline_name)]
    curves += [("final", "with what was missing")] if context.damper.extended else []
    table = tuple(_table(context))
    named = context.tests.labels(records)
    tests = [{"label": label} | _test(context, record, most) for record, label in zip(records, named, strict=True)]
    data = {"curves": {key: True for key, _ in curves}, "tests": tests, "table": table}
    shown = [record.name for record in records]
    first = next((shown.index(record.name) for record in context.tests.shown[::-1] if record.name in shown), 0)
    left_out = f" {len(records)} of {len(every)} tests can be chosen." if len(records) < len(every) else ""
    return Explorer(
        tests=tuple(test["label"] for test in tests),
        first=first,
        voltages=tuple(curve["label"] for curve in table),
        curves=tuple(curves),
        data=json.dumps(data, separators=(",", ":")).replace("<", "\\u003c"),
        note=f"The middle of each test, by every n-th sample, at most {most}.{left_out}",
    )


def _test(context: ReportContext, record: Record, most: int) -> dict[str, Any]:
    part = context.tests.middle(record)
    step = max(-(-(part.stop - part.start) // most), 1)
    rows = slice(part.start, part.stop, step)
    baseline, final = context.damper.simulated(record)
    columns = {
        "t": record.time - record.time[0],
        "x": 1000.0 * record.displacement,
        "v": record.velocity,
        "F": record.force,
        "B": baseline,
    }
    columns |= {"A": final} if context.damper.extended else {}
    return {name: _rounded(values[rows]) for name, values in columns.items()}


def _table(context: ReportContext) -> Iterator[dict[str, Any]]:
    """Yield force over velocity of the table at its lowest temperature, a curve a voltage."""
    rows = [row for row in context.table.force if row.force_N is not None]
    first = min((row.temperature_degC for row in rows), key=lambda t: -np.inf if t is None else t, default=None)
    here = [row for row in rows if row.temperature_degC == first]
    for voltage in sorted({row.voltage_V for row in here}, key=lambda v: v or 0.0):
        curve = [(row.velocity_m_per_s, row.force_N or 0.0) for row in here if row.voltage_V == voltage]
        velocity, force = np.array(curve).T
        label = context.voltage(voltage) if voltage is not None else "the damper"
        force = force + context.damper.static_force(voltage)
        yield {"label": label, "v": _rounded(velocity), "F": _rounded(force)}


def _rounded(values: Array) -> list[float]:
    """Return values to five digits of the largest, as short as they can be written."""
    top = float(np.abs(values).max(initial=0.0))
    places = _DIGITS - 1 - int(np.floor(np.log10(top))) if top > 0.0 else 0
    return [float(value) if places > 0 else int(value) for value in np.round(values, max(places, 0))]


# --- Scripts, and the policy that lets them run ---


@cache
def scripts() -> tuple[str, ...]:
    """Return the library, then the script of the explorer, as they stand in the page."""
    found = find_spec("bokeh")
    if found is None or found.origin is None:
        raise ModuleNotFoundError("bokeh, whose script draws the explorer of the page, is not installed", name="bokeh")
    folder = Path(found.origin).parent / "server" / "static" / "js"
    own = Path(__file__).parent / "templates" / "explorer.js"
    return tuple(path.read_text(encoding="utf-8") for path in (*(folder / name for name in _LIBRARY), own))


def policy(texts: Sequence[str]) -> str:
    """Return the content security policy of a page with these scripts, each by its hash; with none, nothing runs."""
    hashes = (base64.b64encode(hashlib.sha256(text.encode()).digest()).decode() for text in texts)
    allowed = " ".join(f"'sha256-{each}'" for each in hashes)
    return f"{_POLICY}; script-src {allowed}" if allowed else _POLICY
