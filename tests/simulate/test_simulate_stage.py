"""The stage: which rides, what they are called, what is refused, and what goes into the files."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pydantic import ValidationError
from simulate_dampers import table_of

from pzd.artefacts import Diagnosed, Rides, Table
from pzd.damper.model import Damper
from pzd.quantities import Control
from pzd.schema.errors import ConfigError, DataError
from pzd.simulate.config import SimulateConfig
from pzd.simulate.policies import policies
from pzd.simulate.ride.model import dynamic_damper_of, grid_of
from pzd.simulate.ride.riding import ride_case
from pzd.simulate.roads import Way
from pzd.simulate.stage import simulate
from pzd.simulate.study.plan import cases, checked_temperature

SHORT = {"duration_s": 1.0, "settle_s": 0.2, "roads": [{"kind": "sine", "frequency_Hz": 2.25}]}


def config(**given: object) -> SimulateConfig:
    return SimulateConfig.model_validate_json(json.dumps({**SHORT, **given}))


def ride(damper: Damper, table: Table | None = None, plain: Damper | None = None, **given: object) -> Rides:
    return simulate(config(**given), Diagnosed.undiagnosed(damper, plain), table or table_of(damper), 1, Path())


def unvoiced(damper: Damper) -> Damper:
    row = damper.base[0].model_copy(update={"voltage_V": None})
    return damper.model_copy(update={"base": (row,)})


def test_a_case_is_road_policy_fidelity(damper) -> None:
    rides = ride(damper, keep="all")
    assert [row.case for row in rides.summary] == [
        f"sine-2.25Hz-{policy}-{fidelity}"
        for policy in ("constant", "best_constant_c", "passive", "best_fixed_voltage", "comfort")
        for fidelity in ("ideal", "table", "dynamic")
        if fidelity != "ideal" or policy not in ("passive", "best_fixed_voltage")
    ]
    assert [r.case for r in rides.rides] == [row.case for row in rides.summary]
    assert all(abs(row.energy_error) < 1e-6 for row in rides.summary)
    assert rides.untrusted(Control()) == ()


def test_the_same_ride_on_the_damper_before_diagnose_stands_beside(damper) -> None:
    changed = damper.with_effect("orifice_quadratic", {"q": 1500.0})
    rides = {row.case: row for row in ride(changed, plain=damper, policies=["comfort"]).summary}
    assert set(rides) == {
        "sine-2.25Hz-comfort-ideal",
        "sine-2.25Hz-comfort-ideal-plain",
        "sine-2.25Hz-comfort-table",
        "sine-2.25Hz-comfort-table-plain",
        "sine-2.25Hz-comfort-dynamic",
        "sine-2.25Hz-comfort-dynamic-plain",
    }
    alone = {row.case: row for row in ride(damper, policies=["comfort"]).summary}
    for fidelity in ("table", "dynamic"):
        plain = rides[f"sine-2.25Hz-comfort-{fidelity}-plain"]
        unchanged = alone[f"sine-2.25Hz-comfort-{fidelity}"]
        assert plain.peak_abs_aK_m_per_s2 == pytest.approx(unchanged.peak_abs_aK_m_per_s2, rel=1e-6)
        assert plain.dissipated_J != rides[f"sine-2.25Hz-comfort-{fidelity}"].dissipated_J


def test_a_rig_without_voltage_rides_constant_damping_and_the_damper_as_it_is(damper) -> None:
    rides = ride(unvoiced(damper))
    assert [row.case for row in rides.summary] == [
        "sine-2.25Hz-constant-ideal",
        "sine-2.25Hz-passive-table",
        "sine-2.25Hz-passive-dynamic",
    ]
    assert all("voltage_1_V" not in r.columns for r in rides.rides)
    assert rides.responses == ()


@pytest.mark.parametrize("policy", ["comfort", "skyhook", "wheel_load"])
def test_a_policy_that_needs_the_voltage_is_refused_on_a_rig_without_one(damper, policy) -> None:
    with pytest.raises(ConfigError, match=f"{policy} sets the voltage"):
        ride(unvoiced(damper), policies=["constant", policy])


def test_a_ride_beyond_a_table_that_ends_is_refused_with_the_speed(damper) -> None:
    table = table_of(damper, outside="error", reached=0.1)
    with pytest.raises(DataError, match="where the table ends"):
        ride(damper, table, policies=["comfort"], fidelities=["table"])


def test_a_ride_within_a_table_that_ends_goes_through(damper) -> None:
    table = table_of(damper, outside="error", reached=1.0)
    assert ride(damper, table, policies=["comfort"], fidelities=["table"]).summary[0].outside_table == 0.0


def test_a_clamped_table_holds_the_force_and_the_share_beyond_is_said(damper) -> None:
    rows = {}
    for outside in ("clamp", "model"):
        table = table_of(damper, outside=outside, reached=0.1)
        rides = ride(damper, table, policies=["passive"], fidelities=["table"])
        rows[outside] = rides.summary[0], rides.rides[0].columns["damper_force_1_N"]
    assert rows["clamp"][0].outside_table > 0.3
    assert np.max(np.abs(rows["clamp"][1])) == pytest.approx(301.0 + 272.0, rel=1e-6)
    assert np.max(np.abs(rows["model"][1])) > 800.0


def test_the_files_read_back_as_they_were_written(damper, tmp_path) -> None:
    rides = ride(damper, policies=["comfort"], fidelities=["ideal", "table"], keep="all")
    rides.write(tmp_path, Control())
    again = Rides.read(tmp_path, Control())
    assert again.summary == rides.summary
    assert again.responses == rides.responses
    assert (again.ridden, again.wheels) == (rides.ridden, rides.wheels)
    assert (again.weighted, again.spectrum) == (rides.weighted, rides.spectrum)
    assert np.array_equal(again.rides[1].columns["a_K_m_per_s2"], rides.rides[1].columns["a_K_m_per_s2"])
    header = (tmp_path / "sine-2.25Hz-comfort-ideal.csv").read_text(encoding="utf-8").splitlines()[0]
    assert header.startswith("time_s,z_m,phi_rad,a_K_m_per_s2,deflection_1_m,")


def test_written_histories_are_thinned_and_peaks_are_not(damper) -> None:
    thin = ride(damper, policies=["comfort"], fidelities=["ideal"], output_rate_Hz=20.0)
    full = ride(damper, policies=["comfort"], fidelities=["ideal"], output_rate_Hz=1000.0)
    assert len(thin.rides[0].columns["time_s"]) == 21
    assert len(full.rides[0].columns["time_s"]) == 1001
    assert thin.summary == full.summary
    assert (thin.weighted, thin.spectrum, thin.wheels) == (full.weighted, full.spectrum, full.wheels)


def test_histories_in_parquet_read_back_as_those_in_csv_do(damper, tmp_path: Path) -> None:
    pytest.importorskip("pyarrow", reason="pyarrow is not installed")
    read = {}
    for kind in ("csv", "parquet"):
        (tmp_path / kind).mkdir()
        ride(damper, policies=["comfort"], histories=kind, keep="all").write(tmp_path / kind, Control("current", "A"))
        assert len(list((tmp_path / kind).glob(f"sine-*.{kind}"))) == 3
        read[kind] = Rides.read(tmp_path / kind, Control("current", "A"))
    assert not list((tmp_path / "parquet").glob("sine-*.csv"))
    for one, other in zip(read["csv"].rides, read["parquet"].rides, strict=True):
        assert one.case == other.case
        assert one.columns.keys() == other.columns.keys()
        assert all(np.array_equal(one.columns[name], other.columns[name]) for name in one.columns)


def test_histories_that_are_not_wanted_are_not_written_and_all_numbers_stay(damper, tmp_path: Path) -> None:
    without, usual = (ride(damper, policies=["comfort"], histories=kind) for kind in ("none", "csv"))
    assert without.rides == ()
    assert (without.summary, without.weighted, without.spectrum) == (usual.summary, usual.weighted, usual.spectrum)
    without.write(tmp_path, Control())
    assert not list(tmp_path.glob("sine-*"))
    assert Rides.read(tmp_path, Control()).ridden == without.ridden


def test_histories_are_those_that_the_report_draws_or_all_and_every_number_stays(damper) -> None:
    """Of these dynamic is nearest to a car; where that is not ridden the report draws what is."""
    drawn, every = (ride(damper, policies=["comfort", "passive"], keep=keep) for keep in ("drawn", "all"))
    assert {one.case for one in drawn.rides} == {
        row.case for row in drawn.summary if row.fidelity == "dynamic" and not row.case.endswith("-plain")
    }
    assert {one.case for one in every.rides} == {row.case for row in every.summary}
    assert (drawn.summary, drawn.weighted, drawn.spectrum) == (every.summary, every.weighted, every.spectrum)
    ideal = ride(damper, policies=["constant"], fidelities=["ideal"])
    assert {one.case for one in ideal.rides} == {row.case for row in ideal.summary}


def test_parquet_without_its_library_is_refused_before_anything_is_ridden(
    damper, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("pzd.schema.csvfile.find_spec", lambda _: None)
    with pytest.raises(ConfigError, match=r"^simulate\.histories: parquet is written with pyarrow, which is not"):
        ride(damper, histories="parquet")


@pytest.mark.parametrize(
    ("spoilt", "message"),
    [
        ("gone", "the file is missing"),
        ("words", "is no Parquet file"),
        ("column", "column a_K_m_per_s2 is missing"),
        ("number", "column z_m must hold finite numbers"),
    ],
)
def test_a_spoilt_history_is_refused_with_its_place(damper, tmp_path: Path, spoilt: str, message: str) -> None:
    pyarrow = pytest.importorskip("pyarrow", reason="pyarrow is not installed")
    parquet = pytest.importorskip("pyarrow.parquet", reason="pyarrow is not installed")
    ride(damper, policies=["comfort"], fidelities=["ideal"], histories="parquet").write(tmp_path, Control())
    (path,) = tmp_path.glob("*.parquet")
    columns = parquet.read_table(path).to_pydict()
    if spoilt == "gone":
        path.unlink()
    elif spoilt == "words":
        path.write_text("time_s,z_m", encoding="utf-8")
    elif spoilt == "column":
        parquet.write_table(pyarrow.table({n: v for n, v in columns.items() if n != "a_K_m_per_s2"}), path)
    else:
        parquet.write_table(pyarrow.table({**columns, "z_m": [None, *columns["z_m"][1:]]}), path)
    with pytest.raises(DataError, match=f"{path.name}: {message}"):
        Rides.read(tmp_path, Control())


def test_force_answers_a_step_of_voltage_later_than_the_valve(damper) -> None:
    times = {(r.signal, r.to_voltage_V): r for r in ride(damper).responses}
    voltage, force = times["voltage", 150.0], times["force", 150.0]
    assert voltage.to_90_percent_s == pytest.approx(0.0039 * np.log(10.0))
    assert voltage.to_90_percent_s == pytest.approx(0.009, rel=0.01)
    assert force.to_90_percent_s > voltage.to_90_percent_s


def test_a_force_that_comes_with_the_stiffness_is_explained(damper) -> None:
    """k from 199 to 423 kN/m: under 845 N the spring alone goes to 1796 N of 1837 N, as fast as the valve."""
    times = {(r.signal, r.to_voltage_V): r for r in ride(damper).responses}
    force = times["force", 150.0]
    assert force.note.startswith(
        "96 % of the step comes before the oil has flowed: k goes with the valve from 199 to 423 kN/m"
    )
    assert times["voltage", 150.0].note == ""
    rows = tuple(row.model_copy(update={"k_N_per_m": 199e3}) for row in damper.base)
    even = ride(damper.model_copy(update={"base": rows})).responses
    assert [r.note for r in even] == [""] * 4
    slow = next(r for r in even if (r.signal, r.to_voltage_V) == ("force", 150.0))
    assert force.to_63_percent_s < 0.3 * slow.to_63_percent_s


def test_with_an_instant_valve_the_force_takes_the_time_of_the_oil_spring(damper) -> None:
    """One stiffness at every voltage: F sticks up to the new T0 at the rate k v, then goes on as exp(-t k / C)."""
    rows = tuple(row.model_copy(update={"k_N_per_m": 199e3}) for row in damper.base)
    even = damper.model_copy(update={"base": rows})
    times = {(r.signal, r.to_voltage_V): r for r in ride(even, valve_response_s=0.0).responses}
    assert times["voltage", 150.0].to_90_percent_s == 0.0
    first, last = 301.0 + 0.2 * 2720.0, 1325.0 + 0.2 * 2560.0
    stuck = (1325.0 - first) / (0.2 * 199e3)
    slipping = 2560.0 / 199e3 * np.log((last - 1325.0) / (0.1 * (last - first)))
    assert times["force", 150.0].to_90_percent_s == pytest.approx(stuck + slipping, rel=1e-3)
    assert times["force", 0.0].to_90_percent_s == pytest.approx(2720.0 / 199e3 * np.log(10.0), rel=1e-3)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"policies": ["comfy"]}, "no policy is called comfy; there are add, balance, best_constant_c, best_fixed"),
        ({"car": {"model": "fiat"}}, "no car is called fiat; there are makowski2021"),
        ({"car": {"motion_ratio": [1.0, 0.0]}}, "greater than 0"),
        ({"control_period_s": 0.0015}, "whole number of integration_step_s"),
        ({"c_max_Ns_per_m": 1.0}, "need both c_min"),
        ({"bounds": "coefficients"}, "need both c_min"),
        ({"bounds": "table", "c_min_Ns_per_m": 1.0, "c_max_Ns_per_m": 2.0}, "leave one of them out"),
        ({"c_min_Ns_per_m": 2.0, "c_max_Ns_per_m": 1.0}, "at least c_min"),
        ({"car": {"x_K_m": 50.0}}, r"x_K_m must lie within the car.*from -4\.749 to 4\.116 m \(got 50\)"),
        (
            {"controlled": "passive"},
            "passive does not control; these do: add, balance, clipped_lqr, comfort, comfort_largest",
        ),
        ({"controlled": "skyhook"}, "skyhook is none of policies"),
        ({"policies": ["skyhook", "wheel_load"]}, "say which one the report is about: skyhook, wheel_load"),
        ({"settle_s": 1.0}, "shorter than duration_s"),
        ({"fidelities": ["ideal", "ideal"]}, "named twice"),
        ({"roads": [{"kind": "iso8608", "road_class": "Z"}]}, "a road class is one of A, B"),
    ],
)
def test_a_config_that_makes_no_sense_is_refused_with_what_would(given, message) -> None:
    with pytest.raises(ValidationError, match=message):
        config(**given)


def test_the_controlled_policy_is_the_one_that_controls_wherever_it_stands_in_the_list() -> None:
    for given, name in (
        ({}, "comfort"),
        ({"policies": ["constant", "passive", "comfort"]}, "comfort"),
        ({"policies": ["passive", "wheel_load"]}, "wheel_load"),
        ({"policies": ["skyhook", "comfort"]}, "comfort"),
        ({"policies": ["comfort", "skyhook"], "controlled": "skyhook"}, "skyhook"),
    ):
        chosen = config(**given)
        assert [policy for policy in policies() if chosen.is_controlled(policy)] == [name]


def test_a_car_with_other_values_is_not_called_by_the_name_of_the_model() -> None:
    for given, name in (
        ({}, "makowski2021"),
        ({"a1_m": 1.794}, "makowski2021"),
        ({"a1_m": 1.7}, "own"),
        ({"a1_m": 1.7, "name": "van"}, "van"),
    ):
        assert config(car=given).car.car().name == name


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (
            {"passive_voltage_V": 400.0},
            r"^simulate\.passive_voltage_V: must lie within the table, 0 to 150 \(got 400\)$",
        ),
        ({"passive_voltage_V": -20.0}, r"^simulate\.passive_voltage_V: .*\(got -20\)$"),
        ({"temperature_degC": 80.0}, r"^simulate\.temperature_degC: must lie within the table, 22 degC; .*\(got 80\)$"),
    ],
)
def test_what_the_table_does_not_cover_is_refused(damper, given, message) -> None:
    with pytest.raises(ConfigError, match=message):
        ride(damper, policies=["passive"], **given)


def test_a_rig_without_voltage_or_temperature_has_none_to_ride_at(damper) -> None:
    bare = unvoiced(damper)
    bare = bare.model_copy(update={"base": (bare.base[0].model_copy(update={"temperature_degC": None}),)})
    table = table_of(bare)
    rows = tuple(row.model_copy(update={"temperature_degC": None}) for row in table.force)
    for given, message in (
        ({"passive_voltage_V": 0.0}, "the rig records no voltage"),
        ({"temperature_degC": 22.0}, "the table has no temperature"),
    ):
        with pytest.raises(ConfigError, match=message):
            ride(bare, replace(table, force=rows), **given)


def test_a_voltage_and_a_temperature_as_close_as_conditions_of_a_rig_are_taken(damper) -> None:
    """The table ends at 150 V and 22 degC: 2 % and 2 K beyond are the same condition, and ridden as its edge."""
    asked = {"policies": ["passive"], "fidelities": ["table"]}
    near = ride(damper, **asked, passive_voltage_V=152.9, temperature_degC=23.9)
    assert near.ridden[0].voltage_V == 152.9
    assert near.summary == ride(damper, **asked, passive_voltage_V=150.0, temperature_degC=22.0).summary
    table = table_of(damper)
    assert checked_temperature(config(temperature_degC=23.9), table) == 23.9
    for beyond in ({"passive_voltage_V": 153.1}, {"temperature_degC": 24.1}, {"temperature_degC": 19.9}):
        with pytest.raises(ConfigError, match="must lie within the table"):
            ride(damper, table, **asked, **beyond)


def test_a_damper_that_was_never_tested_at_0_volts_is_passive_at_its_lowest(damper) -> None:
    upper = damper.model_copy(update={"base": damper.base[1:]})
    row = ride(upper, policies=["passive"], fidelities=["table"]).ridden[0]
    assert (row.voltage_V, row.damping_Ns_per_m) == (50.0, None)


BY_VOLTAGE = {"at_voltage_V": (0.0, 150.0), "k_g": (1000.0, 40000.0)}


@pytest.mark.ci
def test_rides_at_the_same_time_are_the_same(damper) -> None:
    parallel = damper.with_effect("gas_spring", BY_VOLTAGE)
    given = (config(), Diagnosed.undiagnosed(parallel, damper), table_of(parallel), 1, Path())
    alone, together = simulate(*given), simulate(*given, jobs=6)
    assert together.summary == alone.summary
    for one, other in zip(together.rides, alone.rides, strict=True):
        assert one.case == other.case
        assert all(np.array_equal(one.columns[name], values) for name, values in other.columns.items())


def test_a_ride_leaves_what_it_shares_with_others_untouched(damper) -> None:
    setup = config(policies=["comfort"], fidelities=["dynamic"])
    (case,) = cases(setup, with_voltage=True, changed=False)
    dynamic, grid = (
        dynamic_damper_of(damper.with_effect("gas_spring", BY_VOLTAGE), 22.0, 0.001),
        grid_of(table_of(damper), None),
    )
    profile = case.road.profile(Way(25.0, 25.0, 1, Path()))
    before = [array.copy() for array in (*dynamic, *grid) if isinstance(array, np.ndarray)]
    ride_case(setup, case, profile, grid, dynamic, ends=False)
    after = [array for array in (*dynamic, *grid) if isinstance(array, np.ndarray)]
    assert all(np.array_equal(one, other) for one, other in zip(before, after, strict=True))
