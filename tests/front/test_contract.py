"""The front door takes what a stranger has and gives what the contract shows; a mistake is told with what to do."""

from __future__ import annotations

import importlib
import json
import pickle
import pkgutil
import re
import subprocess
import sys
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pandas as pd
import pytest
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import pzd
from pzd.damper.compose import steady_force
from pzd.front.results import Result

mpl.use("Agg")

CONTROL = ("current", "A")
FUNCTIONS = ("read", "identify", "diagnose", "changes", "table", "ride", "rate", "run", "load")


def sine(seconds: float = 4.0, rate: float = 500.0) -> dict[str, np.ndarray]:
    """F = 300 sign(v) + 1000 v, the first sentence of every damper book."""
    time = np.arange(round(seconds * rate)) / rate
    velocity = 0.02 * 3.0 * np.pi * np.cos(3.0 * np.pi * time)
    displacement = 0.02 * np.sin(3.0 * np.pi * time)
    return {"time": time, "displacement": displacement, "force": 300.0 * np.sign(velocity) + 1000.0 * velocity}


# ---------------------------------------------------------------- the door itself


def test_no_module_takes_the_place_of_a_function() -> None:
    for found in pkgutil.walk_packages(pzd.__path__, "pzd."):
        if not found.name.endswith("__main__"):
            importlib.import_module(found.name)
    for name in FUNCTIONS:
        assert callable(getattr(pzd, name)), name
    test = pzd.Test(**sine(), voltage=100.0)
    with pytest.raises(TypeError, match=r"pzd\.Test"):
        pzd.identify(test.time)
    with pytest.raises(TypeError, match="damper"):
        pzd.table(test)
    assert pzd.rate(test.acceleration, 500.0).a_w > 0.0


def test_all_that_is_offered_is_there_and_nothing_else_is_imported() -> None:
    assert {*FUNCTIONS, "Test", "Damper"} == {*pzd.__all__}
    for name in pzd.__all__:
        assert getattr(pzd, name).__name__ == name
    code = "import sys, pzd; print(sorted({'numpy', 'pandas', 'numba', 'scipy', 'matplotlib'} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
    with pytest.raises(AttributeError, match="nothing"):
        _ = pzd.nothing


def test_pytest_does_not_collect_a_test_of_a_damper() -> None:
    assert pzd.Test.__test__ is False


# ---------------------------------------------------------------- what a test may be made of


@pytest.mark.parametrize(
    "made",
    [
        lambda values: values.tolist(),
        lambda values: pd.Series(values, index=np.arange(values.size) + 7),
        lambda values: values[:, np.newaxis],
        lambda values: pd.DataFrame({"only": values}),
        lambda values: np.repeat(values, 2)[::2],
        lambda values: pd.Series(values).astype("Float64"),
    ],
    ids=["list", "Series", "column", "DataFrame", "strided", "nullable"],
)
def test_arrays_of_any_kind_make_the_same_test(made) -> None:
    arrays = sine()
    test = pzd.Test(*(made(values) for values in arrays.values()), voltage=100)
    for name, values in arrays.items():
        np.testing.assert_array_equal(getattr(test, name), values)
    np.testing.assert_array_equal(test.voltage, np.full(values.size, 100.0))
    assert test.temperature is None


def test_whole_numbers_are_numbers() -> None:
    arrays = sine()
    whole = arrays["force"].astype(int)
    test = pzd.Test(arrays["time"], arrays["displacement"], whole, voltage=np.int64(3), temperature=22)
    assert (test.force.dtype, test.temperature[0]) == (np.float64, 22.0)
    np.testing.assert_array_equal(test.force, whole)


def test_a_velocity_that_is_given_is_taken_as_recorded() -> None:
    arrays = sine()
    given = 0.06 * np.pi * np.cos(3.0 * np.pi * arrays["time"])
    assert np.array_equal(pzd.Test(**arrays, velocity=given).velocity, given)
    derived = pzd.Test(**arrays).velocity
    assert not np.array_equal(derived, given)
    assert np.max(np.abs(derived - given)) < 1e-3 * np.max(given)


def test_what_was_given_may_change_afterwards() -> None:
    arrays = sine()
    test = pzd.Test(**arrays)
    arrays["force"] *= 0.0
    assert np.max(np.abs(test.force)) > 300.0


def test_the_channels_of_a_test_are_not_changed_in_place() -> None:
    test = pzd.Test(**sine())
    before = test.force.copy()
    with pytest.raises(ValueError, match="read-only"):
        test.force -= 50.0
    np.testing.assert_array_equal(test.force, before)


def test_what_looks_wrong_is_told_with_the_test() -> None:
    arrays = sine()
    assert "check the units" not in repr(pzd.Test(**arrays))
    assert "peak force" in repr(pzd.Test(**arrays | {"force": 1e-3 * arrays["force"]}))
    assert "degC, degF or K" in repr(pzd.Test(**arrays, temperature=295.0))


def test_a_short_and_coarse_record_is_a_test() -> None:
    """Cycles of twelve samples are too few to be compared in parts."""
    time = np.arange(36) / 24.0
    assert pzd.Test(time, 0.03 * np.sin(4.0 * np.pi * time), 500.0 * np.cos(4.0 * np.pi * time)).time.size == 36


CHANGES = {
    "force of the wrong sign": ({"force": lambda a: -a["force"]}, ValueError, r"pass force=-force"),
    "millimetres": ({"displacement": lambda a: 1000.0 * a["displacement"]}, ValueError, r"pass displacement in SI"),
    "decreasing time": ({"time": lambda a: a["time"][::-1]}, ValueError, "time does not increase"),
    "lengths": ({"force": lambda a: a["force"][:-1]}, ValueError, "as many as the first array"),
    "NaN": ({"force": lambda a: np.where(a["time"] > 3.0, np.nan, a["force"])}, ValueError, "index 1501"),
    "masked": ({"force": lambda a: np.ma.masked_greater(a["force"], 300.0)}, ValueError, "no finite number"),
    "two columns": ({"force": lambda a: np.column_stack([a["force"]] * 2)}, ValueError, "one column"),
    "text": ({"force": lambda a: "force"}, TypeError, "array of numbers"),
    "texts": ({"force": lambda a: ["1"] * 2000}, TypeError, "must be numbers"),
    "None": ({"force": lambda a: None}, TypeError, "array of numbers"),
    "dates": ({"time": lambda a: a["time"].astype("datetime64[s]")}, TypeError, "give seconds"),
    "complex": ({"force": lambda a: 1j * a["force"]}, TypeError, "must be numbers"),
    "ragged": ({"force": lambda a: [[1.0], [1.0, 2.0]]}, TypeError, "array of numbers"),
    "text as voltage": ({"voltage": lambda a: "100 V"}, TypeError, "voltage"),
    "NaN as voltage": ({"voltage": lambda a: np.nan}, ValueError, "voltage"),
    "bool as voltage": ({"voltage": lambda a: True}, TypeError, "voltage"),
    "short voltage": ({"voltage": lambda a: [1.0, 2.0]}, ValueError, "voltage"),
    "number as name": ({"name": lambda a: 3}, TypeError, "name"),
    "number as setting": ({"setting": lambda a: 3}, TypeError, "setting"),
    "constant force": ({"force": lambda a: 0.0 * a["force"]}, ValueError, "force is constant"),
    "one way": ({"displacement": lambda a: 0.1 * a["time"]}, ValueError, "reversals"),
    "nothing": ({"time": lambda a: [], "displacement": lambda a: [], "force": lambda a: []}, ValueError, "2 samples"),
    "numbers of samples": ({"time": lambda a: np.arange(2000)}, ValueError, "pass time in seconds"),
}


@pytest.mark.parametrize(("change", "error", "words"), CHANGES.values(), ids=CHANGES)
def test_a_faulty_test_is_refused_where_it_is_made(change, error: type[Exception], words: str) -> None:
    arrays = sine()
    with pytest.raises(error, match=words):
        pzd.Test(**{**arrays, **{name: made(arrays) for name, made in change.items()}})


NO_KEYS = re.compile(r"rate_Hz|split:|columns:|units:|sign:")
"""What only a file can be given."""


@pytest.mark.parametrize(
    ("change", "advice", "remedy"),
    [
        ({"force": lambda a: -a["force"]}, "pass force=-force where the displacement grows in rebound", {}),
        ({"displacement": lambda a: 1e3 * a["displacement"]}, "pass displacement in SI, not in mm", {}),
        ({"time": lambda a: np.arange(2000)}, "pass time in seconds, which are numbers of samples over samples", {}),
        ({"time": lambda a: 0.1 * np.floor(a["time"] / 0.1)}, "too few digits; pass time in seconds, which are", {}),
        ({"time": lambda a: a["time"] + 1e5 * (a["time"] > 2.0)}, "make a pzd.Test of each part", {"rows": 900}),
        (
            {"displacement": lambda a: a["force"] / 1e4, "force": lambda a: 1e3 * a["displacement"]},
            "exchanged, since the displacement is rough and the force smooth; pass each as the other",
            {},
        ),
    ],
    ids=["sign", "units", "counting", "digits", "two tests", "exchanged"],
)
def test_advice_about_a_file_is_worded_for_arrays_and_then_accepted(
    change, advice: str, remedy: dict[str, int], rng: np.random.Generator
) -> None:
    arrays = sine()
    if "exchanged" in advice:  # a rough force, as any that is measured
        arrays["force"] = arrays["force"] + rng.standard_normal(arrays["force"].size)
    with pytest.raises(ValueError, match=re.escape(advice)) as caught:
        pzd.Test(**{**arrays, **{name: made(arrays) for name, made in change.items()}})
    assert not NO_KEYS.search(str(caught.value))
    rows = slice(remedy.get("rows"))
    assert pzd.Test(**{name: values[rows] for name, values in arrays.items()}).force.max() > 300.0


def test_the_advice_of_a_refusal_is_accepted() -> None:
    arrays = sine()
    assert pzd.Test(arrays["time"], arrays["displacement"], force=arrays["force"]).force.max() > 300.0
    assert pzd.Test(arrays["time"], 20.0 * arrays["displacement"] / 1000.0, arrays["force"]).displacement.max() < 1e-3


# ---------------------------------------------------------------- files


def test_files_are_named_by_a_path_a_pattern_or_a_list(rig_files: Path) -> None:
    from rig_in_files import ENTRY

    files = sorted(rig_files.glob("*.csv"))
    keys = {"control": CONTROL, **ENTRY}
    assert [test.name for test in pzd.read(files[0], **keys)] == [files[0].stem]
    assert [test.name for test in pzd.read(str(files[0]), **keys)] == [files[0].stem]
    every = [path.stem for path in files]
    assert [test.name for test in pzd.read(files, **keys)] == every
    assert [test.name for test in pzd.read(str(rig_files / "*.csv"), **keys)] == every
    one = pzd.read(files[0], **keys)[0]
    assert (one.setting, one.record.median_voltage()) == ("new", 0.0)


@pytest.mark.parametrize(
    ("path", "keys", "error", "words"),
    [
        ("nowhere/*.csv", {}, ValueError, "no such file"),
        ([], {}, ValueError, "no file is named"),
        (3, {}, TypeError, "must be a path"),
        ([3], {}, TypeError, "must be a path"),
        ("*.csv", {"colums": {}}, ValueError, "did you mean columns"),
        ("*.csv", {"sign": {"force": 2}}, ValueError, "sign.force"),
        ("*.csv", {"columns": pd.DataFrame()}, TypeError, "columns"),
        ("quickstart.yaml", {}, ValueError, r"pzd\.run\('quickstart\.yaml'\) runs it"),
    ],
)
def test_a_mistake_in_reading_is_told(path, keys, error: type[Exception], words: str) -> None:
    with pytest.raises(error, match=words) as told:
        pzd.read(path, **keys)
    assert "rig.files" not in str(told.value)


def test_headers_that_a_guess_understands_are_refused_with_the_call_that_reads_them(tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    arrays = sine()
    for warm in (72, 104):
        rows = zip(arrays["time"], 1e3 * arrays["displacement"], arrays["force"], strict=True)
        text = "".join(f"{t:.6g},{x:.6g},{f:.6g}\n" for t, x, f in rows)
        (tmp_path / f"run_{warm}F.csv").write_text(f"time_s,Stroke [mm],Load [N]\n{text}", encoding="utf-8")
    for paths in ("*.csv", ["run_72F.csv", "run_104F.csv"]):
        with pytest.raises(ValueError, match="as the headers suggest") as told:
            pzd.read(paths)
        call = str(told.value).rpartition("None: ")[2]
        tests = eval(call)  # the advice is followed to the letter
        assert sorted(test.record.median_temperature() for test in tests) == pytest.approx([22.22, 40.0], abs=0.01)
        assert max(test.displacement.max() for test in tests) == pytest.approx(arrays["displacement"].max(), rel=1e-5)


# ---------------------------------------------------------------- stages


def test_one_test_without_a_voltage_is_a_condition() -> None:
    fit = pzd.identify(pzd.Test(**sine()), law="bingham")
    assert len(fit.parameters) == 1
    assert np.isnan(fit.parameters["voltage_V"][0])
    row = fit.parameters.iloc[0]
    assert (row.T0_N, row.C_Ns_per_m) == (pytest.approx(300.0, rel=0.1), pytest.approx(1000.0, rel=0.2))
    assert fit.damper.curve([0.1])[0] == pytest.approx(400.0, rel=0.05)


def test_tests_without_names_are_numbered_and_equal_names_refused() -> None:
    tests = [pzd.Test(**sine(), voltage=voltage) for voltage in (0.0, 100.0)]
    assert [row.record for row in pzd.identify(tests).identified.measures] == ["test-1", "test-2"]
    with pytest.raises(ValueError, match="two tests are called a"):
        pzd.identify([pzd.Test(**sine(), name="a"), pzd.Test(**sine(), name="a")])


def test_of_several_settings_one_must_be_chosen() -> None:
    tests = [pzd.Test(**sine(), setting=setting, name=setting) for setting in ("new", "aged")]
    fit = pzd.identify(tests)
    assert list(fit.parameters["setting"]) == ["aged", "new"]
    with pytest.raises(ValueError, match=r"several, say which one.*aged, new"):
        _ = fit.damper
    assert pzd.identify(tests, setting="new").damper.voltages == ()
    with pytest.raises(ValueError, match="did you mean new"):
        pzd.identify(tests, setting="nuw")


@pytest.mark.parametrize(
    ("change", "error", "words"),
    [
        ({"law": "bingam"}, ValueError, "did you mean bingham"),
        ({"lew": 1}, ValueError, "no such key; did you mean law"),
        ({"control": "voltage"}, TypeError, "name and unit"),
        ({"control": ("force", "N")}, ValueError, "another channel"),
        ({"tests": []}, ValueError, "no test"),
        ({"tests": [1]}, TypeError, r"pzd\.Test"),
        ({"tests": pd.DataFrame()}, TypeError, r"pzd\.Test"),
        ({"tests": None}, TypeError, r"pzd\.Test"),
        ({"setting": 3}, TypeError, "setting"),
    ],
)
def test_a_mistake_in_a_stage_is_told(change, error: type[Exception], words: str) -> None:
    with pytest.raises(error, match=words):
        pzd.identify(**{"tests": [pzd.Test(**sine())], **change})


def test_every_result_is_shown_as_text_table_and_plot(tests: list[pzd.Test], hidden: pzd.Damper) -> None:
    found = pzd.diagnose(tests, control=CONTROL)
    results = [tests[0], hidden, pzd.identify(tests, control=CONTROL), found, pzd.table(found.damper)]
    results += [pzd.ride(found.damper, duration=2.0), pzd.rate(tests[0].acceleration, 500.0)]
    for result in results:
        assert isinstance(result, Result)
        assert 1 <= len(repr(result).splitlines()) <= 24, type(result)
        assert len(result.to_frame()) >= 1
        assert "<table" in result._repr_html_()
        ax = Figure().subplots()
        assert result.plot(ax) is ax
        assert isinstance(ax, Axes)
        assert ax.get_xlabel()
        assert ax.lines
    assert isinstance(results[0].plot(), Axes)
    plt.close("all")
    assert json.dumps(found.as_dict())


# ---------------------------------------------------------------- dampers


def test_the_curve_is_the_law_and_the_force_of_a_slow_motion_follows_it(hidden: pzd.Damper) -> None:
    velocity = [-0.3, -0.1, 0.1, 0.3]
    curve = hidden.curve(velocity, voltage=1.5)
    expected = np.sign(velocity) * (800.0 + 3000.0 * np.abs(velocity) + 2500.0 * np.square(velocity))
    np.testing.assert_allclose(curve, expected, rtol=1e-9)
    np.testing.assert_array_equal(curve, steady_force(hidden.model, 1.5, None, np.array(velocity)))
    time = np.arange(4001) / 1000.0
    force = hidden.force(time, 0.1 * time, voltage=1.5)
    assert force.shape == time.shape
    assert force[0] == 0.0
    assert force[-1] == pytest.approx(expected[2], rel=1e-6)


def test_the_control_signal_may_be_given_by_its_own_name(hidden: pzd.Damper) -> None:
    time, by_name = np.arange(400) / 1000.0, {hidden.control.name: 1.5}
    assert hidden.control.name == "current"
    np.testing.assert_array_equal(hidden.force(time, 0.1 * time, **by_name), hidden.force(time, 0.1 * time, 1.5))
    np.testing.assert_array_equal(hidden.curve([0.1, -0.2], **by_name), hidden.curve([0.1, -0.2], 1.5))
    with pytest.raises(TypeError, match="pressure"):
        hidden.force(time, 0.1 * time, pressure=1.5)  # type: ignore[call-arg]  # as a user mistypes it


@pytest.mark.parametrize("stiffness", [2e5, 2e6, 2e7])
def test_the_noise_of_a_displacement_is_no_motion_of_a_stiff_oil_spring(
    stiffness: float, rng: np.random.Generator
) -> None:
    """10 um of it moved a spring of 2e6 N/m by 20 N, and the force of a test was predicted worse than it was known."""
    damper = pzd.Damper({"T0_N": 80.0, "C_Ns_per_m": 1500.0, "k_N_per_m": stiffness})
    time = np.arange(4000) / 500.0
    x, v = 0.012 * np.sin(4.0 * np.pi * time), 0.012 * 4.0 * np.pi * np.cos(4.0 * np.pi * time)
    known, measured = damper.force(time, x, velocity=v), damper.force(time, x + 1e-5 * rng.standard_normal(time.size))
    settled = slice(500, None)
    assert np.sum((measured - known)[settled] ** 2) < 3e-4 * np.sum(known[settled] ** 2)


@pytest.mark.parametrize("rate", [100.0, 1000.0])
def test_a_step_and_a_corner_of_a_displacement_are_no_noise(rate: float) -> None:
    """k x to the moment, up to T0 and less than C; a triangle reaches T0 + C v on both flanks."""
    damper = pzd.Damper({"T0_N": 300.0, "C_Ns_per_m": 1500.0, "k_N_per_m": 2e5})
    time = np.arange(int(4.0 * rate)) / rate
    step = damper.force(time, 1e-3 * (time > 2.0))
    assert np.max(step) == pytest.approx(200.0, rel=1e-3)
    turned = np.abs((time + 0.25) % 1.0 - 0.5) - 0.25
    force = damper.force(time, -0.08 * turned)
    assert np.max(np.abs(force[time > 1.0])) == pytest.approx(300.0 + 1500.0 * 0.08, rel=0.02)


def test_the_force_is_that_of_the_stand_or_without_the_delay_of_its_sensors() -> None:
    """A car has no load cell that is late."""
    row, time = {"T0_N": 300.0, "C_Ns_per_m": 1500.0, "k_N_per_m": 2e5}, np.arange(2000) / 500.0
    x = 0.01 * np.sin(2.0 * np.pi * time)
    late = pzd.Damper(row, effects={"sensor_delay": {"tau": 0.01}})
    recorded, at_the_rod = late.force(time, x), late.force(time, x, as_recorded=False)
    np.testing.assert_allclose(at_the_rod, pzd.Damper(row).force(time, x), rtol=1e-9)
    np.testing.assert_allclose(recorded[505:], at_the_rod[500:-5], atol=1.0)


def test_a_voltage_may_be_a_number_or_move_and_must_be_given_where_it_matters(hidden: pzd.Damper) -> None:
    time = np.arange(1000) / 500.0
    x = 0.01 * np.sin(2.0 * np.pi * time)
    as_number, as_array = hidden.force(time, x, voltage=1.5), hidden.force(time, x, voltage=np.full(1000, 1.5))
    np.testing.assert_array_equal(as_number, as_array)
    switched = hidden.force(time, x, voltage=np.where(time < 1.0, 0.0, 1.5))
    assert np.max(np.abs(switched[-400:])) == pytest.approx(np.max(np.abs(as_number[-400:])), rel=0.02)
    with pytest.raises(ValueError, match=r"current: the damper depends on it.*0, 1\.5 A"):
        hidden.force(time, x)
    with pytest.raises(ValueError, match="time does not increase"):
        hidden.force(time[::-1], x, voltage=1.5)
    with pytest.raises(ValueError, match="as many as the first array"):
        hidden.force(time, x[:-1], voltage=1.5)
    single = pzd.Damper({"T0_N": 300.0, "C_Ns_per_m": 2700.0, "k_N_per_m": 2e5})
    assert single.curve([1.0])[0] == pytest.approx(3000.0)


def test_results_are_pickled_and_frames_are_copies(tests: list[pzd.Test]) -> None:
    found = pzd.identify(tests, control=CONTROL)
    again = pickle.loads(pickle.dumps(found))
    assert repr(again) == repr(found)
    assert repr(pickle.loads(pickle.dumps(found.damper))) == repr(found.damper)
    frame = found.parameters
    frame["T0_N"] = 0.0
    pd.testing.assert_frame_equal(found.parameters, again.parameters)


def test_a_damper_is_made_of_its_own_frame(hidden: pzd.Damper) -> None:
    again = pzd.Damper(hidden.to_frame(), hidden.effects, control=CONTROL)
    pd.testing.assert_frame_equal(again.to_frame(), hidden.to_frame())
    rigid = pzd.Damper({"T0_N": 300.0, "C_Ns_per_m": 1000.0, "k_N_per_m": np.inf})
    assert repr(pzd.Damper(rigid.to_frame())) == repr(rigid)


def test_what_lies_beyond_the_known_is_warned_of(hidden: pzd.Damper) -> None:
    """A recorded signal may lie beyond by its noise."""
    assert hidden.curve([0.1], voltage=1.51) == hidden.curve([0.1], voltage=1.5)
    for beyond in (1.6, -0.5, 1e6):
        with pytest.warns(UserWarning, match=r"current: .* beyond what the damper is known at, 0 to 1\.5 A"):
            hidden.curve([0.1], voltage=beyond)


@pytest.mark.parametrize(
    ("argument", "scale", "words"), [(0, 1000.0, "millimetres"), (1, 1.0, "5 samples at least")], ids=["mm", "short"]
)
def test_a_motion_that_is_none_of_a_damper_is_refused(argument: int, scale: float, words: str, hidden) -> None:
    arrays = sine()
    part = slice(None) if argument == 0 else slice(3)
    with pytest.raises(ValueError, match=words):
        hidden.force(arrays["time"][part], scale * arrays["displacement"][part], voltage=0.0)


@pytest.mark.parametrize(("jobs", "error"), [("2", TypeError), (True, TypeError), (0, ValueError), (-1, ValueError)])
def test_a_number_of_processes_is_whole_and_positive(jobs, error: type[Exception], tests: list[pzd.Test]) -> None:
    with pytest.raises(error, match="jobs"):
        pzd.identify(tests, control=CONTROL, jobs=jobs)


def test_several_axes_are_not_the_axes_to_draw_on(hidden: pzd.Damper) -> None:
    with pytest.raises(TypeError, match=r"axs\[0\]"):
        hidden.plot(np.array([1, 2]))


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ([{"T0_N": -1.0, "C_Ns_per_m": 1.0, "k_N_per_m": 1.0}], "T0_N"),
        ([{"C_Ns_per_m": 1.0, "k_N_per_m": 1.0}], "T0_N: is missing"),
        ([{"T0_N": 1.0, "C_Ns_per_m": 1.0, "k_N_per_m": 1e5}, {"orifice_quadratik": {"q": 1.0}}], "orifice_quadratic"),
    ],
)
def test_a_damper_that_cannot_be_is_refused(arguments, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        pzd.Damper(*arguments)


@pytest.mark.parametrize(
    ("keys", "error", "words"),
    [
        ({"road": "sin"}, ValueError, "did you mean sine"),
        ({"policy": "pasive"}, ValueError, "no policy is called"),
        ({"policy": 3}, TypeError, "policy"),
        ({"car": "none"}, ValueError, "no car is called"),
        ({"fidelity": "real"}, ValueError, "ideal, table, dynamic"),
        ({"voltage": 9.0}, ValueError, "within the table"),
        ({"duration": -1.0}, ValueError, "greater than 0"),
        ({"duration": "long"}, TypeError, "duration"),
        ({"damper": 3}, TypeError, r"pzd\.Damper"),
    ],
)
def test_a_mistake_in_a_ride_is_told(keys, error: type[Exception], words: str, hidden: pzd.Damper) -> None:
    with pytest.raises(error, match=words):
        pzd.ride(**{"damper": hidden, **keys})


def test_a_stiffer_setting_of_the_ride_moves_the_car_more(hidden: pzd.Damper) -> None:
    soft, hard = (pzd.ride(hidden, voltage=voltage, fidelity="table", duration=4.0) for voltage in (0.0, 1.5))
    assert hard.summary["peak_deflection_m"] < soft.summary["peak_deflection_m"]
    assert set(soft.history["current_1_A"]) == {0.0}
    assert soft.a_w == soft.to_frame()["a_w_m_per_s2"][0]


def test_a_folder_without_a_run_and_a_config_that_is_none_are_told(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="holds no run"):
        pzd.load(tmp_path)
    with pytest.raises(ValueError, match="the file is missing"):
        pzd.run(tmp_path / "none.yaml")
    with pytest.raises(TypeError, match="config"):
        pzd.run(3)


@pytest.mark.parametrize(
    ("keys", "error", "words"),
    [
        ({"overrides": "seed=2"}, TypeError, "overrides: must be a list"),
        ({"until": "identfy"}, ValueError, "until: must be one of run, synthesise, identify"),
        ({"jobs": 0}, ValueError, "jobs"),
    ],
)
def test_a_mistake_in_a_run_is_told(keys, error: type[Exception], words: str, root: Path, tmp_path: Path) -> None:
    with pytest.raises(error, match=words):
        pzd.run(root / "configs/quickstart.yaml", tmp_path, **keys)


# ---------------------------------------------------------------- changes


def test_what_changed_is_named_with_its_size(tests: list[pzd.Test], arrays, generator_for) -> None:
    rng = generator_for("second state of the front door")
    aged = [
        pzd.Test(
            **{**each, "force": each["force"] - 40.0 + 5.0 * rng.standard_normal(each["force"].size), "setting": "aged"}
        )
        for each in arrays
    ]
    what = pzd.changes(tests, aged, control=CONTROL)
    assert {what.verdict, *what.changes["name"], *what.rivals} & {"preload_offset", "load_cell_zero"}
    assert (what.as_dict()["from"], what.as_dict()["to"]) == ("new", "aged")
    found = what.changes.iloc[0]
    assert found["to"] - found["from"] == pytest.approx(-40.0, abs=2.0)
    assert what.plot(Figure().subplots()).lines
    assert json.dumps(what.as_dict())
    with pytest.raises(TypeError, match="tests_after"):
        pzd.changes(tests, 3)


def test_a_control_signal_in_one_state_alone_is_no_comparison(arrays) -> None:
    with_current, without = (
        [pzd.Test(**{**each, "setting": "new", **more}) for each in arrays[:2]] for more in ({}, {"voltage": None})
    )
    with pytest.raises(ValueError, match="before: its tests have no current"):
        pzd.changes(without, with_current, control=CONTROL)


def test_the_changes_are_those_of_the_command(arrays, tmp_path: Path) -> None:
    import yaml

    from pzd.cli.app import status

    tests = [pzd.Test(**each) for each in arrays]
    aged = [pzd.Test(**{**each, "force": 1.3 * each["force"], "name": f"aged-{each['name']}"}) for each in arrays]
    for name, state in (("new", tests), ("aged", aged)):
        (tmp_path / name).mkdir()
        for test in state:
            frame = test.to_frame().rename(columns={"voltage_V": "current_A"})
            frame.to_csv(tmp_path / name / f"{test.name}.csv", index=False)
        config = {"control": {"name": "current", "unit": "A"}, "rig": {"files": [{"path": f"{name}/*.csv"}]}}
        (tmp_path / f"{name}.yaml").write_text(yaml.safe_dump(config))
    states = [pzd.read(str(tmp_path / name / "*.csv"), control=CONTROL) for name in ("new", "aged")]
    what = pzd.changes(*states, control=CONTROL).as_dict()
    done = status(["changes", str(tmp_path / "new.yaml"), str(tmp_path / "aged.yaml"), "--runs", str(tmp_path), "-q"])
    assert done == 0
    (file,) = (tmp_path / "aged" / "changes").glob("[!.]*.json")
    written = json.loads(file.read_text())
    named = {"from": "new", "to": "aged"}
    assert {**json.loads(json.dumps(what)), **named, "reason": ""} == {**written, **named, "reason": ""}
