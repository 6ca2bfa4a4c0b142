"""`pzd peers` compares the adopted damper with published models and a black box, from configs to the table."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import pytest
from stub_stages import project

from pzd.artefacts import Diagnosed, Identified, Knees, LawRow, Rig
from pzd.artefacts.diagnosis import PeerComparison, PeerParameterRow, PeerRow, PeerSummaryRow
from pzd.cli.app import status
from pzd.cli.peers import comparison_lines
from pzd.damper.model import BaseRow, Damper
from pzd.diagnosis.peer_comparison import compare_with_peers
from pzd.quantities import Control
from pzd.schema.errors import ConfigError

MODELS = ["plain", "handed_on", "bouc_wen", "kwok", "narx"]
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


def summary(model: str, parameters: int, W_s: float, left_out: float | None) -> PeerSummaryRow:
    return PeerSummaryRow(
        setting=None,
        model=model,
        parameters=parameters,
        tests=6,
        W_s=W_s,
        R2=1.0 - W_s,
        left_out=0 if left_out is None else 1,
        W_s_left_out=left_out,
        R2_left_out=None if left_out is None else 1.0 - left_out,
    )


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
    many = [
        parameters[0].model_copy(update={"model": "narx", "form": "n = 1", "parameter": f"a{j}"}) for j in range(13)
    ]
    together = summary("plain", 9, 0.02, 0.0201), summary("kwok", 18, 0.03, None)
    found = PeerComparison(("plain", "kwok"), tuple(rows), together, (*parameters, *many), ("ramp",), ("r01",))
    assert list(comparison_lines(found, Control("current", "A"))) == [
        "tests kept back:",
        "  current [A]  test  W_s plain  W_s kwok  R2 plain  R2 kwok",
        "  0.5          r01   0.0201     0.01      0.9771    0.9945",
        "",
        "left out, predicted from its neighbours:",
        "  current [A]  W_s plain  W_s kwok  R2 plain  R2 kwok",
        "  0.5          0.0201     0.01      0.9771    0.9945",
        "",
        "peers, fitted to all tests:",
        "  current [A]  model        parameters                   fit",
        "  0.5          kwok         c = 1500 N s/m, delta = 0.6  converged",
        "  0.5          narx, n = 1  13 coefficients              converged",
        "",
        "all tests kept back, and all that is left out:",
        "  model  parameters  tests  W_s   R2      left out  W_s left out  R2 left out",
        "  plain  9           6      0.02  0.9800  1         0.0201        0.9799",
        "  kwok   18          6      0.03  0.9700  0         -             -",
        "not compared, for the control signal moves: ramp",
        "narx is unstable in free run, its force was held at a bound: r01",
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
    together = {each["model"]: each for each in told["summary"]}
    assert {model: each["W_s"] for model, each in together.items()} == {m: each["W_s"] for m, each in whole.items()}
    assert [together[model]["parameters"] for model in MODELS[:-1]] == [
        9,
        10,
        18,
        18,
    ]  # three numbers and F_0; six each
    assert together["narx"]["parameters"] == sum(each["model"] == "narx" for each in told["parameters"])
    left_out = [each for each in told["rows"] if each["kept_back"] == "voltage"]
    assert {each["W_s"] for each in left_out} == {each["W_s_left_out"] for each in told["summary"]}
    assert {each["voltage_V"] for each in left_out} == {1.0}
    assert min(left_out, key=lambda each: each["W_s"])["model"] == "handed_on"
    assert status(["peers", str(config), *runs]) == 0
    printed = capsys.readouterr().out
    assert "diagnose   fresh" in printed
    assert "bouc_wen, n = " in printed
    another = tmp_path / "another.yaml"
    another.write_text(CONFIG.replace("seed: 1", "seed: 2"), encoding="utf-8")
    assert status(["peers", str(config), str(another), *runs]) == 0
    lines = capsys.readouterr().out.splitlines()
    head = lines.index("all tests kept back, and all that is left out:")
    named = [line.split()[:3] for line in lines[head + 2 : head + 2 + 2 * len(MODELS)]]
    assert [line[:2] for line in named] == [[damper, model] for damper in ("small", "another") for model in MODELS]
    assert named[: len(MODELS)] == [["small", model, str(together[model]["parameters"])] for model in MODELS]
    assert status(["peers", str(config), str(another), *runs, "--json"]) == 0
    both = json.loads(capsys.readouterr().out)
    assert both["dampers"]["small"] == {key: value for key, value in told.items() if key != "not_to_be_trusted"}
    assert [each["model"] for each in both["dampers"]["another"]["summary"]] == MODELS


def test_every_config_is_read_before_the_first_one_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    config, runs = project(tmp_path, monkeypatch), tmp_path / "runs"
    other = tmp_path / "elsewhere" / config.name
    other.parent.mkdir()
    other.write_bytes(config.read_bytes())
    for more, says in (
        (config, "give each config once"),
        (other, "rename one of them"),
        (tmp_path / "no.yaml", "no.yaml"),
    ):
        assert status(["peers", str(config), str(more), "--runs", str(runs)]) == 2
        assert says in capsys.readouterr().err
    assert not runs.exists()
