"""The stage from records to a verdict."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from synthetic import TWO, all_but, coloured, damper_of, diagnosed, sine, sines, waveform

from pzd.artefacts import Diagnosed, Rig, Value, base_of
from pzd.damper.compose import respond
from pzd.damper.effects import library
from pzd.damper.model import Damper
from pzd.damper.motion import Motion
from pzd.diagnosis.cleaned_records import clean
from pzd.diagnosis.entries import parameters_of
from pzd.diagnosis.fit.prediction import predict
from pzd.diagnosis.gap import check_residual
from pzd.diagnosis.roles import HELD_OUT, TRAINING, VALIDATION, split
from pzd.diagnosis.search.acceptance import Selection
from pzd.identification.config import IdentifyConfig
from pzd.identification.stage import identify
from pzd.quantities import Control
from pzd.record import Array, Record
from pzd.signals.nuisance import NuisanceConfig, nuisance_forces

NEIGHBOURS = ("preload_offset", "asymmetry", "gas_spring")
"""An offset of the force, and what is nearest to one."""


def road(damper: Damper, rng: np.random.Generator, voltage: float, displacement_noise: float = 0.0) -> Record:
    """Random motion that never repeats, 10 s at 500 Hz."""
    fine = np.arange(-1.0, 10.0, 1.0 / 4000.0)
    lines = np.arange(0.3, 12.0, 0.0937)
    parts = [waveform(fine + rng.uniform(0, 10), float(f), 0.003 / float(f)) for f in lines]
    x, v, a = (np.sum([p[i] for p in parts], axis=0) for i in range(3))
    force = respond(damper, Motion(fine, x, v, a, np.full(fine.size, voltage)))
    keep = slice(4000, None, 8)
    peak = float(np.max(np.abs(force)))
    measured = force[keep] + coloured(rng, fine[keep].size, 0.01 * peak, 0.9)
    seen: Array = x[keep] + displacement_noise * rng.standard_normal(measured.size)
    U = np.full(measured.size, voltage)
    return Record(f"road{voltage:g}", None, fine[keep], seen, v[keep], a[keep], measured, U)


def test_a_complete_damper_is_unchanged_with_the_verdict_none(rng: np.random.Generator) -> None:
    records = sines(damper_of(TWO), rng, TWO, jitter=0.02, cycles=5)
    found = diagnosed(records)
    assert found.diagnosis.verdict == "none"
    assert found.diagnosis.confidence is not None
    assert found.diagnosis.confidence > 0.95  # noise of these tests would hide next to nothing that counts
    assert found.diagnosis.where == ()
    gap = found.diagnosis.gap
    assert gap.before == gap.after
    assert gap.before == pytest.approx(gap.noise_floor, rel=0.4)
    assert found.damper == found.baseline == base_of(identify(IdentifyConfig(), Rig(records, ()), 1).rows, None)
    # Nothing was adopted, so the plain damper is what predicts.
    assert found.diagnosis.effects == ()
    prediction = found.diagnosis.prediction
    assert prediction is not None
    assert prediction.W_s == prediction.W_s_plain
    assert all(each.W_s == each.W_s_plain for each in prediction.by)


@pytest.mark.ci
def test_displacement_noise_of_a_tenth_of_a_millimetre_is_no_missing_effect(rng: np.random.Generator) -> None:
    records = sines(damper_of(TWO), rng, TWO, jitter=0.01, displacement_noise=1e-4, cycles=5)
    assert diagnosed(records).diagnosis.verdict == "none"


@pytest.mark.parametrize(
    ("effects", "place", "forbid"),
    [
        ({"preload_offset": {"F_0": 120.0}}, "constant offset of the force", all_but(*NEIGHBOURS)),
        pytest.param({"preload_offset": {"F_0": 120.0}}, "constant offset of the force", (), marks=pytest.mark.ci),
        pytest.param({"orifice_quadratic": {"q": 4000.0}}, "abs(v) > 0.25 m/s", (), marks=pytest.mark.ci),
    ],
    ids=["an offset among few", "an offset", "an orifice"],
)
def test_a_missing_effect_is_named_and_located(
    rng: np.random.Generator, effects: dict[str, dict[str, float]], place: str, forbid: tuple[str, ...]
) -> None:
    found = diagnosed(sines(damper_of(TWO, **effects), rng, TWO, cycles=5), forbid=forbid)
    assert found.diagnosis.verdict == "named"
    assert found.diagnosis.effects == tuple(effects)
    assert any(place in region.region for region in found.diagnosis.where)
    assert all(0.0 < region.share_of_gap <= 1.0 for region in found.diagnosis.where)
    gap = found.diagnosis.gap
    assert gap.before > gap.noise_floor
    assert gap.hold_out == "records"


@pytest.mark.ci
def test_a_misfit_at_one_voltage_is_located_there(rng: np.random.Generator) -> None:
    records = tuple(
        sine(damper_of(asymmetry={"alpha": 0.15 if U == 150.0 else 0.0}), U, f, 0.03, rng)
        for U in TWO
        for f in (0.5, 2.0)
    )
    told = diagnosed(records, forbid=all_but(*NEIGHBOURS)).diagnosis
    best = [region for region in told.where if region.region == "150 V"]
    assert best
    assert best[0].share_of_gap > 0.9


def test_one_sine_a_voltage_holds_out_cycles_and_says_that_this_is_weak(rng: np.random.Generator) -> None:
    found = diagnosed(sines(damper_of(), rng, tests=((2.0, 0.03),))).diagnosis
    assert found.verdict == "none"
    assert found.gap.hold_out == "cycles"
    assert len(found.gap.held_out) == 4
    assert "weak" in found.reason


@pytest.mark.ci
@pytest.mark.parametrize("displacement_noise", [0.0, 5e-5])
def test_roads_without_a_missing_effect_are_within_the_noise(
    rng: np.random.Generator, displacement_noise: float
) -> None:
    found = diagnosed(tuple(road(damper_of(TWO), rng, U, displacement_noise) for U in TWO)).diagnosis
    assert found.verdict == "none"
    assert found.gap.hold_out == "segments"


@pytest.mark.ci
def test_roads_show_what_misses_although_nothing_repeats(rng: np.random.Generator) -> None:
    damper = damper_of(TWO, gas_spring={"k_g": 2e4})
    found = diagnosed(tuple(road(damper, rng, U) for U in TWO))
    assert "gas_spring" in found.diagnosis.effects + found.diagnosis.rivals
    if found.diagnosis.effects:
        base = found.damper.base
        assert [(r.voltage_V, r.C_Ns_per_m) for r in found.parameters] == [(b.voltage_V, b.C_Ns_per_m) for b in base]
        assert all(r.C_Ns_per_m_low95 < r.C_Ns_per_m < r.C_Ns_per_m_high95 for r in found.parameters)


def test_the_same_rig_gives_the_same_diagnosis_and_reads_back(rng: np.random.Generator, tmp_path: Any) -> None:
    records = sines(damper_of(TWO), rng, TWO, tests=((2.0, 0.03),))
    first, second = diagnosed(records), diagnosed(records)
    assert first.diagnosis == second.diagnosis
    first.write(tmp_path, Control())
    again = Diagnosed.read(tmp_path, Control())
    assert again.diagnosis == first.diagnosis
    assert again.parameters == first.parameters
    assert [r.voltage_V for r in again.parameters] == [r.voltage_V for r in first.baseline.base]


def test_every_role_has_every_kind_of_test_over_the_conditions(rng: np.random.Generator) -> None:
    cleaned = clean(sines(damper_of(), rng, cycles=4))
    parts = split(cleaned, None, 2.0)
    whole = [int(roles[0]) for roles in parts.roles]
    assert all(np.all(roles == role) for roles, role in zip(parts.roles, whole, strict=True))
    assert [whole.count(role) for role in (TRAINING, VALIDATION, HELD_OUT)] == [8, 4, 4]
    kinds = [
        (round(p.cycles.frequency, 2), round(float(np.ptp(p.record.displacement)), 3)) for p in cleaned if p.cycles
    ]
    for role in (TRAINING, VALIDATION, HELD_OUT):
        # The rig's hardest test is always fitted, so one kind may be missing elsewhere.
        kept = len({kind for kind, given in zip(kinds, whole, strict=True) if given == role})
        assert kept >= (4 if role == TRAINING else 3)
    for U in range(4):
        fitted = [kinds[i][0] for i in range(4 * U, 4 * U + 4) if whole[i] == TRAINING]
        assert len(set(fitted)) == 2


def test_two_records_of_a_condition_hold_one_out_whole(rng: np.random.Generator) -> None:
    cleaned = clean(sines(damper_of(TWO), rng, TWO, tests=((0.5, 0.03), (2.0, 0.03))))
    parts = split(cleaned, None, 2.0)
    assert parts.hold_out == "records"
    assert sorted(np.unique(roles).tolist() for roles in parts.roles) == [[0, 1], [0, 1], [2], [2]]


def test_small_offset_gain_and_delay_are_nuisances_and_large_ones_a_gap(rng: np.random.Generator) -> None:
    damper = damper_of([0.0])
    for offset, gain, share in ((0.005, 1.03, 0.05), (0.05, 1.0, 0.5)):
        record = sine(damper, 0.0, 2.0, 0.03, rng, noise=1e-4, offset=offset, gain=gain)
        (cleaned,) = clean([record])
        everything = np.ones(cleaned.record.time.size, dtype=np.bool_)
        judged = check_residual(
            predict(damper, cleaned, NuisanceConfig().delay_s), cleaned, everything, NuisanceConfig()
        )
        left = float(np.sqrt(np.mean(judged.cleared**2)) / np.sqrt(np.mean(judged.residual**2)))
        assert left < share if offset < 0.01 else left > share


def test_a_nuisance_explains_a_pure_delay() -> None:
    t = np.arange(2000) / 1000.0
    force = 1000.0 * np.sin(4 * np.pi * t)
    late = 1000.0 * np.sin(4 * np.pi * (t - 4e-4)) - force
    everything = np.ones(t.size, dtype=np.bool_)
    explained = sum(
        nuisance_forces(late, force, 1000.0, 1e-2, NuisanceConfig(), np.zeros((t.size, 0)), everything, everything)
    )
    assert np.max(np.abs(explained - late)) < 0.03 * np.max(np.abs(late))


def test_cleaned_displacement_keeps_the_corners_of_a_triangle(rng: np.random.Generator) -> None:
    t = np.arange(20000) / 1000.0
    harmonics = np.arange(1, 40, 2)
    triangle = 0.02 * sum(np.cos(2 * np.pi * h * t) / h**2 for h in harmonics)
    zero = np.zeros(t.size)
    noisy = triangle + 1e-4 * rng.standard_normal(t.size)
    (cleaned,) = clean([Record("t", None, t, noisy, zero, zero, zero)])
    true = replace(cleaned.record, displacement=np.interp(cleaned.record.time, t, triangle))
    error = cleaned.record.displacement - true.displacement
    assert cleaned.cycles is not None
    assert np.sqrt(np.mean(error**2)) < 3e-5


# --- Mains hum is no gap of the damper, and hides none


def humming(damper: Damper, rng: np.random.Generator) -> tuple[Record, ...]:
    """Sines of two frequencies with hum of 2 % of the softest test's peak, near a harmonic of the motion."""
    records = sines(damper, rng, TWO, jitter=0.005, cycles=8)
    amplitude = 0.02 * min(float(np.max(np.abs(record.force))) for record in records)
    waves = [amplitude * np.sin(2.0 * np.pi * 60.007 * record.time + rng.uniform(0.0, 6.0)) for record in records]
    return tuple(replace(r, force=r.force + wave) for r, wave in zip(records, waves, strict=True))


def test_hum_alone_is_no_gap_and_is_reported(rng: np.random.Generator) -> None:
    found = diagnosed(humming(damper_of(TWO), rng), forbid=all_but("preload_offset", "orifice_quadratic")).diagnosis
    assert found.verdict == "none"
    assert "mains hum of up to" in found.reason
    assert "is taken for no gap" in found.reason


@pytest.mark.ci
def test_an_effect_is_named_through_the_hum(rng: np.random.Generator) -> None:
    found = diagnosed(humming(damper_of(TWO, orifice_quadratic={"q": 4000.0}), rng)).diagnosis
    assert (found.verdict, found.effects) == ("named", ("orifice_quadratic",))
    q = found.parameters["orifice_quadratic"]["q"].value
    assert q == pytest.approx(4000.0, rel=0.05)


@pytest.mark.ci
def test_without_hum_none_is_reported(rng: np.random.Generator) -> None:
    records = sines(damper_of(TWO), rng, TWO, jitter=0.005, cycles=8)
    assert "hum" not in diagnosed(records, forbid=all_but("preload_offset")).diagnosis.reason


# --- An effect too faint to show in the gap as a whole


def test_a_name_never_rests_on_a_gap_of_nothing(rng: np.random.Generator) -> None:
    """Two cycles know little of noise, and less of it showed no gap: an effect was named with a gap of 0 %."""
    damper = damper_of((0.0,), orifice_quadratic={"q": 8000.0})
    record = sine(damper, 0.0, 1.0, 0.015, rng, noise=0.007, colour=0.0, cycles=2, rate=500.0)
    told = diagnosed((record,)).diagnosis
    assert told.effects == ("orifice_quadratic",)
    assert "falls from 0 %" not in told.reason
    moved = re.search(r"(?:moves the force by|the gap falls from) ([0-9.]+) % ", told.reason)
    assert moved is not None
    assert 0.25 <= float(moved[1]) < 5.0


# --- Units of effect parameters under another control signal


CONTROLS = [(Control(), "V"), (Control("current", "A"), "A")]


@pytest.mark.parametrize(("control", "unit"), CONTROLS)
def test_a_play_is_found_in_the_unit_of_the_control_and_an_orifice_in_its_own(
    control: Control, unit: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    damper = damper_of((0.0, 150.0)).with_effect("piezo_hysteresis", {"r": 5.0})
    damper = damper.with_effect("orifice_quadratic", {"q": 900.0})
    names = {"piezo_hysteresis": 5.0, "orifice_quadratic": 900.0}
    unknowns: list[Any] = [
        SimpleNamespace(effect=name, parameter=library()[name].parameters[0], value_in=lambda _, value=value: value)
        for name, value in names.items()
    ]
    monkeypatch.setattr("pzd.diagnosis.entries.standard_errors", lambda _: (0.1, 10.0))
    fitted = SimpleNamespace(damper=damper, unknowns=unknowns)
    selection = cast("Selection", SimpleNamespace(fitted=fitted, adopted=tuple(damper.effects)))
    found = parameters_of(selection, control)
    assert (found["piezo_hysteresis"]["r"].value, found["piezo_hysteresis"]["r"].unit) == (5.0, unit)
    assert found["orifice_quadratic"]["q"].unit == "N s2/m2"


@pytest.mark.parametrize(("control", "unit"), CONTROLS)
def test_a_play_that_was_edited_by_hand_is_read_in_the_unit_of_the_control(
    control: Control, unit: str, tmp_path: Path
) -> None:
    name, plain = "piezo_hysteresis", damper_of((0.0, 150.0))
    made = Diagnosed.undiagnosed(plain.with_effect(name, {"r": 6.0}), plain)
    found = {name: {"r": Value(value=5.0, low95=4.0, high95=6.0, unit=unit)}}
    replace(made, diagnosis=made.diagnosis.model_copy(update={"effects": (name,), "parameters": found})).write(
        tmp_path, control
    )
    told = Diagnosed.read(tmp_path, control).diagnosis.parameters[name]["r"]
    assert (told.value, told.low95, told.unit) == (6.0, None, unit)
