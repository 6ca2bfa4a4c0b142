"""What shows only beside other stretches or other files: two tests in one record, a changed tare, a turned channel."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from stepped_motions import NO_STEPS, STEPS, TIME, sine
from test_preflight import record
from written_files import lines, refused, run, write

from pzd.artefacts import Finding, RecordEntry
from pzd.record import Array
from pzd.rig.preflight.force import drop_contradicting_delays


def damper(x: Array, gas: float = 0.0) -> Array:
    v = np.gradient(x, TIME)
    return np.asarray(900.0 * v + 200.0 * np.tanh(v / 0.005) + gas + 0.02 * gas / 0.01 * -x)


def stored(folder: Path, name: str, x: Array, force: Array) -> None:
    write(folder / f"{name}.csv", lines({"time_s": TIME, "displacement_m": x, "force_N": force}))


@pytest.mark.parametrize("kind", STEPS)
def test_two_tests_in_one_record_are_reported_with_how_to_split_them(tmp_path: Path, kind: str) -> None:
    stored(tmp_path, "a", STEPS[kind], damper(STEPS[kind]))
    (finding,) = [f for f in run(tmp_path).entries[0].findings if f.check == "steps"]
    assert "split: {column" in finding.follows
    boundary = float(finding.where.split("until ")[1].split(" s")[0])
    assert boundary == pytest.approx(6.0, abs=1.0)


@pytest.mark.parametrize("kind", NO_STEPS)
def test_beats_sweeps_growing_sines_and_tones_are_no_steps(tmp_path: Path, kind: str) -> None:
    stored(tmp_path, "a", NO_STEPS[kind], damper(NO_STEPS[kind]))
    assert "steps" not in {finding.check for finding in run(tmp_path).entries[0].findings}


def offsets(folder: Path, levels: list[float]) -> list[str]:
    for number, level in enumerate(levels):
        x = sine(0.008 + 0.001 * number, 1.5)
        stored(folder, f"{number}", x, damper(x) + level)
    found = [[f for f in entry.findings if f.check == "offset"] for entry in run(folder).entries]
    return [findings[0].follows if findings else "" for findings in found]


def test_an_offset_alike_in_all_files_is_a_preload_and_one_that_changes_a_tare(tmp_path: Path) -> None:
    assert all("as a preload or a gas force is" in said for said in offsets(tmp_path / "gas", [-150.0] * 4))
    said = offsets(tmp_path / "tare", [0.0, 0.0, 0.0, 120.0])
    assert said[:3] == ["", "", ""]
    assert "a tare that changed" in said[3]


@pytest.mark.parametrize("turned", [1.0, -1.0])
def test_offsets_that_go_with_the_speed_are_no_tare(tmp_path: Path, turned: float) -> None:
    """A gas force and a bleed that is stiffer one way: the mean force changes its sign from slow to fast tests.

    Two tests of one speed and other strokes need not be in order.
    """
    for number, speed in enumerate((0.05, 0.13, 0.26, 0.27, 0.39, 0.65, 1.0)):
        x = sine(0.01, speed / (2.0 * np.pi * 0.01))
        v = np.gradient(x, TIME)
        force = damper(x, gas=-120.0 * turned) + 300.0 * turned * np.abs(v) - 6.0 * turned * (speed == 0.27)
        stored(tmp_path, f"{number}", x, force)
    said = [f.follows for entry in run(tmp_path).entries for f in entry.findings if f.check == "offset"]
    assert len(said) >= 5
    assert all("no tare does that" in one for one in said)


@pytest.mark.parametrize("count", [3, 4])
def test_offsets_of_few_tests_that_go_with_the_speed_are_not_taken_out_as_a_tare(tmp_path: Path, count: int) -> None:
    """A rebound twice as stiff as compression was called a tare that changed, to be taken out of these files."""
    for number, speed in enumerate((0.03, 0.06, 0.13, 0.25)[-count:]):
        x = sine(0.02, speed / (2.0 * np.pi * 0.02))
        v = np.gradient(x, TIME)
        stored(tmp_path, f"{number}", x, np.where(v > 0.0, 250.0 + 1500.0 * v, -150.0 + 700.0 * v))
    said = [f.follows for entry in run(tmp_path).entries for f in entry.findings if f.check == "offset"]
    assert len(said) == count
    assert any("goes with the speed" in one for one in said)
    assert not any("take it out of these files" in one for one in said)


def test_offsets_that_go_with_the_force_are_no_tare(tmp_path: Path) -> None:
    """Friction that differs between rebound and compression, more of it in each test at about one speed."""
    for number, friction in enumerate((100.0, 180.0, 260.0, 330.0, 410.0, 480.0, 560.0)):
        x = sine(0.008, 1.5 + 0.01 * (number * 3 % 7))
        v = np.gradient(x, TIME)
        stored(tmp_path, f"{number}", x, friction * (np.tanh(v / 0.005) + 0.2 * np.abs(np.tanh(v / 0.005))))
    said = [f.follows for entry in run(tmp_path).entries for f in entry.findings if f.check == "offset"]
    assert len(said) == 7
    assert all("goes with the force" in one for one in said)


def delays(folder: Path) -> list[float]:
    return [f.size for entry in run(folder).entries for f in entry.findings if f.check == "delay"]


def test_a_hysteresis_is_no_delay_for_that_is_the_same_in_all_files(tmp_path: Path) -> None:
    """Kwok et al. 2006, eq. (1): alpha tanh(beta v + delta sign(x)); each file by itself would take it for a delay."""
    for frequency, amplitude in ((2.0, 0.01), (4.0, 0.005)):
        x = sine(amplitude, frequency)
        v = np.gradient(x, TIME)
        force = 500.0 * v + 150.0 * np.tanh(60.0 * v + 0.2 * np.tanh(x / 0.002))
        for folder in (tmp_path / "all", tmp_path / f"{frequency:g} Hz"):
            stored(folder, f"{frequency:g} Hz", x, force)
    alone = [delay for name in ("2 Hz", "4 Hz") for delay in delays(tmp_path / name)]
    assert len(alone) == 2
    assert abs(alone[0] - alone[1]) > 0.005
    assert delays(tmp_path / "all") == []


def test_a_delay_that_is_the_same_in_all_files_is_reported(tmp_path: Path, rng: np.random.Generator) -> None:
    for name in ("a", "b", "c"):
        one = record("random", rng, noise=0.01, delay=0.008)
        columns = {"time_s": one.time, "displacement_m": one.displacement, "force_N": one.force}
        write(tmp_path / f"{name}.csv", lines(columns))
    assert delays(tmp_path) == pytest.approx([0.008] * 3, abs=0.0015)


def test_a_file_with_force_and_displacement_both_turned_over_is_reported(tmp_path: Path) -> None:
    said = offsets(tmp_path, [-150.0, -150.0, -150.0, 150.0])
    assert "both turned over here" in said[3]


def test_a_damper_that_hardly_slips_has_no_wrong_sign(tmp_path: Path, rng: np.random.Generator) -> None:
    """Its line over the displacement has no area but that of the noise, which is as often negative as positive."""
    for number in range(6):
        x = sine(0.003, 1.5)
        stored(tmp_path, f"{number}", x, 2e5 * x + 20.0 * rng.standard_normal(x.size))
    works = [entry.work_J or 0.0 for entry in run(tmp_path).entries]
    assert min(works) < 0.0 < max(works)


def test_which_channel_is_turned_over_is_found_by_the_other_files_and_the_header_and_else_asked(
    tmp_path: Path,
) -> None:
    """Never by the mean force: rebound that is stiffer than compression would pass for a gas force, and be turned."""
    x = sine(0.01, 1.5)
    force = damper(x, gas=-200.0)
    for turned in ((x, -force), (-x, force)):
        stored(tmp_path / "alone", "a", *turned)
        (said,) = refused(tmp_path / "alone")
        assert "force or displacement has the wrong sign, or this is an active load and no damper" in said
        assert "say sign: {force: -1} where the displacement grows in rebound, or sign: {displacement: -1}" in said
    for turned, channel in (((x, -force - 100.0), "force"), ((-x, force + 100.0), "displacement")):
        stored(tmp_path / channel, "a", x, force + 100.0)
        stored(tmp_path / channel, "b", *turned)
        (said,) = refused(tmp_path / channel)
        assert "b.csv:2" in said
        assert f"{channel} has the wrong sign" in said
        assert "in the files whose work is right" in said
    plain = damper(x)
    write(tmp_path / "head" / "a.csv", lines({"time_s": TIME, "Einfederung [mm]": -1e3 * x, "force_N": plain}))
    entry = {"path": "a.csv", "columns": {"displacement": "Einfederung [mm]"}}
    assert "displacement has the wrong sign, since its header" in refused(tmp_path / "head", entry)[0]


def test_hints_of_one_rig_agree_over_its_files(tmp_path: Path) -> None:
    """Rebound is three times compression; of five files that are turned over one alone would be told otherwise."""
    x = sine(0.01, 1.5)
    v = np.gradient(x, TIME)
    right = np.where(v > 0.0, 3000.0, 1000.0) * v + 100.0 * np.sign(v)
    stored(tmp_path, "right", x, right)
    for number in range(4):
        stored(tmp_path, f"turned{number}", (0.7 + 0.1 * number) * x, -(0.7 + 0.1 * number) * right)
    stored(tmp_path, "odd", x, -(right - 1500.0))
    said = refused(tmp_path)
    assert len(said) == 5
    assert all("force has the wrong sign" in one and "say sign: {force: -1}" in one for one in said), said


def test_displacement_and_force_exchanged_are_told_as_such(tmp_path: Path, rng: np.random.Generator) -> None:
    x = sine(0.01, 1.5)
    force = damper(x) + rng.standard_normal(x.size)
    rows = {"time_s": TIME, "Weg [mm]": force / 10.0, "Kraft [N]": 1e3 * x}
    write(tmp_path / "a.csv", lines(rows))
    named = {"columns": {"displacement": "Weg [mm]", "force": "Kraft [N]"}}
    (said,) = refused(tmp_path, {"path": "a.csv"} | named)
    assert "displacement and force are exchanged" in said
    assert 'say columns: {displacement: "Kraft [N]", force: "Weg [mm]"}, with their units' in said
    exchanged = {"columns": {"displacement": "Kraft [N]", "force": "Weg [mm]"}}
    units = {"units": {"displacement": "mm", "force": "N"}}
    assert len(run(tmp_path, {"path": "a.csv"} | exchanged | units).records) == 1


@pytest.mark.parametrize(("asked", "left"), [("sss", 3), ("ss.", 2), ("s.", 0), ("s...", 0), ("r...", 1)])
def test_a_delay_that_most_tests_of_its_kind_do_not_ask_for_is_a_law_that_is_missing(asked: str, left: int) -> None:
    """A mount that slips asked for a quarter of a second in two sines of fifteen; a road shows what no sine does."""

    def entry(number: int, kind: str) -> RecordEntry:
        told = Finding(check="delay", where="the whole record", size=0.02, unit="s", follows="not corrected")
        wide = 4.0 if kind == "r" else 1.0
        return RecordEntry(
            name=str(number), setting=None, voltage_V=None, temperature_degC=None, rate_Hz=500.0, cycles=8.0,
            displacement_rms_m=0.01, velocity_rms_m_per_s=0.1, acceleration_rms_m_per_s2=wide,
            findings=() if kind == "." else (told,),
        )  # fmt: skip

    entries = tuple(entry(*each) for each in enumerate(asked))
    assert sum(len(one.findings) for one in drop_contradicting_delays(entries)) == left
