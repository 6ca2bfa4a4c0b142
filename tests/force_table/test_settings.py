"""Settings between tested ones: the force is linear in their number, and never beyond what both neighbours cover."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from pzd.artefacts import Identified, KneeRow, Knees, LawRow, ParameterRow, Rig, SettingLeftOutRow, SettingRow, Table
from pzd.artefacts.table import neighbours, numbers_in
from pzd.cli.app import status
from pzd.force_table.config import TableConfig
from pzd.force_table.settings import between_settings
from pzd.quantities import Control
from pzd.record import Record
from pzd.schema.errors import ConfigError

FRICTION = 100.0
Rows = tuple[tuple[SettingRow, ...], tuple[SettingLeftOutRow, ...]]


def row(setting: str, C: float, voltage: float | None, temperature: float | None, T0: float) -> ParameterRow:
    values = {"T0_N": T0, "C_Ns_per_m": C, "k_N_per_m": 1e6}
    ends = {f"{name}{end}": None for name in values for end in ("_low95", "_high95")}
    place = {"setting": setting, "voltage_V": voltage, "temperature_degC": temperature}
    return ParameterRow.model_validate({**place, **values, **ends, "W_s": 0.0, "rmse_N": 0.0, "status": "ok"})


def sine(setting: str, speed: float, voltage: float | None, temperature: float | None) -> Record:
    t = np.arange(0.0, 2.0, 1e-3)
    w = 4.0 * np.pi
    x, v, a = speed / w * np.sin(w * t), speed * np.cos(w * t), -speed * w * np.sin(w * t)
    held = [None if value is None else np.full(t.size, value) for value in (voltage, temperature)]
    return Record(f"{setting}-{voltage}-{temperature}", setting, t, x, v, a, 1e3 * v, *held)


Tried = tuple[str, float, float, float | None, float | None]
"""Setting, damping [N s/m], speed of its test [m/s], control signal and temperature."""


def found(tests: list[Tried], wanted: list[str], **config: Any) -> Rows:
    rows = tuple(row(setting, C, U, T, FRICTION) for setting, C, _, U, T in tests)
    records = tuple(sine(setting, speed, U, T) for setting, _, speed, U, T in tests)
    asked = TableConfig(settings=tuple(wanted), **config)
    return between_settings(asked, Rig(records, ()), Identified(rows, ()), Control())


def steady(*pairs: tuple[str, float]) -> list[Tried]:
    return [(setting, C, 0.3, None, None) for setting, C in pairs]


@pytest.mark.parametrize(("wanted", "share"), [("gap 0.125 mm", 0.25), ("gap 0.15 mm", 0.5), ("gap 0.1 mm", 0.0)])
def test_the_force_lies_on_the_line_between_those_of_both_neighbours(wanted: str, share: float) -> None:
    rows, _ = found(steady(("gap 0.1 mm", 8000.0), ("gap 0.2 mm", 2000.0)), [wanted])
    v = np.array([one.velocity_m_per_s for one in rows])
    law = np.copysign(FRICTION + (8000.0 - 6000.0 * share) * np.abs(v), v)
    np.testing.assert_allclose([one.force_N for one in rows], law, rtol=1e-12)
    assert {one.value for one in rows} == {float(wanted.split()[1])}


def test_two_one_sided_rows_stand_for_zero_speed() -> None:
    rows, _ = found(steady(("click 2", 3000.0), ("click 6", 2000.0)), ["click 3"])
    at_rest = [(str(one.velocity_m_per_s), one.force_N) for one in rows if one.velocity_m_per_s == 0.0]
    assert at_rest == [("-0.0", -FRICTION), ("0.0", FRICTION)]


def test_speeds_end_where_the_slower_of_both_tests_ended() -> None:
    tests = [("click 2", 3000.0, 0.2, None, None), ("click 6", 2000.0, 0.5, None, None)]
    rows, _ = found(tests, ["click 4"])
    reached = max(one.velocity_m_per_s for one in rows)
    assert reached == pytest.approx(0.2, rel=1e-3)
    assert min(one.velocity_m_per_s for one in rows) == -reached


def test_voltages_are_those_that_both_cover_and_temperatures_within_2_degrees_are_one() -> None:
    tests: list[Tried] = [
        ("gap 0.1 mm", 8000.0, 0.3, 0.0, 22.0),
        ("gap 0.1 mm", 9000.0, 0.3, 100.0, 22.0),
        ("gap 0.2 mm", 2000.0, 0.3, 0.4, 23.1),
        ("gap 0.2 mm", 5000.0, 0.3, 150.0, 23.1),
        ("gap 0.2 mm", 4000.0, 0.3, 150.0, 43.0),
    ]
    rows, _ = found(tests, ["gap 0.15 mm"])
    places = {(one.temperature_degC, one.voltage_V) for one in rows}
    assert places == {(22.0, 0.0), (22.0, 100.0)}
    middle = next(one for one in rows if one.voltage_V == 100.0 and one.velocity_m_per_s == 0.0 and one.force_N > 0.0)
    assert middle.force_N == FRICTION
    fastest = max((one for one in rows if one.voltage_V == 100.0), key=lambda one: one.velocity_m_per_s)
    of_the_wider = 2000.0 + 3000.0 * (100.0 - 0.4) / (150.0 - 0.4)
    law = FRICTION + 0.5 * (9000.0 + of_the_wider) * fastest.velocity_m_per_s
    assert fastest.force_N == pytest.approx(law, rel=1e-9)


def test_neighbours_without_a_common_condition_are_refused_with_the_place() -> None:
    tests: list[Tried] = [("gap 0.1 mm", 8000.0, 0.3, None, 22.0), ("gap 0.2 mm", 2000.0, 0.3, None, 43.0)]
    with pytest.raises(ConfigError, match=r"^table\.settings\.0: .*in common.*\(got gap 0\.15 mm\)"):
        found(tests, ["gap 0.15 mm"])


def test_a_setting_whose_force_is_linear_in_its_number_is_predicted_without_error() -> None:
    tests = steady(("click 0", 1000.0), ("click 4", 1400.0), ("click 8", 1800.0))
    _, (left_out,) = found(tests, ["click 6"])
    assert (left_out.lower_setting, left_out.setting, left_out.upper_setting) == ("click 0", "click 4", "click 8")
    assert left_out.largest_share_of_peak < 1e-12


def test_the_prediction_error_of_a_nonlinear_setting_is_the_distance_of_the_line_from_its_law() -> None:
    """A slot gives C ~ 1/h^3: halfway between 0.1 and 0.3 mm the line has (1 + 1/27) / 2 of the first, the law 1/8."""
    damping = {h: 8.0 / (h / 0.1) ** 3 * 1000.0 for h in (0.1, 0.2, 0.3)}
    _, (left_out,) = found(steady(*((f"gap {h} mm", C) for h, C in damping.items())), ["gap 0.15 mm"])
    off = 0.5 * (damping[0.1] + damping[0.3]) - damping[0.2]
    speed = left_out.reached_m_per_s
    peak = FRICTION + damping[0.2] * speed
    assert left_out.peak_force_N == pytest.approx(peak)
    assert left_out.largest_share_of_peak == pytest.approx(off * speed / peak)
    even = np.arange(1, 201) / 200
    assert left_out.rms_share_of_peak == pytest.approx(off * speed * np.sqrt(np.mean(even**2)) / peak)


def test_two_tested_settings_leave_none_to_predict() -> None:
    assert found(steady(("click 2", 3000.0), ("click 6", 2000.0)), ["click 3"])[1] == ()


def knee_of(setting: str, gas: float) -> KneeRow:
    values = {"friction_N": 35.0, "gas_force_N": gas, "gas_spring_N_per_m": 3000.0, "k_N_per_m": 3e6}
    for direction in ("rebound", "compression"):
        values |= {
            f"{direction}_{name}": value
            for name, value in (
                ("bleed_Ns_per_m", 1500.0),
                ("knee_force_N", 200.0),
                ("knee_velocity_m_per_s", 0.11),
                ("blow_off_Ns_per_m", 600.0),
            )
        }
    ends = {f"{name}{end}": value for name, value in values.items() for end in ("_low95", "_high95")}
    place = {"setting": setting, "voltage_V": None, "temperature_degC": None}
    rest = {"zero_m": 0.0, "reached_m_per_s": 0.3, "W_s": 0.0, "rmse_N": 0.0, "missed_share": 0.0, "status": "ok"}
    return KneeRow.model_validate({**place, **values, **ends, **rest})


def test_between_two_gas_pressures_lies_the_static_force_of_the_gas() -> None:
    pressures = {"gas 100 psi": -200.0, "gas 200 psi": -400.0}
    laws = tuple(
        LawRow(setting=name, law="knee", tests=0, W_s_bingham=None, W_s_knee=None, reason="asked for")
        for name in pressures
    )
    knees = Knees(tuple(knee_of(*pair) for pair in pressures.items()), laws=laws)
    parameters = tuple(row(name, 1000.0, None, None, 35.0) for name in pressures)
    records = tuple(sine(name, 0.3, None, None) for name in pressures)
    asked = TableConfig(settings=("gas 150 psi",))
    rows, _ = between_settings(asked, Rig(records, ()), Identified(parameters, (), knees=knees), Control())
    assert {one.static_force_N for one in rows} == {-300.0}
    fastest = rows[-1]
    beyond = 200.0 + 600.0 * (fastest.velocity_m_per_s - (200.0 - 35.0) / 1500.0)
    assert fastest.force_N == pytest.approx(beyond)


def test_a_setting_may_have_several_numbers_anywhere_in_its_name() -> None:
    assert [(one.axis, one.value, one.unit) for one in numbers_in("C08_R12")] == [
        ("C#_R12", 8.0, ""),
        ("C08_R#", 12.0, ""),
    ]
    assert [(one.value, one.unit) for one in numbers_in("gas 12.5bar, R 3 C 4")] == [
        (12.5, "bar"),
        (3.0, ""),
        (4.0, ""),
    ]
    known = ["R3 C4", "R3 C12", "R1 C8", "soft"]
    between = neighbours("R3 C6", known)
    assert (between.lower.setting, between.upper.setting, between.share) == ("R3 C4", "R3 C12", 0.25)


@pytest.mark.parametrize(
    ("wanted", "says"),
    [
        ("gap 0.3 mm", r"must lie between gap 0\.1 mm and gap 0\.2 mm, .*nothing is extrapolated \(got gap 0\.3 mm\)"),
        ("gap 0.05 mm", r"must lie between .*\(got gap 0\.05 mm\)"),
        ("gap 150 um", r"no two tested settings .*tested: gap 0\.1 mm, gap 0\.2 mm, soft \(got gap 150 um\)"),
        ("hard", r"no two tested settings .*\(got hard\)"),
    ],
)
def test_what_does_not_lie_between_two_tested_settings_is_refused(wanted: str, says: str) -> None:
    with pytest.raises(ValueError, match=f"^{says}$"):
        neighbours(wanted, ["gap 0.1 mm", "soft", "gap 0.2 mm", None])


def test_settings_are_written_and_read_back(tmp_path: Path) -> None:
    control = Control("current", "A")
    tests: list[Tried] = [(f"gap 0.{n} mm", 8e3 / n, 0.3, 0.5, 22.0) for n in (1, 2, 3)]
    made = found(tests, ["gap 0.15 mm"])
    assert Table.read_settings(tmp_path, control) == ((), ())
    whole = Table((), (), notes(), *made)
    whole.write(tmp_path, control)
    assert (tmp_path / "settings.csv").read_text().splitlines()[0] == (
        "setting,value,lower_setting,upper_setting,temperature_degC,current_A,velocity_m_per_s,force_N,static_force_N"
    )
    assert Table.read_settings(tmp_path, control) == made
    assert made[1]


def notes() -> Any:
    from pzd.artefacts import TableNotes

    return TableNotes(outside="model", reached_m_per_s=0.3, lost=(), not_monotone=())


def rig_of(pairs: dict[str, float]) -> dict[str, Any]:
    """A stand that tests each setting once, at once and without noise."""
    wave = {"kind": "sine", "frequency_Hz": 2, "amplitude_m": 0.02}
    return {
        "virtual": [
            {
                "setting": setting,
                "damper": {"base": [{"T0_N": FRICTION, "C_Ns_per_m": C, "k_N_per_m": 2000000}]},
                "rate_Hz": 250,
                "tests": [{"waveform": wave, "cycles": 3}],
            }
            for setting, C in pairs.items()
        ]
    }


def test_a_setting_beyond_the_tested_ones_is_exit_2_with_its_place(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    config = {"rig": rig_of({"click 2": 3000, "click 6": 2000}), "setting": "click 2"}
    asked = yaml.safe_dump(config) + "table:\n  settings: [click 4, click 9]\n"
    (tmp_path / "my.yaml").write_text(asked, encoding="utf-8")
    line = asked.splitlines().index("  settings: [click 4, click 9]") + 1
    for command in ("check", "table"):
        assert status([command, str(tmp_path / "my.yaml"), "--runs", str(tmp_path / "runs")]) == 2
        (said,) = capsys.readouterr().err.splitlines()
        assert said == (
            f"{tmp_path / 'my.yaml'}:{line}:23: table.settings.1: must lie between click 2 and click 6, which were "
            "tested: nothing is extrapolated (got click 9)"
        )


@pytest.mark.ci
def test_page_and_terminal_name_the_tested_neighbours_and_the_prediction_error(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    config = {
        "rig": rig_of({"click 2": 3000, "click 6": 2000, "click 8": 1900}),
        "setting": "click 2",
        "table": {"settings": ["click 4"]},
        "stages": ["rig", "identify", "diagnose", "table", "report"],
    }
    (tmp_path / "my.yaml").write_text(yaml.safe_dump(config), encoding="utf-8")
    arguments = [str(tmp_path / "my.yaml"), "--runs", str(tmp_path / "runs")]
    assert status(["run", *arguments]) == 0
    assert status(["show", *arguments]) == 0
    told = capsys.readouterr().out
    assert "settings that were not tested: interpolated force" in told
    assert "click 2 and click 6" in told
    assert "tested settings predicted from their neighbours" in told
    assert "click 2 and click 8" in told
    page = (tmp_path / "runs" / "my" / "6-report" / "report.html").read_text(encoding="utf-8")
    assert "were not tested" in page
    assert "Tested settings predicted from their neighbours" in page
    rows, _ = Table.read_settings(tmp_path / "runs" / "my" / Table.folder, Control())
    fastest = rows[-1]
    assert fastest.force_N == pytest.approx(FRICTION + 2500.0 * fastest.velocity_m_per_s, rel=0.01)
