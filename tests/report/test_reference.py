"""A laboratory's own expected numbers beside those of a run, and every mistake in their file with its place."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from pzd.artefacts import Identified, MeasureRow, ParameterRow, ReferenceRow, SummaryRow
from pzd.comfort.iso2631_1978 import FACTORS
from pzd.quantities import Control, Quantity
from pzd.report.config import ReportConfig
from pzd.report.reference import Expected, compared, evaluated, file_of, read_reference, same_test, terms
from pzd.report.ride_comfort import assess, rated
from pzd.report.run_numbers import UNITS, RunNumbers
from pzd.schema.errors import ConfigError, DataError
from pzd.simulate.config import SimulateConfig

VOLTS = Control()
PAPER = SimulateConfig(c_min_Ns_per_m=750.0, c_max_Ns_per_m=45000.0)
TEST = "gap 0.25 mm,{},22,2,0.03"
HEAD = "id,setting,voltage_V,temperature_degC,frequency_Hz,amplitude_m,selector,value,unit,tolerance\n"


def written(folder: Path, text: str) -> Path:
    path = folder / "lab.csv"
    path.write_text(text, encoding="utf-8")
    return path


def faults(folder: Path, text: str, control: Control = VOLTS) -> list[str]:
    path = written(folder, text)
    with pytest.raises(DataError) as caught:
        read_reference(path, control)
    return [message.replace(f"{folder}/", "") for message in caught.value.messages]


@pytest.fixture(scope="module")
def numbers(run: Any) -> RunNumbers:
    config = ReportConfig(editions=("ISO 2631-1:1997", "ISO 2631:1978", "Directive 2002/44/EC"))
    comfort = tuple(row for ride in rated(run.rides) for row in assess(ride, config))
    on = run.identified.measures[0]
    measures = (
        on,
        on.model_copy(update={"record": "r01", "voltage_V": 149.6, "peak_force_N": 2940.0}),
        on.model_copy(update={"record": "r02", "frequency_Hz": 1.0, "peak_force_N": 870.0}),
    )
    return RunNumbers(Identified(run.identified.rows, measures), run.rides, comfort, PAPER, VOLTS)


def rows_of(folder: Path, numbers: RunNumbers, text: str) -> dict[str, ReferenceRow]:
    return {row.id: row for row in compared(read_reference(written(folder, text), numbers.control), numbers)}


# ---------------------------------------------------------------- what is found


def test_a_laboratorys_numbers_stand_beside_those_of_the_run(tmp_path: Path, numbers: RunNumbers) -> None:
    found = rows_of(
        tmp_path,
        numbers,
        HEAD
        + f"off,{TEST.format(0)},measures.peak_force_N,1500,N,0.02\n"
        + f"on,{TEST.format(150)},measures.peak_force_N,2.5,kN,0.02\n"
        + "T0,gap 0.25 mm,0,,,,parameters.T0_N,470,N,\n"
        + "rise,,,,,,100 * ([on] * 1000 / [off] - 1),90,percent,0.1\n",
    )
    assert list(found) == ["off", "on", "T0", "rise"]
    assert found["off"].computed == 1514.0
    assert found["off"].ratio == pytest.approx(1514.0 / 1500.0)
    assert "test r00" in found["off"].note
    assert "; within the tolerance of 0.02: off by +0.00933" in found["off"].note
    assert found["on"].computed == pytest.approx(2.94)
    assert "NOT within the tolerance of 0.02: off by +0.176" in found["on"].note
    assert found["T0"].computed == 474.0
    assert "95 % 465 to 485, ok" in found["T0"].note
    assert found["rise"].computed == pytest.approx(100.0 * (2940.0 / 1514.0 - 1.0))
    assert "of on 2.94 kN, off 1514 N; within the tolerance" in found["rise"].note


def test_rides_and_their_comfort_are_named_by_road_policy_and_fidelity(tmp_path: Path, numbers: RunNumbers) -> None:
    found = rows_of(
        tmp_path,
        numbers,
        "id,road,frequency_Hz,policy,fidelity,case,selector,value,unit\n"
        "by-name,sine-2.25Hz,,comfort,table,,summary.peak_abs_aK_m_per_s2,1,m/s2\n"
        "by-frequency,,2.25,comfort,table,,summary.peak_abs_aK_m_per_s2,1,m/s2\n"
        "plain,,,,,sine-4.5Hz-comfort-dynamic-plain,summary.rms_aK_m_per_s2,1,m/s2\n"
        "a_w,,4.5,constant,ideal,,comfort.a_w,1,m/s2\n"
        "hours,,2.25,comfort,ideal,,comfort.exposure_time_reduced_comfort,9,h\n"
        "many,,2.25,,ideal,,comfort.a_w,1,m/s2\n"
        "other,,3,,ideal,,comfort.a_w,1,m/s2\n",
    )
    summary = {row.case: row for row in numbers.rides.summary}
    assert found["by-name"].computed == summary["sine-2.25Hz-comfort-table"].peak_abs_aK_m_per_s2
    assert found["by-frequency"].computed == found["by-name"].computed
    assert "; ideal 0." in found["by-name"].note
    assert found["plain"].computed == summary["sine-4.5Hz-comfort-dynamic-plain"].rms_aK_m_per_s2
    values = {(row.case, row.measure): row.value for row in numbers.comfort}
    assert found["a_w"].computed == values["sine-4.5Hz-constant-ideal", "a_w"]
    minutes = values["sine-2.25Hz-comfort-ideal", "exposure_time_reduced_comfort"]
    assert minutes is not None
    assert found["hours"].computed == pytest.approx(minutes / 60.0)
    assert "unverified transcription" in found["hours"].note
    assert (found["many"].computed, found["other"].computed) == (None, None)
    assert "2 rides meet this" in found["many"].note
    assert found["many"].note.endswith("give policy")
    assert found["other"].note == "the run has no such ride"


def test_what_the_run_lacks_says_why(tmp_path: Path, numbers: RunNumbers) -> None:
    found = rows_of(
        tmp_path,
        numbers,
        HEAD
        + f"cold,{TEST.format(0).replace('22', '-10')},measures.peak_force_N,1500,N,0.02\n"
        + "open,gap 0.25 mm,0,,,,measures.peak_force_N,1500,N,\n"
        + "k,gap 0.25 mm,150,,,,parameters.k_N_per_m,280000,N/m,\n"
        + "ratio,,,,,,[cold] / [T0],1,-,\n"
        + "T0,gap 0.25 mm,0,,,,parameters.T0_N,470,N,\n"
        + "step,,,,,,response.force_to_90_percent_s,9,ms,\n"
        + "price,,,,,,,100,EUR,\n"
        + "by-hand,,,,,,2 * 3,7,-,\n",
    )
    assert {name for name, row in found.items() if row.computed is None} == set(found) - {"T0", "by-hand"}
    assert found["cold"].note == "the rig has no test at gap 0.25 mm, 0 V, -10 °C, 2 Hz, 0.03 m"
    assert found["open"].note == "2 tests meet this (r00, r02): give frequency_Hz"
    assert "undetermined: k" in found["k"].note
    assert found["ratio"].note.startswith("cold: the rig has no test")
    assert "no such response" in found["step"].note
    assert found["price"].note == "no selector: the run computes no such number"
    assert (found["by-hand"].computed, found["by-hand"].ratio) == (6.0, pytest.approx(6.0 / 7.0))
    assert "not computed by the run" in found["by-hand"].note


def test_a_range_and_a_zero_have_no_ratio(tmp_path: Path, numbers: RunNumbers) -> None:
    found = rows_of(
        tmp_path,
        numbers,
        "id,selector,value,unit,tolerance\nrange,simulate.mass_kg,1000-1300,kg,0.1\nzero,simulate.x_K_m,0,m,0.1\n",
    )
    assert [(row.expected, row.ratio) for row in found.values()] == [("1000-1300", None), (0.0, None)]
    assert all(row.computed is not None for row in found.values())


def test_several_numbers_for_one_test_are_told_as_their_range(tmp_path: Path, numbers: RunNumbers) -> None:
    found = rows_of(
        tmp_path,
        numbers,
        HEAD
        + f"a,{TEST.format(0)},measures.peak_force_N,1514,N,\n"
        + f"b,{TEST.format(0).replace('22', '23')},measures.peak_force_N,1610,N,\n"
        + f"c,{TEST.format(150)},measures.peak_force_N,2900,N,\n",
    )
    assert "1514 to 1610 N are expected of this test" in found["a"].note
    assert "1514 to 1610 N are expected of this test" in found["b"].note
    assert "are expected of this test" not in found["c"].note


def test_two_tests_are_one_only_while_a_match_would_take_either() -> None:
    one = Expected(id="a", selector="measures.peak_force_N", voltage_V=100.0, frequency_Hz=2.0, value=1.0, unit="N")
    assert same_test(one, one.model_copy(update={"voltage_V": 101.0, "frequency_Hz": 2.05}))
    assert not same_test(one, one.model_copy(update={"voltage_V": 105.0}))
    assert not same_test(one, one.model_copy(update={"frequency_Hz": 2.2}))
    assert not same_test(one, one.model_copy(update={"setting": "hard"}))


# ---------------------------------------------------------------- what is wrong with a file


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("id,value\na,1\n", "lab.csv:1: column unit is missing (got id,value)"),
        ("id,value,unit,tolerence\na,1,N,0.1\n", "lab.csv:1: no such column; did you mean tolerance? (got tolerence)"),
        ("id,id,value,unit\na,a,1,N\n", "lab.csv:1: the column occurs twice (got id)"),
        ("id,value,unit\na,1\n", "lab.csv:2: 2 fields where the header has 3"),
        ("id,value,unit,tolerance\na,1,N,wide\n", "lab.csv:2: tolerance: must be a number (got 'wide')"),
        ("id,value,unit,tolerance\na,1,N,-1\n", "lab.csv:2: tolerance: must be greater than or equal to 0 (got -1)"),
        (
            "id,selector,value,unit\na,measures.peak_forc,1,N\n",
            "lab.csv:2: selector: no number of a run is called so; did you mean measures.peak_force_N? (got 'meas",
        ),
        (
            "id,selector,value,unit\na,measures.peak_force_N,1,mm\n",
            "lab.csv:2: unit: measures.peak_force_N: 'mm' is no unit of it",
        ),
        ("id,selector,value,unit\na,parameters.W_s,1,N\n", "lab.csv:2: unit: parameters.W_s is a pure number; write -"),
        (
            "id,selector,value,unit\na,__import__('os'),1,N\n",
            "lab.csv:2: selector: is neither a name like measures.peak_force_N nor arithmetic",
        ),
        (
            "id,selector,value,unit\npeak,simulate.mass_kg,1,kg\nb,2 * [peek],1,kg\n",
            "lab.csv:3: selector: no row has the id; did you mean peak? (got peek)",
        ),
        (
            "id,selector,value,unit\na,,1,kg\nb,2 * [a],1,kg\n",
            "lab.csv:3: selector: the row must name a number of the run itself (got a)",
        ),
        ("id,value,unit\na,1,N\n\na,1,N\n", "lab.csv:4: id: occurs twice (got a)"),
    ],
)
def test_a_mistake_in_the_file_is_refused_with_its_line(tmp_path: Path, text: str, message: str) -> None:
    (found,) = faults(tmp_path, text)
    assert found.startswith(message)


def test_all_mistakes_are_told_at_once(tmp_path: Path) -> None:
    found = faults(tmp_path, "id,selector,value,unit\na,measures.x,1,N\nb,1 +,1,N\n")
    assert [line.split(": ")[0] for line in found] == ["lab.csv:2", "lab.csv:3"]


def test_the_control_signal_has_the_name_of_the_config(tmp_path: Path) -> None:
    text = "id,current_A,selector,value,unit\na,1.5,measures.peak_force_N,1,N\n"
    (row,) = read_reference(written(tmp_path, text), Control("current", "A"))
    assert row.voltage_V == 1.5
    assert "no such column" in faults(tmp_path, text)[0]


def test_a_file_that_is_none_is_a_mistake_of_the_config(tmp_path: Path) -> None:
    assert file_of("makowski2021", tmp_path).is_file()
    for name, said in (("makowski2012", "did you mean makowski2021?"), ("lab.csv", f"counts from {tmp_path}")):
        with pytest.raises(ConfigError, match=r"^report\.reference: there is no such file") as caught:
            file_of(name, tmp_path)
        assert said in caught.value.messages[0]


def test_the_stage_writes_what_the_config_names(run: Any, tmp_path: Path) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("pzd.report.page.pictures", lambda plots, context, jobs: defaultdict(tuple))
        written(tmp_path, f"{HEAD}off,{TEST.format(0)},measures.peak_force_N,1500,N,0.02\n")
        report = run.told(ReportConfig(reference="lab.csv"), folder=tmp_path)
        plain = run.told()
    assert plain.reference is None
    assert "What was expected" not in plain.page
    assert "Expected numbers in lab.csv: 1, of which the run computes 1." in report.page
    shown = report.page.replace("\u202f", "").replace("\u00a0", " ")
    assert '<td class="n">1500 N</td><td class="n">1514 N</td><td class="n">1.009</td>' in shown
    assert "within the tolerance of 0.02: off by +0.00933" in shown
    report.write(tmp_path, Control())
    lines = (tmp_path / "reference.csv").read_text(encoding="utf-8").splitlines()
    assert lines[0] == "id,kind,expected,computed,unit,ratio,note"
    assert lines[1].startswith("off,,1500.0,1514.0,N,1.0093")
    assert type(report).read(tmp_path, Control()).reference == report.reference


# ---------------------------------------------------------------- what can be asked for


def test_every_number_that_can_be_asked_for_is_one_of_the_files(numbers: RunNumbers) -> None:
    models: dict[str, Sequence[str]] = {
        "measures": list(MeasureRow.model_fields),
        "parameters": list(ParameterRow.model_fields),
        "summary": list(SummaryRow.model_fields),
        "comfort": [*(row.measure for row in numbers.comfort), *(f"exposure_time_{name}" for name in FACTORS)],
        "response": [f"{s}_to_{p}_percent_s" for s in ("force", "voltage") for p in (63, 90)],
    }
    names = [name.split(".", 1) for name in UNITS]
    assert [name for file, name in names if file in models and name not in models[file]] == []
    assert {file for file, _ in names} == {*models, "simulate"}


def test_the_unit_of_a_number_is_the_one_in_its_columns_name(numbers: RunNumbers) -> None:
    spelled = {unit: Quantity("x", "", unit, "").column[2:] for unit in set(UNITS.values())}
    spelled |= {"kg m2": "kgm2", "km/h": "km_per_h"}
    for name, unit in UNITS.items():
        if not name.startswith("comfort.") and unit != "-":
            assert name.endswith(f"_{spelled[unit]}"), name
    for row in numbers.comfort:
        assert UNITS.get(f"comfort.{row.measure}", row.unit) == row.unit, row.measure


def test_every_input_of_the_ride_is_that_of_the_config(tmp_path: Path, numbers: RunNumbers) -> None:
    names = [name for name in UNITS if name.startswith("simulate.")]
    text = "id,selector,value,unit\n" + "".join(f"{name},{name},1,{UNITS[name]}\n" for name in names)
    found = {row.id.removeprefix("simulate."): row.computed for row in rows_of(tmp_path, numbers, text).values()}
    car = SimulateConfig().car.car()
    assert (found["mass_kg"], found["a1_m"], found["a2_m"]) == (car.mass, *car.distances)
    assert (found["c_min_Ns_per_m"], found["c_max_Ns_per_m"], found["road_amplitude_m"]) == (750.0, 45000.0, 0.02)
    assert (found["spring_stiffness_1_N_per_m"], found["spring_stiffness_2_N_per_m"]) == car.stiffnesses
    assert None not in found.values()


def test_the_response_to_a_step_is_the_rising_one(tmp_path: Path, numbers: RunNumbers) -> None:
    step = numbers.rides.responses[0]
    rising = step.model_copy(update={"signal": "force", "to_90_percent_s": 0.0155})
    falling = rising.model_copy(update={"from_voltage_V": 150.0, "to_voltage_V": 0.0, "to_90_percent_s": 0.02})
    rides = replace(numbers.rides, responses=(step, rising, falling))
    text = "id,selector,value,unit\nRESP,response.force_to_90_percent_s,9,ms\n"
    found = rows_of(tmp_path, replace(numbers, rides=rides), text)["RESP"]
    assert found.computed == pytest.approx(15.5)
    assert found.note == "step from 0 to 150 V at 0.2 m/s; the valve alone 9 ms, an input"


# ---------------------------------------------------------------- arithmetic


def test_arithmetic_follows_its_parentheses() -> None:
    text = "-100 * ([F6-2] / [F6-1] - 1) + [F6-2]"
    assert terms(text) == ("F6-2", "F6-1")
    assert evaluated(text, {"F6-1": 2.0, "F6-2": 3.0}) == -50.0 + 3.0


@pytest.mark.parametrize(
    "text", ["[a] ** 2", "max([a])", "[a].real", "[a] if 1 else 2", "'a'", "True", "term7", "[a", "()"]
)
def test_arithmetic_is_nothing_but_arithmetic(text: str) -> None:
    with pytest.raises(ValueError, match="nor arithmetic"):
        evaluated(text, {"a": 1.0})


def test_a_division_by_zero_says_so(tmp_path: Path, numbers: RunNumbers) -> None:
    text = "id,selector,value,unit\nm,simulate.mass_kg,1,kg\nr,[m] / ([m] - [m]),1,-\n"
    found = rows_of(tmp_path, numbers, text)["r"]
    assert found.computed is None
    assert found.note.endswith("divides by 0")
