"""What could be mistaken for an effect is not given its name; what hides in every test alike is; drawn afresh."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from campaign import damper_of, sines
from test_naming import TWO
from whole_diagnosis import diagnosed

from pzd.artefacts import Rig
from pzd.artefacts.rig import Finding, RecordEntry
from pzd.diagnosis.data import saturation_note, unsaturated_records
from pzd.record import Record

LINEAR_TESTS = ((0.5, 0.015), (0.5, 0.03), (2.0, 0.01), (2.0, 0.02))


@pytest.mark.ci
@pytest.mark.parametrize(("form", "values"), [("guide_friction", {"F_g": 40.0}), ("cubic_spring", {"k_3": 6e6})])
def test_a_force_that_is_in_no_library_is_not_named_after_the_effect_next_to_it(
    form: str, values: dict[str, float], rng: np.random.Generator
) -> None:
    records = sines(damper_of(TWO).with_effect(form, values), rng, TWO, tests=LINEAR_TESTS)
    told = diagnosed(records).diagnosis
    assert told.verdict in ("ambiguous", "unexplained"), told.reason
    assert form not in {*told.effects, *told.rivals}
    assert told.confidence is None or told.confidence < 0.9


@pytest.mark.ci
def test_an_offset_that_any_test_could_have_is_an_effect_where_every_test_has_it(
    rng: np.random.Generator,
) -> None:
    # 1.5 to 2 % of the peaks at 0 V: three to four standard deviations of one test's own offset.
    records = sines(damper_of(TWO, preload_offset={"F_0": 14.0}), rng, TWO)
    told = diagnosed(records).diagnosis
    assert (told.verdict, told.effects) == ("named", ("preload_offset",)), told.reason


@pytest.mark.ci
def test_a_mean_that_creeps_is_no_gap(rng: np.random.Generator) -> None:

    def creeping(record: Record) -> Record:
        return replace(record, displacement=record.displacement + 1e-3 * record.time / record.time[-1])

    records = sines(damper_of(TWO), rng, TWO, tests=LINEAR_TESTS, cycles=5)
    told = diagnosed(tuple(creeping(r) for r in records)).diagnosis
    assert told.verdict == "none", told.reason


def test_records_whose_force_is_cut_off_are_left_out_and_named(rng: np.random.Generator) -> None:
    records = sines(damper_of(TWO), rng, TWO, tests=((1.0, 0.02),), cycles=3)
    cut = Finding(
        check="saturation", where="force, 3 plateaus at 900 N, the first at 1 s", size=0.1, unit="-", follows=""
    )
    entries = tuple(
        RecordEntry(name=r.name, setting=None, voltage_V=U, temperature_degC=None, rate_Hz=1e3, cycles=3.0, findings=f)
        for r, U, f in zip(records, TWO, ((cut,), ()), strict=True)
    )
    used, left_out = unsaturated_records(Rig(records, entries), None)
    assert [r.name for r in used] == [records[1].name]
    assert records[0].name in saturation_note(left_out)
    every = tuple(e.model_copy(update={"findings": (cut,)}) for e in entries)
    assert unsaturated_records(Rig(records, every), None) == (list(records), ())
