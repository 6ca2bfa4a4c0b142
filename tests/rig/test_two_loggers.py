"""Displacement by one logger and force by another: joined by one clock, by pulses of an event, or by a common column.

The second begins 137 ms after the first. Ignored, that makes a damper of 900 N s/m one of another sign.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from written_files import run

from pzd.artefacts import Rig
from pzd.record import Array
from pzd.schema.errors import ConfigError, DataError

LATE, DAMPING, FRICTION = 0.137, 900.0, 150.0
DURATION = 6.0


def displacement(t: Array, *, repeats: bool = False) -> Array:
    """A sine of 2 Hz that grows in the first second and ends in the last, or one that goes on [m]."""
    grown = 1.0 if repeats else np.clip(t - 0.4, 0.0, 1.0) * np.clip(DURATION - 0.4 - t, 0.0, 1.0)
    return np.asarray(0.02 * grown * np.sin(2.0 * np.pi * 2.0 * t))


def force(t: Array, **how: bool) -> Array:
    """The force of a damper with rounded friction under that motion [N]."""
    v = (displacement(t + 1e-5, **how) - displacement(t - 1e-5, **how)) / 2e-5
    return np.asarray(DAMPING * v + FRICTION * np.tanh(v / 0.02))


def table(path: Path, separator: str = ",", decimal: str = ".", **columns: Array) -> None:
    path.parent.mkdir(exist_ok=True)
    rows = zip(*columns.values(), strict=True)
    lines = [separator.join(f"{cell:.9g}".replace(".", decimal) for cell in row) for row in rows]
    path.write_text("\n".join([separator.join(columns), *lines]) + "\n", encoding="utf-8")


def pulses(t: Array, *instants: float) -> Array:
    return np.asarray(sum(5.0 * ((t >= one) & (t < one + 0.05)) for one in instants))


def loggers(folder: Path, *, pace: float = 1.0, stem: str = "run1", repeats: bool = False) -> None:
    """Write rig/STEM.csv by the first logger, daq/STEM.csv by the second, whose clock goes at another pace."""
    t = np.arange(0.0, DURATION, 1.0 / 1000.0)
    trigger = pulses(t, 0.5, 5.0)
    how = {"repeats": repeats}
    table(folder / "rig" / f"{stem}.csv", **{"t [s]": t, "Pos [mm]": 1e3 * displacement(t, **how), "Trig": trigger})
    theirs = np.arange(LATE, DURATION, 1.0 / 2000.0)
    table(
        folder / "daq" / f"{stem}.csv", ";", ",",
        **{
            "Zeit [ms]": 1e3 * (theirs - LATE) / pace,
            "Kraft [kN]": 1e-3 * force(theirs, **how),
            "Weg [V]": 5.0 + 100.0 * displacement(theirs, **how),
            "Sync": 0.6 * pulses(theirs, 0.5, 5.0),
        },
    )  # fmt: skip


def entry(**beside: Any) -> dict[str, Any]:
    second = {"path": "daq/*.csv", "columns": {"time": "Zeit [ms]", "force": "Kraft [kN]"}, **beside}
    return {"path": "rig/*.csv", "columns": {"time": "t [s]", "displacement": "Pos [mm]"}, "beside": second}


WAYS = {"event": ["Trig", "Sync"], "column": ["Pos [mm]", "Weg [V]"]}


def found(rig: Rig) -> tuple[float, float]:
    """Damping [N s/m] and friction [N] of the record by regression."""
    (record,) = rig.records
    fast = np.abs(record.velocity) > 0.05
    v, f = record.velocity[fast], record.force[fast]
    basis = np.column_stack([v, np.tanh(v / 0.02)])
    damping, friction = np.linalg.lstsq(basis, f, rcond=None)[0]
    return float(damping), float(friction)


@pytest.mark.parametrize("way", WAYS)
def test_the_damper_is_found_whatever_aligns_the_loggers(way: str, tmp_path: Path) -> None:
    loggers(tmp_path)
    rig = run(tmp_path, entry(**{way: WAYS[way]}))
    damping, friction = found(rig)
    assert damping == pytest.approx(DAMPING, rel=0.01)
    assert friction == pytest.approx(FRICTION, rel=0.05)
    (told,) = [row.became for row in rig.ingested if row.step == "clock" and "its 0 is" in row.became]
    offset = re.search(r"its 0 is ([\d.]+) s", told)
    assert offset is not None
    assert float(offset[1]) == pytest.approx(LATE, abs=1e-3 if way == "event" else 2e-5)


def test_the_page_of_the_configs_shows_a_config_that_reads_them(root: Path, tmp_path: Path) -> None:
    page = (root / "configs" / "README.md").read_text(encoding="utf-8")
    shown = re.search(r"<!-- config of two loggers -->\n```yaml\n(.*?)```", page, re.DOTALL)
    assert shown is not None
    loggers(tmp_path)
    (only,) = yaml.safe_load(shown[1])["rig"]["files"]
    assert found(run(tmp_path, only))[0] == pytest.approx(DAMPING, rel=0.01)


def test_a_common_clock_needs_no_signal(tmp_path: Path) -> None:
    loggers(tmp_path)
    path = tmp_path / "daq" / "run1.csv"
    lines = path.read_text(encoding="utf-8").splitlines()
    for number, (clock, _, rest) in enumerate((line.partition(";") for line in lines[1:]), 1):
        counted = float(clock.replace(",", ".")) + 1e3 * LATE
        lines[number] = f"{counted:.9g};".replace(".", ",") + rest
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    damping, _ = found(run(tmp_path, entry(same_clock=True)))
    assert damping == pytest.approx(DAMPING, rel=0.01)


def test_taking_the_clocks_as_one_where_they_are_not_is_far_off(tmp_path: Path) -> None:
    loggers(tmp_path)
    with pytest.raises(DataError, match="the damper does work on the rig"):
        run(tmp_path, entry(same_clock=True))


def test_two_pulses_tell_the_pace_of_the_other_clock(tmp_path: Path) -> None:
    loggers(tmp_path, pace=1.0 + 4e-4)
    rig = run(tmp_path, entry(event=WAYS["event"]))
    (told,) = [row.became for row in rig.ingested if row.step == "clock" and "each of its seconds" in row.became]
    pace = re.search(r"each of its seconds ([\d.]+) s", told)
    assert pace is not None
    assert float(pace[1]) == pytest.approx(1.0004, abs=2.0 * 1e-3 / 4.5)
    assert found(rig)[0] == pytest.approx(DAMPING, rel=0.01)


def test_a_star_stands_for_what_the_star_of_the_path_matched(tmp_path: Path) -> None:
    for stem in ("a", "b"):
        loggers(tmp_path, stem=stem)
        (tmp_path / "daq" / f"{stem}.csv").rename(tmp_path / "daq" / f"log_{stem}.csv")
    assert len(run(tmp_path, entry(event=WAYS["event"], path="daq/log_*.csv")).records) == 2


@pytest.mark.parametrize(
    ("beside", "words"),
    [
        ({"path": "none/*.csv", "event": WAYS["event"]}, "no such file for run1.csv; \\* stands for 'run1'"),
        ({"columns": {"time": "Zeit [ms]", "displacement": "Weg [V]"}, "event": WAYS["event"]}, "said twice"),
    ],
)
def test_what_the_config_does_not_describe_is_refused(beside: dict[str, Any], words: str, tmp_path: Path) -> None:
    loggers(tmp_path)
    with pytest.raises(ConfigError, match=words):
        run(tmp_path, entry(**beside))


@pytest.mark.parametrize(
    ("way", "change", "words"),
    [
        ({"event": ["Trig", "Nothing"]}, None, "missing column Nothing"),
        ({"event": ["Pos [mm]", "Sync"]}, None, "2 rising edges of 'Sync', and 1. of 'Pos"),
        ({"column": ["Trig", "Weg [V]"]}, None, "do not show the same signal"),
        ({"column": ["Pos [mm]", "Weg [V]"]}, "repeats", "agree as well 0.5 s apart, since the motion repeats"),
    ],
)
def test_clocks_that_cannot_be_aligned_are_refused(
    way: dict[str, Any], change: str | None, words: str, tmp_path: Path
) -> None:
    loggers(tmp_path, repeats=change == "repeats")
    with pytest.raises(DataError, match=re.compile(words)):
        run(tmp_path, entry(**way))


@pytest.mark.parametrize(
    ("way", "change", "advice", "remedy"),
    [
        ({"event": ["Pos [mm]", "Sync"]}, None, "or say column", {"column": WAYS["column"]}),
        ({"column": ["Trig", "Weg [V]"]}, None, "name a column that both recorded", {"column": WAYS["column"]}),
        ({"column": ["Trig", "Weg [V]"]}, None, "or an event", {"event": WAYS["event"]}),
        ({"column": WAYS["column"]}, "repeats", "or say event", {"event": WAYS["event"]}),
    ],
)
def test_what_the_refusal_advises_aligns_the_clocks(
    way: dict[str, Any], change: str | None, advice: str, remedy: dict[str, Any], tmp_path: Path
) -> None:
    loggers(tmp_path, repeats=change == "repeats")
    with pytest.raises(DataError, match=advice):
        run(tmp_path, entry(**way))
    assert found(run(tmp_path, entry(**remedy)))[0] == pytest.approx(DAMPING, rel=0.01)


@pytest.mark.parametrize(
    ("beside", "words"),
    [
        ({}, "exactly one of same_clock, event, column"),
        ({"same_clock": True, "event": ["a", "b"]}, "exactly one of same_clock, event, column"),
        ({"same_clock": True, "columns": {"force": "F"}}, "name time and what is read"),
    ],
)
def test_how_the_clocks_go_together_is_said_once(beside: dict[str, Any], words: str, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=words):
        run(tmp_path, entry(**beside))
