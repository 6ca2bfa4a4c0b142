"""Knee law of passive dampers: bleed, knee and blow-off, and the choice of the law by held-out tests."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np
import pytest
from numpy.random import Generator

from pzd.artefacts import (
    Diagnosed,
    Identified,
    KneeForceRow,
    KneeRow,
    Knees,
    LawRow,
    PredictedRow,
    Rig,
    identified_damper,
)
from pzd.artefacts.csv_rows import Estimate
from pzd.artefacts.knee import knee_damper
from pzd.damper.compose import respond, static_force, steady_force
from pzd.damper.model import BaseRow, Damper
from pzd.damper.motion import Motion
from pzd.diagnosis.config import DiagnoseConfig
from pzd.diagnosis.stage import diagnose
from pzd.diagnosis.verdict import knee_suffices
from pzd.identification.config import IdentifyConfig
from pzd.identification.knee import TRADE_SPEEDS, HeldOutLaws, force_changes, identify_knees, law_row
from pzd.identification.knee_fit import KneeCurve, KneeData, KneeForm
from pzd.identification.stage import identify
from pzd.parallel.processes import no_listener
from pzd.quantities import Control
from pzd.record import Array, Record
from pzd.report.tables import knee as knee_tables
from pzd.rig.config import FilesEntry, RigConfig
from pzd.schema.errors import ConfigError, DataError
from pzd.signals.nuisance import NuisanceConfig

RATE = 400.0
TESTS = ((0.5, 0.02), (1.0, 0.02), (2.0, 0.02), (3.0, 0.02), (5.0, 0.012))
"""Frequency [Hz] and amplitude [m]."""
TRUTH = Damper(
    base=(BaseRow(T0_N=40.0, C_Ns_per_m=2000.0, k_N_per_m=2e6),),
    effects={
        "knee": {"beta": 0.3, "F_reb": 300.0, "C_reb": 800.0, "F_comp": 180.0, "C_comp": 500.0},
        "preload_offset": {"F_0": -250.0},
        "gas_spring": {"k_g": 2500.0},
    },
)
BINGHAM = Damper(base=(BaseRow(T0_N=120.0, C_Ns_per_m=1500.0, k_N_per_m=1e6),))
STAND = RigConfig(files=(FilesEntry(path="*.csv"),))
Law = Callable[[Motion], Array]


def swing(frequency: float, amplitude: float) -> Motion:
    """Four cycles of a sine, or two seconds."""
    time = np.arange(round(max(2.0, 4.0 / frequency) * RATE)) / RATE
    w = 2.0 * np.pi * frequency
    x, v, a = (amplitude * f for f in (np.sin(w * time), w * np.cos(w * time), -(w**2) * np.sin(w * time)))
    return Motion(time, x, v, a)


def rig(law: Law, rng: np.random.Generator, noise: float = 0.003, tests: Sequence[tuple[float, float]] = TESTS) -> Rig:
    """The tests on a damper, with white noise of a share of peak force."""
    records = []
    for number, test in enumerate(tests):
        motion = swing(*test)
        force = law(motion)
        force = force + noise * float(np.max(np.abs(force))) * rng.standard_normal(force.size)
        parts = (motion.time, motion.displacement, motion.velocity, motion.acceleration, force)
        records.append(Record(f"r{number}", None, *parts))
    return Rig(tuple(records), ())


def of(damper: Damper) -> Law:
    """The force of a damper of ours."""
    return lambda motion: respond(damper, motion)


def round_knees(motion: Motion) -> Array:
    """A passive monotube damper whose knees are round: no law of ours."""
    x, v = motion.displacement, motion.velocity
    rebound = 1500.0 * v / (1.0 + np.abs(v) / 0.15) + 400.0 * v
    compression = 700.0 * v / (1.0 + np.abs(v) / 0.1) + 350.0 * v
    return np.where(v > 0.0, rebound, compression) + 35.0 * np.tanh(v / 0.004) - 280.0 / (1.0 + x / 0.12) ** 1.2


def found(law: Law, rng: np.random.Generator) -> Identified:
    return identify(IdentifyConfig(law="auto"), rig(law, rng), 1)


@pytest.fixture(scope="module")
def tests_of_a_knee(generator_for: Callable[[str], np.random.Generator]) -> Rig:
    return rig(of(TRUTH), generator_for("a damper with knees"))


@pytest.fixture(scope="module")
def with_a_knee(tests_of_a_knee: Rig) -> Identified:
    return identify(IdentifyConfig(law="knee"), tests_of_a_knee, 1)


@pytest.fixture(scope="module")
def with_round_knees(generator_for: Callable[[str], np.random.Generator]) -> Identified:
    return found(round_knees, generator_for("a damper with round knees"))


def diagnosed_by(law: Literal["auto", "knee"], truth: Damper, rng: np.random.Generator) -> tuple[Diagnosed, LawRow]:
    """The diagnosis of a damper under a law of the config, and the law that identify took."""
    records, config = rig(of(truth), rng), IdentifyConfig(law=law)
    here = identify(config, records, 1)
    (taken,) = here.knees.laws
    assert taken.law == "knee"
    return diagnose(DiagnoseConfig(), config, STAND, records, here, Control(), None, 1), taken


@pytest.mark.ci
def test_effects_beside_t0_and_c_take_the_place_of_a_knee_law_that_predicts_far_worse(
    rng: np.random.Generator,
) -> None:
    """Fewer numbers say the same: an orifice and a gas that hardens, which the knee law follows with twelve."""
    effects = {"orifice_quadratic": {"q": 3000.0}, "accumulator": {"F_g": 250.0, "L": 0.06}}
    truth = Damper(base=(BaseRow(T0_N=60.0, C_Ns_per_m=600.0, k_N_per_m=8e5),), effects=effects)
    one, other = rng.spawn(2)
    told, law = diagnosed_by("auto", truth, one)
    assert set(told.diagnosis.effects) == {"orifice_quadratic", "accumulator"}, told.diagnosis.reason
    assert told.diagnosis.prediction is not None
    assert law.W_s_knee is not None
    assert told.diagnosis.prediction.W_s < 0.1 * law.W_s_knee
    assert "this is beside one T0 and C" in told.diagnosis.reason
    kept, _ = diagnosed_by("knee", truth, other)
    assert "knee" in kept.damper.effects  # the config asks for it


@pytest.mark.ci
def test_what_a_law_of_two_stages_has_not_predicts_beside_it(rng: np.random.Generator) -> None:
    """A friction of its own in either direction, and a hysteresis, which no piston of two stages has."""
    effects = {
        "asymmetry": {"alpha": 0.3},
        "relief_valve": {"F_r": 350.0, "C_r": 300.0},
        "second_branch": {"T0_2": 30.0, "k_2": 3e4},
    }
    truth = Damper(base=(BaseRow(T0_N=60.0, C_Ns_per_m=1200.0, k_N_per_m=8e5),), effects=effects)
    told, law = diagnosed_by("auto", truth, rng)
    assert told.diagnosis.prediction is not None
    assert law.W_s_knee is not None
    assert told.diagnosis.prediction.W_s < 0.1 * law.W_s_knee


def test_bleed_knee_and_blow_off_of_each_direction_lie_in_their_intervals(with_a_knee: Identified) -> None:
    (row,) = with_a_knee.knees.rows
    truth = {
        "rebound_bleed_Ns_per_m": 2600.0,
        "rebound_knee_force_N": 300.0,
        "rebound_knee_velocity_m_per_s": 260.0 / 2600.0,
        "rebound_blow_off_Ns_per_m": 800.0,
        "compression_bleed_Ns_per_m": 1400.0,
        "compression_knee_force_N": 180.0,
        "compression_knee_velocity_m_per_s": 140.0 / 1400.0,
        "compression_blow_off_Ns_per_m": 500.0,
        "friction_N": 40.0,
        "gas_force_N": -250.0,
        "gas_spring_N_per_m": 2500.0,
        "k_N_per_m": 2e6,
    }
    outside = []
    for name, expected in truth.items():
        value, low, high = Estimate.of(row, name)
        assert value == pytest.approx(expected, rel=0.1)
        outside += [] if low <= expected <= high else [name]
    assert len(outside) <= 2  # twelve intervals of 95 %: three or more fail once in fifty
    assert row.W_s < 1e-4
    assert row.missed_share == 0.0


def test_held_out_tests_of_a_damper_with_round_knees_are_predicted_five_times_better(
    with_round_knees: Identified,
) -> None:
    (law,) = with_round_knees.knees.laws
    assert law.law == "knee"
    assert law.tests == len(TESTS)
    assert law.W_s_knee < 0.2 * law.W_s_bingham
    (row,) = with_round_knees.knees.rows
    assert row.gas_force_N == pytest.approx(-287.0, abs=10.0)  # the mean of 280 / (1 + x / 0.12)^1.2 over the stroke
    assert row.friction_N == pytest.approx(35.0, rel=0.15)
    assert row.rebound_knee_spread_N is not None
    assert row.seal_m_per_s == pytest.approx(0.004, rel=0.2)


def test_a_bingham_damper_has_no_knee_and_keeps_its_law(rng: np.random.Generator) -> None:
    here = found(of(BINGHAM), rng)
    (row,), (law,) = here.knees.rows, here.knees.laws
    assert row.rebound_knee_force_N is None
    assert row.compression_blow_off_Ns_per_m is None
    assert row.rebound_bleed_Ns_per_m == pytest.approx(1500.0, rel=0.03)
    assert law.law == "bingham"
    assert identified_damper(here, None).effects == {}


def progressive(motion: Motion) -> Array:
    """A monotube damper whose force rises faster than the speed: no law of ours."""
    flow = 900.0 * np.abs(motion.velocity) ** 1.6 * np.sign(motion.velocity)
    return np.where(flow > 0.0, flow, 0.6 * flow) + 30.0 * np.tanh(motion.velocity / 0.004) - 170.0


@pytest.mark.parametrize(("of_damper", "taken"), [(progressive, "knee"), (of(BINGHAM), "bingham")])
def test_three_tests_choose_the_knee_law_where_it_describes_them_far_better(
    of_damper: Law, taken: str, rng: np.random.Generator
) -> None:
    """Of three tests kept back in turn the fastest lies far beyond the others, and chance makes nearly everything."""
    tests = ((1.0, 0.02), (2.0, 0.02), (4.0, 0.02))
    (law,) = identify(IdentifyConfig(law="auto"), rig(of_damper, rng, tests=tests), 1).knees.laws
    assert law.tests == 3
    assert law.law == taken, law.reason


def test_a_friction_at_its_limit_of_none_has_an_interval(rng: np.random.Generator) -> None:
    """A force that is less than viscous at rest draws it there, to 1e-14 N: by a step of so little no force moves."""
    row = TRUTH.base[0].model_copy(update={"T0_N": 0.0})
    smooth = of(TRUTH.model_copy(update={"base": (row,)}))
    (knee,) = found(lambda motion: smooth(motion) - 15.0 * np.tanh(motion.velocity / 0.01), rng).knees.rows
    assert knee.friction_N < 0.01
    assert knee.friction_N_low95 == 0.0
    assert 0.0 < knee.friction_N_high95 < 100.0  # a tenth of the force


def needle_and_shims(motion: Motion) -> Array:
    """A digressive race damper: a jet and shims beside each other, without an oil spring: no law of ours.

    Equation: |v| = F / (c sqrt(F + F_l)) + max(F - F_o, 0) / C_o
    """
    force = np.geomspace(1e-3, 3e3, 4000)

    def flow(c: float, opens: float, slope: float) -> Array:
        speed = force / (c * np.sqrt(force + 5.0)) + np.maximum(force - opens, 0.0) / slope
        return np.interp(np.abs(motion.velocity), speed, force)

    v = motion.velocity
    return np.where(v > 0.0, flow(350.0, 600.0, 1500.0), -flow(250.0, 320.0, 900.0)) + 35.0 * np.tanh(v / 1e-3)


def test_a_bleed_through_a_jet_is_square_and_leaves_the_friction_to_the_seal(rng: np.random.Generator) -> None:
    """A straight bleed is too large at low speed, and none of the friction is left to the seal (W_s 0.006)."""
    (row,) = found(needle_and_shims, rng).knees.rows
    assert row.W_s < 1e-4
    assert row.rebound_bleed_square_Ns2_per_m2 == pytest.approx(350.0**2, rel=0.1)
    assert row.compression_bleed_square_Ns2_per_m2 == pytest.approx(250.0**2, rel=0.1)
    assert row.rebound_knee_force_N == pytest.approx(635.0, rel=0.03)
    assert row.compression_knee_force_N == pytest.approx(355.0, rel=0.03)
    assert row.friction_N == pytest.approx(35.0, abs=5.0)


def test_a_damper_of_a_building_has_the_same_law_in_larger_numbers(generator_for: Callable[[str], Generator]) -> None:
    """Of 20 MN: numbers of the law beyond what those of a car have are no reason to end with a fault."""
    strong = 2e4
    of_car, of_building = (
        found(lambda motion, times=times: times * needle_and_shims(motion), generator_for("alike")).knees.rows[0]
        for times in (1.0, strong)
    )
    assert of_building.rebound_bleed_square_Ns2_per_m2 == pytest.approx(
        strong * (of_car.rebound_bleed_square_Ns2_per_m2 or 0.0), rel=1e-3
    )
    assert of_building.rebound_knee_force_N == pytest.approx(strong * (of_car.rebound_knee_force_N or 0.0), rel=1e-3)
    assert of_building.W_s == pytest.approx(of_car.W_s, rel=1e-3)


def shims_and_a_seal(motion: Motion) -> Array:
    """A damper of a shop: shims that lift off little by little beside a bleed, an oil spring, and a lip on the rod."""
    oil = TRUTH.base[0].model_copy(update={"T0_N": 0.0})
    knee = {**TRUTH.effects["knee"], "s_reb": 25.0, "s_comp": 18.0}
    damper = TRUTH.model_copy(update={"base": (oil,)}).with_effect("knee", knee)
    return respond(damper.with_effect("seal", {"F_s": 40.0, "v_s": 1e-3}), motion)


def test_spread_of_the_knees_and_friction_on_the_rod_are_found_where_they_are(rng: np.random.Generator) -> None:
    here = found(shims_and_a_seal, rng)
    (row,) = here.knees.rows
    truth = {
        "rebound_bleed_Ns_per_m": 2600.0,
        "rebound_knee_force_N": 340.0,
        "rebound_knee_spread_N": 25.0,
        "rebound_blow_off_Ns_per_m": 800.0,
        "compression_bleed_Ns_per_m": 1400.0,
        "compression_knee_force_N": 220.0,
        "compression_knee_spread_N": 18.0,
        "compression_blow_off_Ns_per_m": 500.0,
        "friction_N": 40.0,
        "seal_m_per_s": 1e-3,
        "k_N_per_m": 2e6,
    }
    outside = []
    for name, expected in truth.items():
        value, low, high = Estimate.of(row, name)
        assert value == pytest.approx(expected, rel=0.25)
        outside += [] if low <= expected <= high else [name]
    assert len(outside) <= 2
    damper = identified_damper(here, None)
    assert damper.base[0].T0_N == 0.0
    assert damper.effects["seal"]["F_s"] == row.friction_N
    assert damper.effects["knee"]["F_reb"] == pytest.approx(300.0, rel=0.05)  # of the oil alone


def test_a_round_knee_beyond_the_tests_that_are_left_without_the_fastest_is_still_fitted(
    rng: np.random.Generator,
) -> None:
    """To predict the one fast test the others, none of which reaches the knee, are fitted alone."""
    base = TRUTH.base[0].model_copy(update={"T0_N": 10.0, "k_N_per_m": 4e6})
    law = {
        "beta": 0.25,
        "F_reb": 500.0,
        "C_reb": 500.0,
        "F_comp": 385.0,
        "C_comp": 400.0,
        "s_reb": 60.0,
        "s_comp": 40.0,
    }
    truth = Damper(base=(base,), effects={"knee": law})
    tests = [(2.0, speed / (4.0 * np.pi)) for speed in (0.02, 0.05, 0.08, 0.6)]
    here = identify(IdentifyConfig(law="auto"), rig(of(truth), rng, 0.001, tests), 1)
    assert here.knees.law_of(None) == "knee"


def test_a_friction_behind_the_oil_spring_is_not_put_on_the_rod(with_a_knee: Identified) -> None:
    (row,) = with_a_knee.knees.rows
    assert row.seal_m_per_s is None
    assert row.rebound_knee_spread_N is row.compression_knee_spread_N is None


def test_straight_bleeds_have_no_square_part(with_a_knee: Identified) -> None:
    (row,) = with_a_knee.knees.rows
    assert row.rebound_bleed_square_Ns2_per_m2 is row.compression_bleed_square_Ns2_per_m2 is None


def test_a_damper_written_before_bleeds_had_a_square_part_is_read() -> None:
    """Its bleeds are straight."""
    now = {**TRUTH.effects["knee"], "q_reb": 0.0, "q_comp": 0.0}
    np.testing.assert_array_equal(of(TRUTH)(swing(2.0, 0.02)), of(TRUTH.with_effect("knee", now))(swing(2.0, 0.02)))


def test_noise_of_the_displacement_is_no_force_of_a_stiff_oil_spring(rng: np.random.Generator) -> None:
    """3 um and 8e6 N/m make 24 N where the rod turns, and the friction paid for it."""
    row = TRUTH.base[0].model_copy(update={"k_N_per_m": 8e6})
    clean = rig(of(TRUTH.model_copy(update={"base": (row,)})), rng, noise=1e-4)
    noisy = [replace(r, displacement=r.displacement + 3e-6 * rng.standard_normal(r.time.size)) for r in clean.records]
    (knee,) = identify(IdentifyConfig(law="knee"), Rig(tuple(noisy), ()), 1).knees.rows
    assert knee.W_s < 1e-5
    assert knee.friction_N == pytest.approx(40.0, abs=1.0)
    assert knee.k_N_per_m == pytest.approx(8e6, rel=0.1)


def test_a_knee_in_one_direction_alone_is_found_in_that_direction_alone(rng: np.random.Generator) -> None:
    values = {**TRUTH.effects["knee"], "F_comp": 1e7, "C_comp": 1400.0}
    (row,) = found(of(TRUTH.with_effect("knee", values)), rng).knees.rows
    assert row.rebound_knee_force_N == pytest.approx(300.0, rel=0.05)
    assert row.compression_knee_force_N is None
    assert row.compression_bleed_Ns_per_m == pytest.approx(1400.0, rel=0.03)


def test_bingham_stays_the_law_unless_asked_with_the_same_rows_and_no_file_of_the_knee(
    tests_of_a_knee: Rig, with_a_knee: Identified, tmp_path: Path
) -> None:
    here = identify(IdentifyConfig(), tests_of_a_knee, 1)
    here.write(tmp_path, Control())
    assert not (tmp_path / "knee.csv").exists()
    assert Identified.read(tmp_path, Control()).knees == here.knees == Knees()
    assert here.rows == with_a_knee.rows


def test_the_files_of_the_knee_law_read_back_as_written(with_a_knee: Identified, tmp_path: Path) -> None:
    with_a_knee.write(tmp_path, Control())
    assert Identified.read(tmp_path, Control()).knees == with_a_knee.knees


def test_a_damper_whose_knee_law_misses_nothing_is_handed_on_as_it_was_identified(
    with_a_knee: Identified, tmp_path: Path
) -> None:
    handed = knee_suffices(with_a_knee, None, DiagnoseConfig())
    assert handed is not None
    assert handed.damper == handed.baseline == identified_damper(with_a_knee, None)
    assert handed.diagnosis.verdict == "none"
    assert "misses nothing beyond noise" in handed.diagnosis.reason
    handed.write(tmp_path, Control())
    assert Diagnosed.read(tmp_path, Control()).damper == handed.damper
    speeds = np.array([-0.3, -0.05, 0.05, 0.3])
    expected = steady_force(TRUTH, None, None, speeds)
    np.testing.assert_allclose(steady_force(handed.damper, None, None, speeds), expected, rtol=0.03)
    text = (tmp_path / "damper.yaml").read_text().replace("preload_offset", "lash").replace("F_0: ", "delta: 0")
    (tmp_path / "damper.yaml").write_text(text)
    with pytest.raises(DataError):
        Diagnosed.read(tmp_path, Control())


def test_a_knee_law_that_misses_something_visible_does_not_suffice(with_round_knees: Identified) -> None:
    assert knee_suffices(with_round_knees, None, DiagnoseConfig()) is None


def test_a_setting_whose_control_signal_always_moves_has_no_knee_law() -> None:
    with pytest.raises(ConfigError, match=r"law: needs tests of setting soft at a constant control.*\(got knee\)"):
        identify_knees((), ("soft",), IdentifyConfig(law="knee"), Control(), no_listener)
    (law,) = identify_knees((), ("soft",), IdentifyConfig(law="auto"), Control(), no_listener).laws
    assert law.law == "bingham"
    assert "constant control signal" in law.reason


def predicted(apart: float, count: int, scatter: float = 0.0, unseen: float = 0.001) -> list[HeldOutLaws]:
    """Tests that Bingham misses by so much more than the knee law, give or take."""
    rows: list[HeldOutLaws] = []
    for i in range(count):
        bingham = 0.02 + apart + scatter * (-1) ** i
        row = PredictedRow(
            record=f"r{i}", setting=None, voltage_V=None, temperature_degC=None, W_s_bingham=bingham, W_s_knee=0.02
        )
        rows.append((row, (bingham, 1.0, 1.0, unseen), (0.02, 1.0, 1.0, unseen)))
    return rows


def test_the_knee_is_taken_where_it_predicts_better_beyond_chance_and_not_below() -> None:
    # Six log ratios of ln(1.5) on average, +- s: Student's t of five degrees of freedom asks for 2.65 s / sqrt(5).
    assert law_row("auto", None, predicted(0.01, 6, 0.0085, unseen=0.0), [1.0]).law == "knee"
    assert law_row("auto", None, predicted(0.01, 6, 0.0095, unseen=0.0), [1.0]).law == "bingham"
    assert law_row("auto", None, predicted(-0.01, 6), [1.0]).law == "bingham"


def test_every_test_counts_alike_however_slow() -> None:
    # A slow test, in which friction is all of the force, has a W_s a hundred times that of the others.
    ratios = {"slow": (0.9, 18.0), "a": (0.008, 60.0), "b": (0.006, 120.0), "c": (0.005, 210.0), "d": (0.004, 150.0)}
    rows = []
    for name, (bingham, ratio) in ratios.items():
        both = {"W_s_bingham": bingham, "W_s_knee": bingham / ratio}
        row = PredictedRow(record=name, setting=None, voltage_V=None, temperature_degC=None, **both)
        energy = 1.0 if name == "slow" else 1e4
        entries = [tuple(energy * each for each in (error, 1.0, 1.0, 1e-6)) for error in both.values()]
        rows.append((row, entries[0], entries[1]))
    law = law_row("auto", None, rows, [1.0])
    assert law.law == "knee"
    assert "better in 5 of 5" in law.reason


def test_an_invisible_improvement_chooses_no_knee_law_however_significant() -> None:
    law = law_row("auto", None, predicted(0.01, 6, unseen=0.011), [1.0])
    assert law.law == "bingham"
    assert "by less than 0.25% of peak" in law.reason


def test_too_few_tests_choose_no_law_and_the_reason_says_so() -> None:
    law = law_row("auto", None, predicted(0.01, 2), [1.0])
    assert law.law == "bingham"
    assert "3 are needed" in law.reason
    assert law_row("knee", None, [], [1.0]).law == "knee"


def knee_row(voltage: float | None = None, zero: float = 0.0, temperature: float | None = None) -> KneeRow:
    """A row whose forces grow with the control signal."""
    u = 1.0 + (voltage or 0.0)
    values = {
        "rebound_bleed_Ns_per_m": 1000.0 * u,
        "rebound_knee_force_N": 200.0 * u,
        "rebound_knee_velocity_m_per_s": 0.15,
        "rebound_blow_off_Ns_per_m": 400.0 * u,
        "compression_bleed_Ns_per_m": 500.0 * u,
        "compression_knee_force_N": None,
        "compression_knee_velocity_m_per_s": None,
        "compression_blow_off_Ns_per_m": None,
        "friction_N": 50.0 * u,
        "gas_force_N": -200.0,
        "gas_spring_N_per_m": 3000.0,
        "k_N_per_m": 1e6,
    }
    ends = {f"{name}_{end}": value for name, value in values.items() for end in ("low95", "high95")}
    return KneeRow.model_validate(
        {"setting": None, "voltage_V": voltage, "temperature_degC": temperature, **values, **ends}
        | {"zero_m": zero, "reached_m_per_s": 0.4, "W_s": 0.0, "rmse_N": 0.0, "missed_share": 0.0, "status": "ok"}
    )


def test_the_damper_of_several_conditions_has_the_law_of_each_at_its_voltage_and_is_linear_between() -> None:
    damper = knee_damper([knee_row(0.0), knee_row(2.0)])
    at = [float(steady_force(damper, voltage, None, 0.3)) for voltage in (0.0, 1.0, 2.0)]
    assert at[0] == pytest.approx(200.0 + 400.0 * 0.15)
    assert at[2] == pytest.approx(3.0 * at[0])
    assert at[1] == pytest.approx(2.0 * at[0], rel=1e-6)
    assert float(steady_force(damper, 0.0, None, -0.3)) == pytest.approx(-50.0 - 500.0 * 0.3)


def test_one_level_at_two_temperatures_is_one_node_though_its_labels_differ_a_little() -> None:
    labels = ((0.0, 20.0), (0.0, 60.0), (1.998, 20.0), (2.003, 60.0))
    damper = knee_damper([knee_row(voltage, temperature=warm) for voltage, warm in labels])
    assert {values["at_voltage_V"] for values in damper.effects.values()} == {(0.0, 1.998)}
    assert len(damper.base) == 4


def test_a_gas_that_no_condition_shows_is_no_effect_of_the_damper() -> None:
    rows = [knee_row(u).model_copy(update={"gas_force_N": 0.0, "gas_spring_N_per_m": 0.0}) for u in (0.0, 2.0)]
    assert set(knee_damper(rows).effects) == {"knee"}
    assert set(knee_damper([rows[0], knee_row(2.0)]).effects) == {"knee", "preload_offset", "gas_spring"}


@pytest.mark.parametrize("force", [0.0, -31.6])
def test_without_a_gas_that_does_not_show_all_else_is_fitted_again(force: float, rng: np.random.Generator) -> None:
    # Load cells whose zero may be off by 40 % of the peak: a gas force of 31.6 N is no news. Taken out of the joint
    # fit alone it would leave both sides of the curve 31.6 N off the tests.
    true = TRUTH.without_effects("preload_offset", "gas_spring").with_effect("preload_offset", {"F_0": force})
    here = rig(of(true), rng, 0.001)
    config = IdentifyConfig(law="knee", nuisance=NuisanceConfig(offset=0.4))
    (row,) = identify(config, here, 1).knees.rows
    assert row.gas_force_N == row.gas_spring_N_per_m == 0.0
    assert row.gas_force_N_low95 == row.gas_force_N_high95 == 0.0
    damper, speeds = knee_damper([row]), np.array([0.3, -0.3])
    assert steady_force(damper, None, None, speeds) == pytest.approx(
        steady_force(true, None, None, speeds) + force, abs=5.0
    )


def test_a_bingham_fit_that_no_stage_uses_is_no_reason_to_distrust(with_a_knee: Identified) -> None:
    undetermined = [
        row.model_copy(update={"C_Ns_per_m": None, "status": "undetermined: C"}) for row in with_a_knee.rows
    ]
    here = replace(with_a_knee, rows=tuple(undetermined))
    assert here.untrusted(Control()) == ()
    assert len(replace(here, knees=Knees()).untrusted(Control())) == 1


def test_a_spring_below_zero_that_the_tests_show_is_read_back(tmp_path: Path) -> None:
    ends = {f"gas_spring_N_per_m{end}": value for end, value in (("", -900.0), ("_low95", -950.0), ("_high95", -850.0))}
    law = LawRow(setting=None, law="knee", tests=0, W_s_bingham=None, W_s_knee=None, reason="as the config asks for")
    here = Identified((), (), knees=Knees((knee_row().model_copy(update=ends),), laws=(law,)))
    handed = knee_suffices(here, None, DiagnoseConfig())
    assert handed is not None
    handed.write(tmp_path, Control())
    assert Diagnosed.read(tmp_path, Control()).damper.effects["gas_spring"] == {"k_g": -900.0}


def test_the_gas_force_counts_from_one_zero_of_the_displacement_in_all_conditions() -> None:
    damper = knee_damper([knee_row(0.0, zero=-0.01), knee_row(2.0, zero=0.01)])
    assert damper.zero_m == 0.0
    np.testing.assert_allclose(static_force(damper, np.array([0.0, 2.0])), [-170.0, -230.0])


def force_row(setting: str | None, voltage: float | None, force: float, gas: float = -100.0) -> KneeForceRow:
    return KneeForceRow(
        setting=setting,
        voltage_V=voltage,
        temperature_degC=None,
        velocity_m_per_s=0.131,
        rebound_force_N=force + gas,
        compression_force_N=-0.5 * force + gas,
        gas_force_N=gas,
        inside=1,
    )


def test_a_click_is_the_force_between_neighbouring_positions_over_their_distance_without_the_gas() -> None:
    forces = [force_row(None, 4.0, 460.0, gas=-150.0), force_row(None, 0.0, 300.0), force_row(None, 1.0, 310.0)]
    rows, _ = force_changes(forces, Control("rebound", "clicks"))
    assert [(row.from_click, row.to_click) for row in rows] == [(0.0, 1.0), (1.0, 4.0)]
    assert [row.rebound_N_per_click for row in rows] == pytest.approx([10.0, 50.0])
    assert [row.compression_N_per_click for row in rows] == pytest.approx([5.0, 25.0])


def test_clickers_in_the_name_of_a_setting_are_told_apart() -> None:
    forces = [force_row("R3 C8", None, 300.0), force_row("R5 C8", None, 340.0), force_row("R3 C9", None, 303.0)]
    rows, _ = force_changes(forces, Control())
    assert {(row.setting, row.rebound_N_per_click) for row in rows} == {("R# C8", 20.0), ("R3 C#", 3.0)}


def test_settings_without_a_number_have_no_clicks() -> None:
    assert force_changes([force_row("soft", None, 300.0), force_row("hard", None, 600.0)], Control()) == ((), ())


def test_a_volt_is_no_click() -> None:
    assert force_changes([force_row(None, 0.0, 300.0), force_row(None, 1.0, 310.0)], Control()) == ((), ())


@pytest.mark.parametrize("unit", ["psi", "bar", "kPa"])
def test_a_gas_pressure_has_a_force_per_unit_with_the_change_of_the_gas_force(unit: str) -> None:
    forces = [force_row(f"gas {p} {unit}", 5.0, 300.0 + 0.2 * p, gas=-1.5 * p) for p in (200, 100)]
    clicks, (row,) = force_changes(forces, Control())
    assert (row.setting, row.voltage_V, row.unit) == (f"gas # {unit}", 5.0, unit)
    assert (row.from_value, row.to_value) == (100.0, 200.0)
    assert row.rebound_N_per_unit == pytest.approx(0.2)
    assert row.compression_N_per_unit == pytest.approx(0.1)
    assert row.gas_force_N_per_unit == pytest.approx(-1.5)
    assert clicks == ()


@pytest.mark.parametrize("gas", [(0.0, 0.0), (0.0, -180.0)])
def test_a_gas_force_that_a_pressure_does_not_tell_changes_by_nothing_that_is_known(gas: tuple[float, float]) -> None:
    """It was 0 N/psi, or all of the other's, and what the gas did stood in neither direction."""
    low, high = (force_row(f"{p} psi", None, 300.0 + 0.2 * p, gas=g) for p, g in zip((50, 150), gas, strict=True))
    _, (row,) = force_changes([low, high], Control())
    assert row.gas_force_N_per_unit is None
    assert row.rebound_N_per_unit == pytest.approx((high.rebound_force_N - low.rebound_force_N) / 100.0)
    assert row.compression_N_per_unit == pytest.approx((low.compression_force_N - high.compression_force_N) / 100.0)


def test_a_number_that_no_test_shows_is_not_told_with_its_interval() -> None:
    ends = {"rebound_bleed_Ns_per_m_low95": 0.0, "rebound_bleed_Ns_per_m_high95": 1e8}
    row = knee_row().model_copy(update={**ends, "reached_m_per_s": 0.2, "W_s": 0.01, "rmse_N": 20.0})
    rebound, compression = Knees((row,)).directions()
    assert not rebound.shows("bleed_Ns_per_m")
    assert compression.shows("bleed_Ns_per_m")
    (table,) = (each for each in knee_tables(Knees((row,)), Control()) if each.title.startswith("Bleed, knee"))
    told = "\n".join(table.lines())
    assert "not shown" in told
    assert "1e+08" not in told


def test_a_gas_pressure_may_be_the_control_signal() -> None:
    forces = [force_row(None, p, 300.0 + 20.0 * p, gas=-30.0 * p) for p in (5.0, 10.0, 20.0)]
    clicks, rows = force_changes(forces, Control("gas", "bar"))
    assert [(row.setting, row.voltage_V, row.unit) for row in rows] == [(None, None, "bar")] * 2
    assert [(row.from_value, row.to_value) for row in rows] == [(5.0, 10.0), (10.0, 20.0)]
    assert [row.rebound_N_per_unit for row in rows] == pytest.approx([20.0, 20.0])
    assert [row.gas_force_N_per_unit for row in rows] == pytest.approx([-30.0, -30.0])
    assert clicks == ()


def test_a_clicker_and_a_gas_pressure_in_one_name_are_told_apart() -> None:
    names = {"C4 100psi": 300.0, "C6 100psi": 340.0, "C4 150psi": 310.0}
    forces = [force_row(name, None, force) for name, force in names.items()]
    clicks, units = force_changes(forces, Control())
    assert [(row.setting, row.rebound_N_per_click) for row in clicks] == [("C# 100psi", 20.0)]
    assert [(row.setting, row.rebound_N_per_unit) for row in units] == [("C4 #psi", 0.2)]


def test_the_trade_reads_its_forces_at_the_speeds_of_a_crank_of_100_mm() -> None:
    assert TRADE_SPEEDS == (0.052, 0.131, 0.262, 0.393, 0.524, 1.047, 1.571)


def test_the_slopes_of_the_fit_are_derivatives_of_the_force(tests_of_a_knee: Rig) -> None:
    tests = KneeData.of(tests_of_a_knee.records[2:4])
    form = KneeForm(has_knee=(True, False), has_square=(True, True), has_round_knee=(True, False), has_seal=True)
    curve = KneeCurve(
        40.0, (2600.0, 900.0), 2e6, (0.08, np.inf), (800.0, 900.0), (4000.0, 1500.0), (30.0, 0.0), seal_speed=2e-3
    )
    x, gas = form.searched(curve, tests.peak), np.array([-250.0, 2500.0])
    slopes = tests.sensitivities(lambda x: form.found(x, tests.peak), x, np.ones(x.size), gas)
    for column, step in zip(slopes.T, 1e-4 * np.eye(x.size), strict=True):
        before, after = (tests.simulated(form.found(x + s, tests.peak), gas) for s in (-step, step))
        difference = (after - before) / 2e-4
        assert np.linalg.norm(column - difference) <= 0.01 * np.linalg.norm(difference)


# --- What a passive damper lacks beside the law ---


def passive(draw: np.random.Generator) -> Damper:
    """A damper by the knee law as drawers have them: digressive both ways, rebound unlike compression, gas that pushes.

    Knees lie within the speeds of the tests, and what flows beyond them is softer.
    """
    damping = float(np.exp(draw.uniform(np.log(800.0), np.log(3000.0))))
    friction, beta = float(draw.uniform(10.0, 60.0)), float(draw.uniform(-0.4, 0.5))
    slopes = {"reb": damping * (1.0 + beta), "comp": damping * (1.0 - beta)}
    knee = {f"F_{side}": friction + slope * float(draw.uniform(0.06, 0.15)) for side, slope in slopes.items()}
    knee |= {f"C_{side}": slope * float(draw.uniform(0.25, 0.5)) for side, slope in slopes.items()}
    row = BaseRow(T0_N=friction, C_Ns_per_m=damping, k_N_per_m=damping / float(draw.uniform(3e-4, 1e-3)))
    gas = {"preload_offset": {"F_0": -float(draw.uniform(50.0, 300.0))}, "gas_spring": {"k_g": 2000.0}}
    return Damper(base=(row,), effects={"knee": {"beta": beta, **knee}, **gas})


@pytest.mark.parametrize(
    ("name", "values", "strength"),
    [
        ("lash", {"delta": 5e-4}, "delta"),
        ("second_branch", {"T0_2": 40.0, "k_2": 1.5e5}, "T0_2"),
        pytest.param("end_stop", {"k_e": 3e7, "x_e": 0.017}, "x_e", marks=pytest.mark.ci),
        pytest.param("cavitation", {"d_c": 8e-4, "F_c": 200.0}, "d_c", marks=pytest.mark.ci),
    ],
)
def test_what_is_missing_beside_the_knee_law_is_named_with_its_size(
    name: str, values: dict[str, float], strength: str, rng: np.random.Generator
) -> None:
    truth = passive(rng).with_effect(name, values)
    handed, _ = diagnosed_by("knee", truth, rng)
    assert (handed.diagnosis.verdict, handed.diagnosis.effects) == ("named", (name,)), handed.diagnosis.reason
    given = handed.diagnosis.parameters[name][strength]
    assert isinstance(given.value, float)
    np.testing.assert_allclose(given.value, values[strength], rtol=0.05)
    prediction = handed.diagnosis.prediction
    assert prediction is not None
    assert prediction.W_s < 0.3 * prediction.W_s_plain
    # The law is fitted again beside the effect: alone it had bent towards what the effect does.
    for of_law in ("F_reb", "F_comp"):
        alone, beside, true = (
            float(np.mean(d.effects["knee"][of_law])) for d in (handed.baseline, handed.damper, truth)
        )
        assert abs(beside - true) <= max(0.02 * true, abs(alone - true))


def test_gas_that_hardens_is_named_beside_the_knee_law(rng: np.random.Generator) -> None:
    gas = {"F_g": 250.0, "L": 0.06}
    truth = passive(rng).without_effects("preload_offset", "gas_spring").with_effect("accumulator", gas)
    handed, _ = diagnosed_by("knee", truth, rng)
    assert handed.diagnosis.effects == ("accumulator",), handed.diagnosis.reason


def test_gas_that_hardens_is_named_beside_knees_that_are_round(
    with_round_knees: Identified, generator_for: Callable[[str], np.random.Generator]
) -> None:
    records = rig(round_knees, generator_for("a damper with round knees"))
    handed = diagnose(
        DiagnoseConfig(), IdentifyConfig(law="knee"), STAND, records, with_round_knees, Control(), None, 1
    )
    assert handed.diagnosis.effects == ("accumulator",), handed.diagnosis.reason
    # The gas of the damper has another exponent, so that the numbers of the law are others; its force is not.
    time, none = np.arange(2000) * 1e-3, np.zeros(2000)
    for place in (-0.018, 0.0, 0.018):
        at_rest = float(respond(handed.damper, Motion(time, none + place, none, none))[-1])
        assert at_rest == pytest.approx(-280.0 / (1.0 + place / 0.12) ** 1.2, rel=0.01)


@pytest.mark.ci
def test_at_several_clicks_the_law_has_numbers_of_its_own_and_the_play_one(rng: np.random.Generator) -> None:
    """The gas of the law is no effect that another one could stand for."""
    of_clicks = [passive(draw).with_effect("lash", {"delta": 5e-4}) for draw in rng.spawn(2)]
    records = [
        replace(r, name=f"{r.name}_{clicks}", voltage=np.full(r.time.size, float(clicks)))
        for clicks, damper in enumerate(of_clicks)
        for r in rig(of(damper), rng).records
    ]
    config, clicker = IdentifyConfig(law="knee"), Control(name="rebound", unit="clicks")
    tests = Rig(tuple(records), ())
    handed = diagnose(DiagnoseConfig(), config, STAND, tests, identify(config, tests, 1), clicker, None, 1)
    assert (handed.diagnosis.verdict, handed.diagnosis.rivals) == ("named", ()), handed.diagnosis.reason
    assert handed.diagnosis.effects == ("lash",)
    for clicks, truth in enumerate(of_clicks):
        found, true = handed.damper.effects["knee"]["F_reb"], truth.effects["knee"]["F_reb"]
        assert isinstance(found, tuple)
        assert found[clicks] == pytest.approx(true, rel=0.03)


def test_a_gas_that_is_a_spring_alone_at_its_zero_is_written_and_read_back_beside_an_effect(
    rng: np.random.Generator, tmp_path: Path
) -> None:
    """Away from that zero it has a force too: in the damper that is handed on, and in the one it is compared with."""
    plain = passive(rng).without_effects("preload_offset")
    truth = plain.with_effect("lash", {"delta": 5e-4})
    shifted = [replace(r, displacement=r.displacement + 0.01) for r in rig(of(truth), rng).records]
    records, config = Rig(tuple(shifted), ()), IdentifyConfig(law="knee")
    here = identify(config, records, 1)
    spring_alone = here.knees.rows[0].model_copy(
        update={"zero_m": 0.012, "gas_force_N": 0.0, "gas_force_N_low95": 0.0, "gas_force_N_high95": 0.0}
    )
    here = replace(here, knees=replace(here.knees, rows=(spring_alone,)))
    handed = diagnose(DiagnoseConfig(), config, STAND, records, here, Control(), None, 1)
    assert "lash" in handed.diagnosis.effects
    handed.write(tmp_path, Control())
    read = Diagnosed.read(tmp_path, Control())
    assert (read.damper.effects.keys(), read.baseline.zero_m) == (handed.damper.effects.keys(), handed.damper.zero_m)
