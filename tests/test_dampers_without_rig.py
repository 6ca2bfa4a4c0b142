"""Measured curves and the dampers of other runs go from `table` to the page, to exports and to `pzd compare`."""

from __future__ import annotations

import csv
import re
from pathlib import Path

import numpy as np
import pytest

import pzd
from pzd.artefacts import MountedDampers
from pzd.cli.app import status
from pzd.quantities import Control

CURVE = "velocity [mm/s],force [N]\n-1500,-1450\n-500,-800\n-100,-420\n0,0\n100,700\n500,1500\n1500,2900\n"
STRAIGHT = "velocity [m/s],force [N]\n-1,-2500\n1,2500\n"
RIDE = "simulate: {duration_s: 5, settle_s: 2, roads: [{kind: sine, frequency_Hz: 1.5, amplitude_m: 0.02}]}\n"


def run_of(text: str, name: str, curves: dict[str, str], *more: str) -> int:
    for file, content in curves.items():
        Path(file).write_text(content, encoding="utf-8")
    Path(f"{name}.yaml").write_text(text + RIDE, encoding="utf-8")
    return status(["run", f"{name}.yaml", "-q", *more])


def summary(name: str) -> list[dict[str, str]]:
    with Path(f"runs/{name}/5-simulate/summary.csv").open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def page(name: str) -> str:
    text = Path(f"runs/{name}/6-report/report.html").read_text(encoding="utf-8")
    return re.sub(r"\s+", " ", re.sub(r"<[^>]+>", " ", text)).replace("\u2212", "-").replace("\xa0", " ")


@pytest.fixture(autouse=True)
def _here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def test_a_curve_rides_as_the_front_door_rides_it() -> None:
    assert run_of("damper: {curve: c.csv, sign: 1}\n", "curve", {"c.csv": CURVE}) == 0
    rows = np.array([[float(cell) for cell in line.split(",")] for line in CURVE.splitlines()[1:]])
    damper = pzd.Damper.from_curve(1e-3 * rows[:, 0], rows[:, 1])
    road = {"kind": "sine", "frequency_Hz": 1.5, "amplitude_m": 0.02}
    by_hand = pzd.ride(damper, road=road, duration=5.0, settle_s=2.0)
    (ridden,) = [row for row in summary("curve") if row["policy"] == "passive"]
    assert float(ridden["rms_aK_m_per_s2"]) == pytest.approx(by_hand.summary["rms_aK_m_per_s2"], rel=1e-12)
    assert sorted(path.name for path in Path("runs/curve").iterdir() if path.is_dir()) == [
        "4-table",
        "5-simulate",
        "6-report",
    ]


def test_the_other_sign_lifts_the_body_and_the_page_says_so(capsys: pytest.CaptureFixture[str]) -> None:
    means = []
    for name, sign in (("right", 1), ("wrong", -1)):
        assert run_of(f"damper: {{curve: c.csv, sign: {sign}}}\n", name, {"c.csv": CURVE}) == 0
        found = re.search(r"sine-1.5Hz-passive-table (-?[\d.]+) (-?[\d.]+) (-?[\d.]+)", page(name))
        assert found is not None
        means.append(float(found[1]))
    assert means[0] < -1.0 < 1.0 < means[1]
    assert "Where the body rides" in page("right")
    capsys.readouterr()
    assert status(["compare", "runs/right", "runs/wrong"]) == 0
    assert "sine-1.5Hz-passive-table: rms a_K" in capsys.readouterr().out


def test_each_axle_has_its_own_and_equal_ones_ride_as_one() -> None:
    both = "damper:\n  front: {curve: a.csv, sign: 1}\n  rear: {curve: b.csv, sign: 1}\n"
    assert run_of("damper: {curve: a.csv, sign: 1}\n", "one", {"a.csv": CURVE}) == 0
    assert run_of(both, "equal", {"b.csv": CURVE}) == 0
    assert run_of(both, "unlike", {"b.csv": STRAIGHT}) == 0
    assert summary("equal") == summary("one")
    assert summary("unlike") != summary("one")
    axles = MountedDampers.read(Path("runs/unlike/4-table"), Control()).axles
    assert [axle.notes.source for axle in axles] == ["a.csv", "b.csv"]
    assert "at the rear axle" in page("unlike")


def test_a_damper_of_a_run_rides_with_its_own_dynamics_at_the_axle_it_is_given(
    capsys: pytest.CaptureFixture[str],
) -> None:
    """A run's damper at both axles rides as that run did, to the last bit; with a curve beside it by the tables."""
    rig = (
        "rig:\n  virtual:\n    - damper: {base: [{T0_N: 200, C_Ns_per_m: 1500, k_N_per_m: 300000}]}\n"
        "      tests:\n"
        "        - {waveform: {kind: sine, frequency_Hz: 1, amplitude_m: 0.02}, duration_s: 4}\n"
        "        - {waveform: {kind: sine, frequency_Hz: 4, amplitude_m: 0.01}, duration_s: 2}\n"
    )
    assert run_of(rig, "rig", {}) in (0, 4)
    assert run_of("damper: {run: runs/rig}\n", "again", {}) in (0, 4)
    plain = [row for row in summary("rig") if "plain" not in row["case"]]
    assert summary("again") == plain
    for name in ("again", "rig"):  # an edited table is followed by some rides alone, which is said
        table = Path(f"runs/{name}/4-table/force.csv")
        table.write_text(table.read_text(encoding="utf-8").replace(",1\n", ",0\n", 1), encoding="utf-8")
        capsys.readouterr()
        assert status(["run", f"{name}.yaml", "-q"]) == 4
        assert "4-table/force.csv edited by hand: rides at the fidelity table follow it" in capsys.readouterr().err
    mixed = "damper:\n  front: {run: runs/rig}\n  rear: {curve: c.csv, sign: 1}\n"
    assert run_of(mixed, "mixed", {"c.csv": CURVE}) in (0, 4)
    assert "dynamic" not in {row["fidelity"] for row in summary("mixed")}


def test_a_run_that_is_made_anew_makes_the_rides_stale_and_half_of_it_is_refused(
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Where the other run was diagnosed anew, its old table belongs to another damper: neither is ridden."""
    rig = (
        "car: false\nrig:\n  virtual:\n    - damper: {{base: [{{T0_N: {T0}, C_Ns_per_m: 1500, k_N_per_m: 300000}}]}}\n"
        "      tests:\n"
        "        - {{waveform: {{kind: sine, frequency_Hz: 1, amplitude_m: 0.02}}, duration_s: 4}}\n"
        "        - {{waveform: {{kind: sine, frequency_Hz: 4, amplitude_m: 0.01}}, duration_s: 2}}\n"
    )
    Path("rig.yaml").write_text(rig.format(T0=200), encoding="utf-8")
    assert status(["run", "rig.yaml", "-q"]) in (0, 4)
    assert run_of("damper: {run: runs/rig}\n", "again", {}) in (0, 4)
    before = summary("again")
    Path("rig.yaml").write_text(rig.format(T0=300), encoding="utf-8")
    assert status(["diagnose", "rig.yaml", "-q"]) in (0, 4)
    capsys.readouterr()
    assert status(["show", "again.yaml"]) == 0
    told = capsys.readouterr().out
    assert "stale: table: " in told
    assert "stale: simulate: it is made from table" in told
    assert status(["run", "again.yaml", "-q"]) == 2
    said = capsys.readouterr().err
    assert "its damper is not the one that its table was made of; run pzd table rig.yaml there" in said
    assert summary("again") == before
    assert status(["table", "rig.yaml", "-q"]) in (0, 4)
    assert status(["run", "again.yaml", "-q"]) in (0, 4)
    assert summary("again") != before


def test_exports_hold_the_table_of_each_axle_and_no_dynamics(capsys: pytest.CaptureFixture[str]) -> None:
    both = "damper:\n  front: {curve: a.csv, sign: 1}\n  rear: {curve: b.csv, sign: 1}\ncar: false\n"
    for file, content in (("a.csv", CURVE), ("b.csv", STRAIGHT)):
        Path(file).write_text(content, encoding="utf-8")
    Path("two.yaml").write_text(both, encoding="utf-8")
    assert status(["run", "two.yaml", "-q"]) == 0
    for form, files in {"tir": 2, "csv": 2, "mat": 2, "chrono": 2}.items():
        assert status(["export", "two.yaml", "--to", form, "--out", form]) == 0
        assert len(list(Path(form).iterdir())) == files
    rear = [line.split() for line in Path("tir/two-rear.dpr").read_text(encoding="utf-8").splitlines()[-40:]]
    points = np.array([[float(cell) for cell in line] for line in rear if len(line) == 2 and line[0][-1].isdigit()])
    np.testing.assert_allclose(points[:, 1], 2500.0 * points[:, 0], atol=1e-3)
    capsys.readouterr()
    assert status(["export", "two.yaml", "--to", "fmu"]) == 2
    said = capsys.readouterr().err
    assert "a measured curve has none" in said
    offered = said.strip().partition("a form of its table, ")[2].split(", ")
    assert len(offered) > 4
    for form in offered:
        assert status(["export", "two.yaml", "--to", form, "--out", form]) == 0


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("damper: {curve: c.csv}\n", "c.yaml:1:9: damper.sign: which direction is rebound?"),
        ("damper: {curve: none.csv, sign: 1}\n", "damper.curve: no such file"),
        ("damper: {run: runs/none}\n", "damper.run: no run with a table is there"),
        ("damper: {}\n", "say curve or run for both axles, or front and rear"),
        ("damper: {front: {curve: c.csv, sign: 1}}\n", "front and rear with one of them each"),
        ("damper: {sign: 1, front: {curve: c.csv}, rear: {curve: c.csv}}\n", "sign: belongs to front and rear"),
        ("damper: {curve: c.csv, run: runs/x}\n", "say one of curve and run"),
        ("damper: {curve: c.csv, sign: 1}\nsetting: a\n", "setting: a damper without a rig has none"),
        ("rig: {files: [{path: a.csv}]}\ndamper: {curve: c.csv, sign: 1}\n", "stand in each other's place"),
        ("seed: 1\n", "say where the damper comes from: rig, or damper"),
    ],
)
def test_each_mistake_says_what_to_write(text: str, words: str, capsys: pytest.CaptureFixture[str]) -> None:
    Path("c.csv").write_text(CURVE, encoding="utf-8")
    Path("c.yaml").write_text(text, encoding="utf-8")
    assert status(["check", "c.yaml"]) == 2
    assert words in capsys.readouterr().err


def test_commands_of_a_rig_say_where_to_begin(capsys: pytest.CaptureFixture[str]) -> None:
    Path("c.csv").write_text(CURVE, encoding="utf-8")
    Path("c.yaml").write_text("damper: {curve: c.csv, sign: 1}\n", encoding="utf-8")
    for command in ("identify", "diagnose", "ingest"):
        assert status([command, "c.yaml"]) == 2
        assert "the first command is pzd table" in capsys.readouterr().err
    assert status(["check", "c.yaml"]) == 0
    assert "7 points, -1.5 to 1.5 m/s, rebound positive" in capsys.readouterr().out


def test_an_edited_curve_makes_the_table_stale(capsys: pytest.CaptureFixture[str]) -> None:
    Path("c.csv").write_text(CURVE, encoding="utf-8")
    Path("c.yaml").write_text("damper: {curve: c.csv, sign: 1}\ncar: false\n", encoding="utf-8")
    assert status(["table", "c.yaml", "-q"]) == 0
    Path("c.csv").write_text(CURVE.replace("2900", "2901"), encoding="utf-8")
    capsys.readouterr()
    assert status(["show", "c.yaml"]) == 0
    assert "stale: table: c.csv has changed" in capsys.readouterr().out
