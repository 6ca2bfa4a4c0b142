"""`pzd changes` from a config to its files: the contract of the JSON, the page, and what is refused."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from subprocess import CompletedProcess

import pytest

STATE = """\
    - setting: {setting}
      damper: {{base: [{{voltage_V: 0, T0_N: {friction}, C_Ns_per_m: 2700, k_N_per_m: 200000}}]}}
      voltages_V: [0]
      tests:
        - {{waveform: {{kind: sine, frequency_Hz: 1, amplitude_m: 0.02}}, cycles: 5}}
        - {{waveform: {{kind: sine, frequency_Hz: 2, amplitude_m: 0.02}}, cycles: 8}}
      noise: {{force: {{share_of_peak: 0.003}}}}
      rate_Hz: 500
"""
QUICK = "diagnose: {most_effects: 1, most_evaluations: 1}\n"
TWO = "seed: 3\nrig:\n  virtual:\n" + "".join(
    STATE.format(setting=s, friction=f) for s, f in (("new", 300), ("aged", 330))
)
KEYS = {
    "verdict", "from", "to", "compared", "difference", "changes", "unchanged", "rivals", "reason", "next_test",
}  # fmt: skip
OF_CHANGE = {"name", "parameter", "of", "unit", "from", "to", "low95", "high95", "at_voltage_V", "share", "reason"}


@pytest.fixture
def ran(pzd_here: Callable[..., CompletedProcess[str]], tmp_path: Path) -> Callable[..., CompletedProcess[str]]:
    (tmp_path / "damper.yaml").write_text(TWO + QUICK, encoding="utf-8")
    return lambda *arguments: pzd_here("changes", "damper.yaml", *arguments, cwd=tmp_path)


def test_two_settings_of_one_config_give_the_json_of_the_contract_and_a_page_beside_it(
    ran: Callable[..., CompletedProcess[str]], tmp_path: Path
) -> None:
    done = ran("--from", "new", "--to", "aged", "--json")
    assert done.returncode == 0, done.stderr
    printed = json.loads(done.stdout)
    folder = tmp_path / "runs" / "damper" / "changes"
    assert json.loads((folder / "new--to--aged.json").read_text(encoding="utf-8")) == printed
    assert printed.keys() == KEYS
    assert (printed["verdict"], printed["from"], printed["to"], printed["compared"]) == (
        "changed", "new", "aged", "cycles",
    )  # fmt: skip
    (change,) = printed["changes"]
    assert change.keys() == OF_CHANGE
    assert (change["name"], change["parameter"], change["of"], change["unit"]) == ("T0", "T0", "damper", "N")
    assert change["low95"] < 330.0 + (change["from"] - 300.0) < change["high95"]
    assert printed["difference"].keys() == {"rms_N", "share_of_peak", "noise_N", "left_N", "explained"}
    page = (folder / "new--to--aged.html").read_text(encoding="utf-8")
    assert "What changed from new to aged" in page
    assert "<script" not in page
    # Again, the other way round: the files of both stand beside each other, the same bytes for the same states.
    first = (folder / "new--to--aged.json").read_bytes()
    assert ran("--from", "aged", "--to", "new").returncode == 0
    assert {path.name for path in folder.glob("*.json")} == {"new--to--aged.json", "aged--to--new.json"} | {
        ".written.json"
    }
    assert ran("--from", "new", "--to", "aged").returncode == 0
    assert (folder / "new--to--aged.json").read_bytes() == first


def test_two_configs_are_two_states_and_the_files_stand_with_the_second(
    pzd_here: Callable[..., CompletedProcess[str]], tmp_path: Path
) -> None:
    for name, friction in (("before", 300), ("after", 270)):
        text = f"seed: {friction}\ncontrol: {{name: current, unit: A}}\nrig:\n  virtual:\n"
        text += STATE.format(setting=name, friction=friction).replace("voltage_V", "current_A").replace(
            "voltages_V", "currents_A"
        )  # fmt: skip
        (tmp_path / f"{name}.yaml").write_text(text + QUICK, encoding="utf-8")
    done = pzd_here("changes", "before.yaml", "after.yaml", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "from before to after: changed" in done.stdout
    assert (tmp_path / "runs" / "after" / "changes" / "before--to--after.json").is_file()


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ((), "two states are needed: a second config, or two settings by --from and --to"),
        (("--from", "new", "--to", "new"), "--from and --to name the same records"),
        (("--from", "new", "--to", "agde"), "did you mean aged?"),
        (("missing.yaml",), "missing.yaml: the file is missing"),
    ],
)
def test_a_call_that_names_no_two_states_is_refused_with_what_to_do(
    ran: Callable[..., CompletedProcess[str]], arguments: tuple[str, ...], says: str
) -> None:
    done = ran(*arguments)
    assert done.returncode == 2
    assert says in done.stderr


@pytest.mark.parametrize("named", [("--from", "new", "--to", "agde"), ("--over", "new,agde")])
def test_a_name_that_the_config_has_not_is_refused_before_anything_runs(
    ran: Callable[..., CompletedProcess[str]], tmp_path: Path, named: tuple[str, ...]
) -> None:
    done = ran(*named)
    assert (done.returncode, done.stdout) == (2, "")
    assert f"{named[-2]}: no record of the rig has this setting; there is aged, new; did you mean aged?" in done.stderr
    assert not (tmp_path / "runs").exists()


@pytest.mark.parametrize(
    "entries",
    [
        "[{path: '*.csv', pattern: '(?P<setting>[a-z]+)$'}]",
        "[{path: new.csv, setting: new}, {path: aged.csv, setting: aged}]",
    ],
)
def test_the_names_of_files_tell_their_settings_before_they_are_read(
    pzd_here: Callable[..., CompletedProcess[str]], tmp_path: Path, entries: str
) -> None:
    for name in ("new", "aged"):
        (tmp_path / f"{name}.csv").write_text("no recording\n", encoding="utf-8")
    (tmp_path / "damper.yaml").write_text(f"rig: {{files: {entries}}}\n", encoding="utf-8")
    done = pzd_here("changes", "damper.yaml", "--from", "new", "--to", "agde", cwd=tmp_path)
    assert done.returncode == 2
    assert "--to: no record of the rig has this setting; there is aged, new" in done.stderr


def test_over_several_settings_each_quantity_has_a_value_a_state_and_a_word_on_its_limits(
    pzd_here: Callable[..., CompletedProcess[str]], tmp_path: Path
) -> None:
    states = "".join(STATE.format(setting=f"s{i}", friction=300 + 40 * i) for i in range(3))
    limits = """\
changes:
  tolerance: {T0: [280, 350], C: [2600, 2800]}
  peak_force: [{velocity_m_per_s: 0.2, rebound_N: [700, 1000], compression_N: [-1000, -700]}]
"""
    (tmp_path / "line.yaml").write_text(f"seed: 3\nrig:\n  virtual:\n{states}setting: s0\n{QUICK}{limits}", "utf-8")
    done = pzd_here("changes", "line.yaml", "--over", "s0,s1,s2", "--json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert found.keys() == (KEYS - {"changes"}) | {"states", "over", "pass"}
    assert (found["states"], found["verdict"], found["pass"]) == (["s0", "s1", "s2"], "changed", False)
    rows = {f"{row['name']}.{row['parameter']}": row for row in found["over"]}
    friction = rows["T0.T0"]
    assert friction["values"] == pytest.approx([300.0, 340.0, 380.0], rel=0.01)
    assert (friction["pass"], rows["C.C"]["pass"]) == (False, True)
    assert rows["peak_force.rebound_0.2_m_per_s"]["pass"] is True
    assert "T0 is outside its limits from s2 on" in found["reason"]
    page = (tmp_path / "runs" / "line" / "changes" / "s0--to--s2.html").read_text(encoding="utf-8")
    assert "Over the states" in page


def test_over_cycles_a_damper_that_stays_as_it_is_shows_no_course(
    pzd_here: Callable[..., CompletedProcess[str]], tmp_path: Path
) -> None:
    long = STATE.format(setting="one", friction=300).replace("cycles: 5", "cycles: 8")
    (tmp_path / "long.yaml").write_text(f"seed: 3\nrig:\n  virtual:\n{long}{QUICK}", encoding="utf-8")
    done = pzd_here("changes", "long.yaml", "--over", "cycles", "--json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert found["states"] == ["cycles 1-2", "cycles 3-4", "cycles 5-6", "cycles 7-8"]
    assert found["verdict"] == "unchanged"
    (friction,) = [row for row in found["over"] if row["name"] == "T0"]
    assert max(friction["values"]) - min(friction["values"]) < 6.0


@pytest.mark.parametrize("over", ["new", "new,new", "new,agde"])
def test_over_needs_two_settings_of_the_rig(ran: Callable[..., CompletedProcess[str]], over: str) -> None:
    done = ran("--over", over)
    assert done.returncode == 2
    assert "--over" in done.stderr
