"""The tabular formats, read back by other libraries, hold the numbers of the run and say where they come from."""

from __future__ import annotations

import io
import json
import re
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from exported_dampers import DAMPERS, content_of
from scipy.io import loadmat

from pzd.artefacts import ForceRow
from pzd.damper.model import BaseRow, Damper
from pzd.export.content import Content, effect_rows
from pzd.export.formats import formats
from pzd.quantities import Control


def numbers(content: Content, field: str) -> np.ndarray:
    """A field of the run's table of force, NaN where a cell is empty."""
    return np.array([getattr(row, field) for row in content.table.force], dtype=float)


def test_a_part_of_the_law_that_a_file_leaves_out_is_written_as_absent() -> None:
    """As of a damper that was written before knees could be round."""
    base = (BaseRow(T0_N=10.0, C_Ns_per_m=2000.0, k_N_per_m=1e6),)
    law = {"beta": 0.0, "F_reb": 500.0, "C_reb": 500.0, "F_comp": 400.0, "C_comp": 400.0}
    rows = effect_rows(content_of(Damper(base=base, effects={"knee": law})))
    assert {row.parameter: row.value for row in rows} == law | dict.fromkeys(
        ("q_reb", "q_comp", "s_reb", "s_comp"), 0.0
    )


@pytest.mark.parametrize(
    "name", sorted(set(formats()) - {"c", "c-dynamics", "c-lookup", "drive", "fmu"})
)  # these have tests of their own
def test_a_format_gives_the_same_bytes_twice_and_names_version_and_config(name: str, content: Content) -> None:
    again = replace(content)
    written = formats()[name].files(content)
    assert written == formats()[name].files(again)
    assert all(content.origin.encode() in data for data in written.values())


@pytest.mark.parametrize("name", sorted(set(formats()) - {"drive"}))  # which needs a history
def test_a_format_names_the_setting_whatever_stands_in_it(name: str) -> None:
    content = replace(content_of(DAMPERS["plain"]), setting="gap\n1 */ 'wide'")
    for data in formats()[name].files(content).values():
        assert re.search(rb"config my-run.yaml, setting gap 1 (\*/|\* /)", data)
        assert name != "c" or data.count(b"*/") == data.count(b"/*")


def test_csv_read_by_pandas_holds_every_cell(content: Content) -> None:
    written = formats()["csv"].files(content)
    force = pd.read_csv(io.BytesIO(written["my-run-force.csv"]), comment="#")
    for field in set(ForceRow.model_fields) & set(force.columns):
        np.testing.assert_array_equal(force[field].to_numpy(float), numbers(content, field))
    assert ("voltage_V" in force.columns) == content.controlled
    base = pd.read_csv(io.BytesIO(written["my-run-base.csv"]), comment="#")
    assert base["k_N_per_m"].tolist() == [row.k_N_per_m for row in content.damper.base]


def test_the_two_sides_of_zero_speed_keep_their_signs() -> None:
    content = content_of(DAMPERS["plain"])
    for name in ("csv", "json"):
        (data,) = [
            d for file, d in formats()[name].files(content).items() if file in {"my-run-force.csv", "my-run.json"}
        ]
        assert b"-0.0" in data


def test_json_read_by_the_standard_library_holds_every_cell(content: Content) -> None:
    document = json.loads(formats()["json"].files(content)["my-run.json"])
    force = document["force"]["columns"]
    np.testing.assert_array_equal(np.array(force["force_N"], dtype=float), numbers(content, "force_N"))
    assert document["force"]["units"]["velocity_m_per_s"] == "m/s"
    given = {name: dict(values) for name, values in content.damper.effects.items()}
    effects = document.get("effects", {"columns": {"effect": [], "parameter": [], "value": []}})["columns"]
    told = zip(effects["effect"], effects["parameter"], effects["value"], strict=True)
    assert {(effect, parameter): value for effect, parameter, value in told} == {
        (effect, parameter): value for effect, values in given.items() for parameter, value in values.items()
    }


def test_parquet_read_by_pyarrow_holds_every_cell_and_its_unit(content: Content) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    table = parquet.read_table(io.BytesIO(formats()["parquet"].files(content)["my-run-force.parquet"]))
    np.testing.assert_array_equal(table.column("force_N").to_numpy(), numbers(content, "force_N"))
    assert table.schema.field("velocity_m_per_s").metadata == {b"unit": b"m/s"}


def test_a_current_goes_by_its_own_name_and_unit() -> None:
    content = replace(content_of(DAMPERS["plain"]), control=Control("current", "A"))
    document = json.loads(formats()["json"].files(content)["my-run.json"])
    assert document["force"]["units"]["current_A"] == "A"
    assert "voltage" not in json.dumps(document)


def test_a_parameter_that_differs_by_voltage_has_a_row_each() -> None:
    damper = DAMPERS["plain"].with_effect("orifice_quadratic", {"q": (100.0, 900.0), "at_voltage_V": (0.0, 150.0)})
    effects = json.loads(formats()["json"].files(content_of(damper))["my-run.json"])["effects"]["columns"]
    assert (effects["voltage_V"], effects["value"]) == ([0.0, 150.0], [100.0, 900.0])


def test_what_the_effects_count_from_goes_with_them() -> None:
    damper = DAMPERS["plain"].model_copy(update={"reference_temperature_degC": 30.0, "zero_m": 0.004})
    content = content_of(damper.with_effect("temperature_drift", {"beta_T0": 0.01, "beta_C": 0.02}))
    told = {"reference_temperature_degC": 30.0, "zero_m": 0.004}
    written = {name: formats()[name].files(content) for name in ("csv", "json", "mat")}
    csv = pd.read_csv(io.BytesIO(written["csv"]["my-run-reference.csv"]), comment="#")
    assert csv.to_dict("records") == [told]
    document = json.loads(written["json"]["my-run.json"])["reference"]
    assert document["columns"] == {name: [value] for name, value in told.items()}
    assert document["units"] == {"reference_temperature_degC": "degC", "zero_m": "m"}
    damper = loadmat(io.BytesIO(written["mat"]["my-run.mat"]), simplify_cells=True)["damper"]
    assert {name: damper[name] for name in told} == told


def test_the_play_of_a_damper_driven_by_a_current_is_one_of_the_current() -> None:
    damper = DAMPERS["plain"].with_effect("piezo_hysteresis", {"r": 0.1})
    for control, unit in ((Control("current", "A"), "A"), (Control(), "V")):
        content = replace(content_of(damper), control=control)
        effects = json.loads(formats()["json"].files(content)["my-run.json"])["effects"]["columns"]
        assert (effects["effect"], effects["unit"]) == (["piezo_hysteresis"], [unit])
