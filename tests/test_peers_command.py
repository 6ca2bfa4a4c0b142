"""`pzd peers` compares the adopted damper with published models, from a config to the table."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import pytest
from stub_stages import project

from pzd.artefacts import Diagnosed, Identified, Knees, LawRow, Rig
from pzd.artefacts.diagnosis import PeerComparison, PeerParameterRow, PeerRow
from pzd.cli.app import status
from pzd.cli.peers import comparison_lines
from pzd.damper.model import BaseRow, Damper
from pzd.diagnosis.peer_comparison import compare_with_peers
from pzd.quantities import Control
from pzd.schema.errors import ConfigError

MODELS = ["plain", "handed_on", "bouc_wen", "kwok"]
CONFIG = """\
seed: 1
rig:
  virtual:
    - damper:
        base:
          - {voltage_V: 0, T0_N: 120, C_Ns_per_m: 1000, k_N_per_m: 2e6}
          - {voltage_V: 1, T0_N: 420, C_Ns_per_m: 2000, k_N_per_m: 2e6}
          - {voltage_V: 2, T0_N: 720, C_Ns_per_m: 3000, k_N_per_m: 2e6}
        effects: {preload_offset: {F_0: 60}}
      voltages_V: [0, 1, 2]
      rate_Hz: 200
      tests:
        - {waveform: {kind: sine, frequency_Hz: 1, amplitude_m: 0.01}, duration_s: 4}
        - {waveform: {kind: sine, frequency_Hz: 1, amplitude_m: 0.02}, duration_s: 4}
        - {waveform: {kind: sine, frequency_Hz: 2, amplitude_m: 0.01}, duration_s: 4}
        - {waveform: {kind: sine, frequency_Hz: 2, amplitude_m: 0.02}, duration_s: 4}
      noise: {force: {share_of_peak: 0.005}}
diagnose: {most_effects: 1}
"""


def row(model: str, W_s: float, R2: float | None, record: str | None = "r01", voltage: float | None = 0.5) -> PeerRow:
    return PeerRow(setting=None, voltage_V=voltage, kept_back="test", record=record, model=model, W_s=W_s, R2=R2)


def test_the_table_has_one_line_per_test_and_one_column_per_model() -> None:
    rows = [row("plain", 0.0201, 0.9771), row("kwok", 0.01, 0.99454), row("plain", 0.02, 0.98, None, None)]
    rows += [row("kwok", 0.03, None, None, None)]
    rows += [each.model_copy(update={"kept_back": "voltage", "record": None}) for each in rows[:2]]
    parameters = [
        PeerParameterRow(
            setting=None,
            voltage_V=0.5,
            model="kwok",
            form="",
            parameter=name,
            value=value,
            unit=unit,
            status="converged",
        )
        for name, value, unit in (("c", 1500.0, "N s/m"), ("delta", 0.6, "-"))
    ]
    found = PeerComparison(("plain", "kwok"), tuple(rows), tuple(parameters), ("ramp",))
    assert list(comparison_lines(found, Control("current", "A"))) == [
        "tests kept back:",
        "  current [A]  test  W_s plain  W_s kwok  R2 plain  R2 kwok",
        "  0.5          r01   0.0201     0.01      0.9771    0.9945",
        "",
        "all tests kept back:",
        "  W_s plain  W_s kwok  R2 plain  R2 kwok",
        "  0.02       0.03      0.9800    -",
        "",
        "left out, predicted from its neighbours:",
        "  current [A]  W_s plain  W_s kwok  R2 plain  R2 kwok",
        "  0.5          0.0201     0.01      0.9771    0.9945",
        "",
        "peers, fitted to all tests:",
        "  current [A]  model  parameters                   fit",
        "  0.5          kwok   c = 1500 N s/m, delta = 0.6  converged",
        "not compared, for the control signal moves: ramp",
    ]


def test_without_a_held_out_test_there_is_nothing_to_compare(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    config = project(tmp_path, monkeypatch)
    assert status(["peers", str(config), "--runs", str(tmp_path / "runs")]) == 3
    assert capsys.readouterr().err.startswith("pzd peers: too little to keep a test back")
    assert not (tmp_path / "runs" / "first" / "peers").exists()


def test_the_knee_law_is_refused_with_a_remedy() -> None:
    law = LawRow(setting=None, law="knee", tests=4, W_s_bingham=0.1, W_s_knee=0.01, reason="it predicts better")
    plain = Damper(base=(BaseRow(T0_N=100.0, C_Ns_per_m=1000.0, k_N_per_m=1e6),))
    identified = Identified((), (), knees=Knees(laws=(law,)))
    with pytest.raises(ConfigError, match=r"identify.law: .* say bingham"):
        compare_with_peers(Rig((), ()), identified, Diagnosed.undiagnosed(plain), None)


@pytest.mark.ci
def test_from_a_config_to_the_table(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The damper is nearer to Bouc-Wen, whose hysteresis knows the way as an oil spring does, than to Kwok."""
    config = tmp_path / "small.yaml"
    config.write_text(CONFIG, encoding="utf-8")
    runs = ["--runs", str(tmp_path / "runs")]
    assert status(["peers", str(config), *runs, "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["models"] == MODELS
    diagnosis = json.loads((tmp_path / "runs" / "small" / "3-diagnose" / "diagnosis.json").read_text("utf-8"))
    assert diagnosis["effects"] == ["preload_offset"]
    with (tmp_path / "runs" / "small" / "peers" / "peers.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [dict(each, W_s=float(each["W_s"])) for each in rows if each["record"]] == [
        {key: "" if value is None else value if key == "W_s" else str(value) for key, value in each.items()}
        for each in told["rows"]
        if each["record"]
    ]
    whole = {each["model"]: each for each in told["rows"] if each["record"] is None and each["voltage_V"] is None}
    prediction = diagnosis["prediction"]
    assert whole["plain"]["W_s"] == pytest.approx(prediction["W_s_plain"], rel=1e-9)
    assert whole["handed_on"]["W_s"] == pytest.approx(prediction["W_s"], rel=1e-9)
    assert whole["handed_on"]["W_s"] < whole["bouc_wen"]["W_s"] < min(whole[m]["W_s"] for m in ("plain", "kwok"))
    by_test = {(each["record"], each["model"]): each for each in told["rows"] if each["record"]}
    for each in prediction["by"]:
        assert by_test[each["record"], "handed_on"]["R2"] == pytest.approx(each["R2"], rel=1e-9)
    left_out = [each for each in told["rows"] if each["kept_back"] == "voltage"]
    assert {each["voltage_V"] for each in left_out} == {1.0}
    assert min(left_out, key=lambda each: each["W_s"])["model"] == "handed_on"
    assert status(["peers", str(config), *runs]) == 0
    printed = capsys.readouterr().out
    assert "diagnose   fresh" in printed
    assert "bouc_wen, n = " in printed
