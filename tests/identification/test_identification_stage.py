"""The stage: one row a condition, one row of measures a record."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from fresh_truths import TABLE_2, sine_test
from pydantic import ValidationError

from pzd.artefacts import Identified, Rig
from pzd.identification.config import IdentifyConfig
from pzd.identification.stage import identify
from pzd.parallel.processes import Progress
from pzd.quantities import Control
from pzd.schema.errors import DataError


def rig() -> Rig:
    records = []
    for setting in ("wide", "narrow"):
        for voltage, truth in TABLE_2.items():
            for frequency in (1.0, 2.0):
                name = f"{setting}-{voltage:.0f}-{frequency:.0f}"
                record = sine_test(truth, frequency, 0.03, cycles=4, voltage=voltage, name=name)
                warm = np.full(record.time.size, 22.0 + frequency / 2.0)
                records.append(replace(record, setting=setting, temperature=warm))
    return Rig(tuple(records), ())


def test_records_of_one_condition_share_a_row_and_settings_do_not() -> None:
    found = identify(IdentifyConfig(), rig(), seed=1)
    assert [(r.setting, r.voltage_V) for r in found.rows] == [
        ("narrow", 0.0),
        ("narrow", 150.0),
        ("wide", 0.0),
        ("wide", 150.0),
    ]
    assert len(found.measures) == 8
    assert found.untrusted(Control()) == ()


def test_parameters_are_the_same_where_nobody_asks_what_the_tests_show_without_a_model() -> None:
    whole, alone = identify(IdentifyConfig(), rig(), seed=1), identify(IdentifyConfig(), rig(), seed=1, described=False)
    assert alone.rows == whole.rows
    assert alone.auxiliary == whole.auxiliary
    assert whole.characteristics.peak_velocity
    assert not alone.characteristics.peak_velocity
    assert not alone.measures


def test_conditions_fitted_in_processes_of_their_own_give_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    told: list[Progress] = []
    alone = identify(IdentifyConfig(), rig(), seed=1, progress=told.append)
    monkeypatch.setattr("pzd.identification.stage.SAMPLES_WORTH_A_PROCESS", 0)
    together = list[Progress]()
    found = identify(IdentifyConfig(), rig(), seed=1, progress=together.append, jobs=3)
    assert vars(found) == vars(alone)
    assert together == told


@pytest.mark.parametrize(
    ("channel", "unit"), [("voltage", "V"), ("temperature", "degC")], ids=["voltage", "temperature"]
)
def test_a_setting_of_which_some_tests_lack_a_label_is_refused(channel: str, unit: str) -> None:
    """Its damper would depend on what these tests do not tell: the diagnosis ended in a fault of pzd."""
    whole = rig()
    lacking = [
        replace(r, **{channel: None}) if r.setting == "wide" and r.name.endswith("1") else r for r in whole.records
    ]
    with pytest.raises(DataError) as told:
        identify(IdentifyConfig(), Rig(tuple(lacking), ()), seed=1)
    said = f"wide-0-1 and 1 more test: no {channel}, which other tests of the setting have: say what it was, "
    assert str(told.value).startswith(f"{said}constants: {{{channel}: ... {unit}}}, or leave it out of all")
    none_has_it = [replace(r, **{channel: None}) if r.setting == "wide" else r for r in whole.records]
    assert identify(IdentifyConfig(), Rig(tuple(none_has_it), ()), seed=1).rows


def test_a_narrower_group_splits_conditions() -> None:
    config = IdentifyConfig.model_validate_json('{"group": {"temperature_degC": 0.1}}')
    assert len(identify(config, rig(), seed=1).rows) == 8


def test_without_voltage_and_temperature_there_is_one_condition() -> None:
    record = sine_test(TABLE_2[0.0], 2.0, 0.03, cycles=4)
    (row,) = identify(IdentifyConfig(), Rig((record,), ()), seed=1).rows
    assert row.voltage_V is None
    assert row.temperature_degC is None
    assert row.status == "ok"


def test_the_artefact_reads_back_as_it_was_written(tmp_path) -> None:
    found = identify(IdentifyConfig(), rig(), seed=1)
    found.write(tmp_path, Control())
    read = Identified.read(tmp_path, Control())
    assert read.rows == found.rows
    assert read.measures == found.measures


def test_progress_reports_every_condition() -> None:
    heard: list[Progress] = []
    identify(IdentifyConfig(), rig(), seed=1, progress=heard.append)
    assert [(event.done, event.whole) for event in heard] == [(i, 4) for i in range(1, 5)]
    assert all(event.what.startswith("conditions: ") for event in heard)


def test_the_evolutionary_method_is_chosen_by_name() -> None:
    single = Rig(rig().records[:1], ())
    config = IdentifyConfig(method="evolutionary")
    evolutionary, separable = (
        identify(config, single, seed=1).rows[0],
        identify(IdentifyConfig(), single, seed=1).rows[0],
    )
    assert evolutionary.W_s == pytest.approx(separable.W_s, rel=1e-6)


def test_an_unknown_method_or_key_is_refused() -> None:
    for wrong in ('{"method": "magic"}', '{"grid": 3}', '{"nodes": []}'):
        with pytest.raises(ValidationError):
            IdentifyConfig.model_validate_json(wrong)
