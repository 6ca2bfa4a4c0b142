"""Records too short to tell noise from what is missing: a verdict that says so, whatever their number and length."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from campaign import damper_of, sine
from whole_diagnosis import diagnosed

from pzd.damper.model import Damper
from pzd.record import Record, sliced

PLAIN = damper_of([0.0])
MISSING = damper_of([0.0], orifice_quadratic={"q": 2500.0})


def shortened(rng: np.random.Generator, damper: Damper, cycles: float, rate: float, name: str = "r0") -> Record:
    """A sine of 1 Hz and 15 mm, ended after so many cycles."""
    whole = sine(damper, 0.0, 1.0, 0.015, rng, noise=0.005, cycles=int(np.ceil(cycles)), rate=rate)
    part = sliced(whole, whole.time < whole.time[0] + cycles - 1e-9)
    return Record(
        name, None, part.time, part.displacement, part.velocity, part.acceleration, part.force, part.voltage, None
    )


def gets_a_verdict(*records: Record) -> None:
    found = diagnosed(records).diagnosis
    assert found.verdict in {"none", "named", "ambiguous", "unexplained"}
    assert (found.gap is None) == found.reason.startswith("the records are too short")


@pytest.mark.parametrize(
    ("cycles", "rate"), [(0.8, 500.0), (1.2, 20.0), (1.5, 100.0), (1.9, 300.0), (1.9, 500.0), (2.0, 20.0), (3.0, 100.0)]
)
def test_a_lone_record_of_any_length_gets_a_verdict(rng: np.random.Generator, cycles: float, rate: float) -> None:
    for damper in (PLAIN, MISSING):
        gets_a_verdict(shortened(rng, damper, cycles, rate))


@pytest.mark.parametrize("cycles", [(1.2, 1.2), (3.2, 1.2), (3.2, 1.2, 1.2), (1.2, 3.2, 1.2), (1.2, 1.2, 1.2)])
def test_so_do_several(rng: np.random.Generator, cycles: tuple[float, ...]) -> None:
    gets_a_verdict(*(shortened(rng, MISSING, c, 200.0, f"r{i}") for i, c in enumerate(cycles)))


def test_what_is_said_is_that_nothing_is_known_and_what_to_record(rng: np.random.Generator) -> None:
    record = shortened(rng, MISSING, 1.2, 200.0)
    found = diagnosed((record,))
    told = found.diagnosis
    assert told.verdict == "ambiguous"
    assert told.reason.startswith("the records are too short to tell noise from what is missing")
    assert "(the longest record has 240)" in told.reason
    assert (told.effects, told.rivals, told.ranking, told.where) == ((), (), (), ())
    assert (told.gap, told.confidence, told.prediction) == (None, None, None)
    assert found.damper == found.baseline
    assert len(found.parameters) == 1
    test = told.next_test
    assert test is not None
    assert test.waveform == "sine, ten cycles"
    assert test.amplitude_m == pytest.approx(0.015, rel=0.01)
    assert test.frequency_Hz == pytest.approx(1.0, rel=0.02)
    assert test.peak_speed_m_per_s is not None
    assert test.peak_speed_m_per_s <= np.max(np.abs(record.velocity))


@pytest.mark.ci
def test_a_run_on_a_short_record_goes_to_its_end(
    rng: np.random.Generator, pzd_here: Callable[..., object], tmp_path: Path
) -> None:
    record = shortened(rng, MISSING, 1.2, 200.0)
    np.savetxt(
        tmp_path / "short.csv",
        np.column_stack([record.time, record.displacement, record.force, np.zeros(record.time.size)]),
        delimiter=",",
        header="time_s,displacement_m,force_N,voltage_V",
        comments="",
    )
    rides = "simulate: {policies: [passive], fidelities: [table], duration_s: 4, settle_s: 2,\n"
    rides += "  roads: [{kind: sine, frequency_Hz: 2.25}]}\n"
    (tmp_path / "short.yaml").write_text(f"rig:\n  files:\n    - path: short.csv\n{rides}")
    ended = pzd_here("run", "short.yaml", cwd=tmp_path)
    assert ended.stderr == ""
    written = json.loads((tmp_path / "runs/short/3-diagnose/diagnosis.json").read_text())
    assert written["gap"] is None
    page = (tmp_path / "runs/short/6-report/report.html").read_text()
    assert "Not settled by these tests" in page
    assert "The gap could not be measured." in page
    shown = pzd_here("show", "short.yaml", cwd=tmp_path)
    assert "gap: could not be measured" in shown.stdout
    assert "next test: sine, ten cycles" in shown.stdout
