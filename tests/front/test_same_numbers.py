"""The front door and the command line give the same numbers, to the last bit, from the same tests."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml
from rig_in_files import ENTRY

import pzd
from pzd.cli.app import status
from pzd.front.results import Result

CONTROL = ("current", "A")
LIMITS = {"stroke_m": 0.1, "speed_m_per_s": 0.6}
SIMULATE = {
    "policies": ["passive", "comfort"],
    "fidelities": ["dynamic"],
    "roads": [{"kind": "sine", "frequency_Hz": 2.25}],
}


def as_written(path: Path) -> pd.DataFrame:
    """The file, each number to its last digit, which pandas promises in some versions alone."""
    cells = pd.read_csv(path, dtype=str)
    numbers = {name: [float(cell) for cell in column] for name, column in cells.items() if _are_numbers(column)}
    return cells.assign(**numbers)


def _are_numbers(column: pd.Series) -> bool:
    return bool(pd.to_numeric(column, errors="coerce").notna().eq(column.notna()).all())


@pytest.fixture(scope="module")
def run(rig_files: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The run of a config on the files, by the command line."""
    folder = tmp_path_factory.mktemp("config")
    config = {
        "control": {"name": "current", "unit": "A"},
        "rig": {"files": [{"path": f"{rig_files}/*.csv", **ENTRY}], "limits": LIMITS},
        "simulate": SIMULATE,
    }
    (folder / "same.yaml").write_text(yaml.safe_dump(config))
    assert status(["run", str(folder / "same.yaml"), "--runs", str(folder / "runs"), "-q"]) == 0
    return folder / "runs" / "same"


@pytest.fixture(scope="module")
def tests_read(rig_files: Path) -> list[pzd.Test]:
    return pzd.read(f"{rig_files}/*.csv", control=CONTROL, **ENTRY)


@pytest.fixture(scope="module")
def found(tests_read: list[pzd.Test]) -> Result:
    return pzd.diagnose(tests_read, control=CONTROL, limits=LIMITS)


def test_the_records_are_those_of_ingest(run: Path, tests_read: list[pzd.Test]) -> None:
    assert [test.name for test in tests_read] == [
        e["name"] for e in json.loads((run / "1-rig/records.json").read_text())
    ]
    for test in tests_read:
        pd.testing.assert_frame_equal(
            test.to_frame().rename(columns={"voltage_V": "current_A"}),
            as_written(run / f"1-rig/{test.name}.csv"),
            check_exact=True,
        )


def test_the_parameters_are_those_of_identify(run: Path, tests_read: list[pzd.Test]) -> None:
    fit = pzd.identify(tests_read, control=CONTROL)
    pd.testing.assert_frame_equal(
        fit.parameters, as_written(run / "2-identify/parameters.csv"), check_exact=True, check_dtype=False
    )
    assert fit.damper.voltages == (0.0, 1.5)


def test_the_verdict_is_that_of_diagnose(run: Path, found) -> None:
    assert json.loads(json.dumps(found.as_dict())) == json.loads((run / "3-diagnose/diagnosis.json").read_text())
    assert (found.verdict, found.effects) == ("named", ["orifice_quadratic"])
    written = yaml.safe_load((run / "3-diagnose/damper.yaml").read_text())
    assert found.damper.effects["orifice_quadratic"]["q"] == written["effects"]["orifice_quadratic"]["q"]
    row = found.parameters.iloc[0]
    assert row.low95 <= row.value == written["effects"]["orifice_quadratic"]["q"] <= row.high95


def test_the_table_is_that_of_table(run: Path, found) -> None:
    pd.testing.assert_frame_equal(
        pzd.table(found.damper).to_frame(), as_written(run / "4-table/force.csv"), check_exact=True, check_dtype=False
    )


@pytest.mark.parametrize("policy", ["passive", "comfort"])
def test_a_ride_is_that_of_simulate(policy: str, run: Path, found) -> None:
    ride = pzd.ride(found.damper, policy=policy)
    case = f"sine-2.25Hz-{policy}-dynamic"
    rows = as_written(run / "5-simulate/summary.csv").set_index("case")
    assert ride.summary.drop("case").to_dict() == rows.loc[case].to_dict()
    weighted = as_written(run / "5-simulate/weighted.csv").set_index("case")
    assert ride.a_w == weighted.loc[case, "a_w_m_per_s2"]
    history = as_written(run / f"5-simulate/{case}.csv")
    np.testing.assert_array_equal(ride.history["a_K_m_per_s2"], history["a_K_m_per_s2"])


def test_a_run_is_loaded_as_it_was_written(run: Path, found) -> None:
    loaded = pzd.load(run)
    for frame, file in (
        (loaded.parameters, "2-identify/parameters.csv"),
        (loaded.summary, "5-simulate/summary.csv"),
        (loaded.comfort, "6-report/comfort.csv"),
    ):
        pd.testing.assert_frame_equal(frame, as_written(run / file), check_exact=True, check_dtype=False)
    assert loaded.diagnosis.verdict == found.verdict
    assert loaded.damper.model == found.damper.model
    assert loaded.baseline.model == found.baseline.model != loaded.damper.model
    pd.testing.assert_frame_equal(
        pzd.table(loaded.damper).to_frame(), pzd.table(found.damper).to_frame(), check_exact=True
    )
    assert not loaded.stale


def test_a_run_by_a_function_is_the_run_of_the_command(run: Path, tmp_path: Path) -> None:
    again = pzd.run(run.parent.parent / "same.yaml", runs=tmp_path, until="identify")
    pd.testing.assert_frame_equal(again.parameters, pzd.load(run).parameters, check_exact=True)
    assert again.folder == tmp_path / "same"


def test_the_same_tests_as_arrays_give_the_same_verdict(
    tests: list[pzd.Test], found, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    again = pzd.diagnose(tests, control=CONTROL, limits=LIMITS)
    assert (again.verdict, again.effects) == (found.verdict, found.effects)
    q = [each.damper.effects["orifice_quadratic"]["q"] for each in (again, found)]
    assert q[0] == pytest.approx(q[1], rel=1e-6)  # the files are in other units, and round by them
    assert list(tmp_path.iterdir()) == []
