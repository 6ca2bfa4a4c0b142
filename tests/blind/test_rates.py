"""What counts as right and wrong, and how sure a rate is: on scored cases made by hand."""

from __future__ import annotations

import csv
from collections.abc import Callable
from pathlib import Path

import pytest

from pzd.blind.case import Scored
from pzd.blind.rates import Rate, brier_gain, calibration_rows, confidence_holds, rate_rows, right_answer
from pzd.blind.summary import confusion, write
from pzd.blind.targets import Line, campaign_lines, independent_lines, lines
from pzd.config import RunConfig
from pzd.quantities import Control

Make = Callable[..., Scored]


def line(cases: list[Scored], about: str, figure: str) -> Line:
    return next(one for one in lines(cases) if (one.about, one.figure) == (about, figure))


@pytest.mark.parametrize("count", [1, 10, 400])
def test_wilson_of_no_hits_ends_at_z2_over_n_plus_z2(count: int) -> None:
    low, high = Rate(0, count).interval
    assert low == pytest.approx(0.0, abs=1e-15)
    assert high == pytest.approx(1.959964**2 / (count + 1.959964**2), rel=1e-6)
    assert Rate(count, count).interval == pytest.approx((1.0 - high, 1.0), rel=1e-6)


def test_wilson_of_eight_of_ten_is_the_published_interval() -> None:
    assert Rate(8, 10).interval == pytest.approx((0.4902, 0.9433), abs=5e-5)


def test_a_rate_of_nothing_is_no_number() -> None:
    assert Rate(0, 0).share is None
    assert Rate(0, 0).interval == (0.0, 1.0)


def test_a_name_is_right_where_it_is_exactly_what_was_hidden(case: Make) -> None:
    said = [
        case(),
        case(effects=("asymmetry", "lash")),
        case(effects=("lash",)),
        case(verdict="ambiguous", rivals=("lash",)),
        case(verdict="none", effects=()),
    ]
    about = "visible, noise to 1 %"
    assert line(said, about, "right name").value == pytest.approx(0.2)
    assert line(said, about, "wrong name").value == pytest.approx(0.4)
    assert line(said, about, "truth among effects and rivals").value == pytest.approx(0.6)
    assert rate_rows(said)[0].truth_and_more == pytest.approx(0.2)


def test_each_campaign_has_rates_of_its_own(case: Make) -> None:
    outside: dict[str, object] = {"kind": "outside", "truth": ()}
    said = [
        case(campaign="swept"),
        case(campaign="road", verdict="ambiguous", rivals=("lash",)),
        case(campaign="road", effects=("lash",)),
        case(campaign="road", verdict="unexplained"),
        case(campaign="swept", kind="none", truth=(), verdict="none", effects=()),
        case(campaign="road", kind="none", truth=(), effects=("lash",)),
        case(campaign="road", **outside, verdict="unexplained", effects=()),
        case(campaign="road", **outside, verdict="none", effects=()),
    ]
    found = {(one.about, one.figure): (one.value, one.count) for one in campaign_lines(said)}
    assert found == {
        ("swept, visible", "right, or ambiguous with the truth"): (1.0, 1),
        ("swept, visible", "wrong name"): (0.0, 1),
        ("swept, no effect", "false names"): (0.0, 1),
        ("swept, outside the library, visible", "unexplained"): (None, 0),
        ("road, visible", "right, or ambiguous with the truth"): (pytest.approx(1 / 3), 3),
        ("road, visible", "wrong name"): (pytest.approx(1 / 3), 3),
        ("road, no effect", "false names"): (1.0, 1),
        ("road, outside the library, visible", "unexplained"): (0.5, 2),
    }


def test_a_failed_diagnosis_is_wrong_wherever_it_happens(case: Make) -> None:
    failed: dict[str, object] = {
        "verdict": None,
        "effects": (),
        "confidence": None,
        "gap_cut": None,
        "inside": {},
        "failure": "ValueError",
    }
    said = [
        case(**failed),
        case(kind="none", truth=(), hidden="none", visible_gap=0.0, **failed),
        case(kind="outside", truth=(), hidden="ripple", **failed),
    ]
    assert line(said, "visible, noise to 1 %", "wrong name").value == 1.0
    assert line(said, "no effect", "false names").value == 1.0
    assert line(said, "outside the library, visible", "a wrong single name").value == 1.0
    assert line(said, "all", "failed").value == 1.0


def test_a_gap_too_small_to_see_is_no_part_of_the_visible(case: Make) -> None:
    said = [case(visible_gap=0.0049, verdict="none", effects=()), case()]
    assert line(said, "visible, noise to 1 %", "right name").count == 1
    assert line(said, "gap 0.25-0.5 %", "right, or ambiguous with the truth").count == 1


def test_an_effect_too_small_to_be_anything_belongs_to_no_effect(case: Make) -> None:
    said = [case(hidden="preload_offset", truth=(), effects=("preload_offset",))]
    assert line(said, "no effect", "false names").value == 1.0


def test_an_answer_left_open_is_no_false_name_and_none_only_where_the_truth_cannot_be_told(case: Make) -> None:
    nothing: dict[str, object] = {"kind": "none", "truth": (), "hidden": "none", "visible_gap": 0.0}
    open_answer: dict[str, object] = {"verdict": "ambiguous", "effects": (), "rivals": ("sensor_delay",)}
    said = [
        case(**nothing, **open_answer),
        case(**nothing, **open_answer, told_apart=False),
        case(**nothing, verdict="ambiguous", effects=("lash",), rivals=("asymmetry",)),
        case(**nothing, verdict="none", effects=()),
    ]
    assert line(said, "no effect", "false names").value == 0.25
    assert line(said, "no effect", "left open, nothing adopted").value == 0.25
    assert [right_answer(one) for one in said] == [False, True, False, True]


def test_either_page_holds_the_verdicts_to_the_same_targets(case: Make) -> None:
    said = [case(), case(visible_gap=0.004), case(kind="none", truth=(), verdict="none", effects=())]
    said += [case(force_noise=0.02, effects=("lash",)), case(kind="outside", truth=(), verdict="unexplained")]
    own, independent = lines(said), independent_lines(said)
    asked = {(one.about, one.figure): (one.value, one.target) for one in own if one in independent}
    assert asked["something of the library hidden", "visible"] == (2 / 3, "")
    assert asked["visible", "right, or ambiguous with the truth"] == (0.5, ">= 95 %")
    assert asked["visible, noise to 1 %, all", "right name"] == (1.0, ">= 98 %")
    assert asked["visible", "wrong name"] == (0.5, "<= 0.5 %")
    assert asked["no effect", "false names"] == (0.0, "<= 1 %")
    assert asked["outside, described by nothing, visible", "unexplained"] == (1.0, ">= 95 %")
    assert ("rightly named, visible", "gap cut, median") in asked


def test_spring_and_mass_must_be_ambiguous_on_one_frequency(case: Make) -> None:
    alone = {"one_frequency": True, "truth": ("gas_spring",), "effects": ("gas_spring",)}
    about = "one frequency, spring or mass"
    assert line([case(**alone)], about, "ambiguous with the truth").met == "missed"
    both = case(**alone, verdict="ambiguous", rivals=("fluid_inertia",))
    assert line([both], about, "ambiguous with the truth").met == "met"


def test_both_of_a_pair_must_be_adopted(case: Make) -> None:
    pair = {
        "kind": "pair",
        "truth": ("asymmetry", "lash"),
        "gap_given_other": {"asymmetry": 0.01, "lash": 0.01},
        "effects": ("asymmetry", "lash"),
    }
    hidden = {**pair, "gap_given_other": {"asymmetry": 0.01, "lash": 0.001}}
    said = [case(**pair), case(**{**pair, "effects": ("asymmetry",)}), case(**hidden)]
    found = line(said, "pairs, each visible given the other", "both found")
    assert (found.value, found.count) == (0.5, 2)


def test_a_shape_counts_as_found_among_the_first_two_hypotheses(case: Make) -> None:
    outside = {"kind": "outside", "truth": (), "hidden": "tapered_rod", "verdict": "unexplained", "effects": ()}
    reported = (("x v", "x sign v"), ("x sign v", "x v"), ("x sign v", "x |v| v", "x v"), (), ("sin 2 pi x/lambda",))
    said = [case(**outside, shapes=shapes) for shapes in reported]
    unseen = case(**{**outside, "visible_gap": 0.004}, shapes=("x v",))
    found = line([*said, unseen], "outside the library, visible", "shape among the first two")
    assert (found.value, found.count, found.met) == (0.4, 5, "missed")
    assert line(said[:2], "outside the library, visible", "shape among the first two").met == "met"


def test_calibration_compares_stated_confidence_with_hits(case: Make) -> None:
    said = [case(confidence=0.97)] * 48 + [case(confidence=0.97, effects=("lash",))] * 12
    (row,) = calibration_rows(said)
    assert (row.stated, row.hit_rate, row.cases) == (0.97, 0.8, 60)
    assert [one.met for one in lines(said) if one.figure == "hit rate"] == ["missed"]


@pytest.mark.parametrize(
    ("said", "holds"),
    [
        ({}, True),
        ({"effects": ("lash",)}, False),
        ({"effects": ("asymmetry", "lash")}, False),
        ({"verdict": "none", "effects": ()}, False),
        ({"verdict": "none", "effects": (), "visible_gap": 0.002}, True),
        ({"visible_gap": 0.002}, True),
        ({"verdict": "ambiguous", "effects": ("lash",), "rivals": ("asymmetry",)}, True),
        ({"verdict": "ambiguous", "effects": (), "rivals": ("asymmetry",)}, True),
        ({"verdict": "ambiguous", "effects": (), "rivals": ("lash",)}, False),
        ({"verdict": "ambiguous", "effects": (), "rivals": ("lash",), "truth": (), "visible_gap": 0.0}, True),
        ({"verdict": "ambiguous", "effects": ("lash",), "truth": (), "visible_gap": 0.0}, False),
        ({"truth": ("asymmetry", "lash"), "gap_given_other": {"asymmetry": 0.01, "lash": 0.001}}, True),
        ({"truth": ("asymmetry", "lash"), "gap_given_other": {"asymmetry": 0.01, "lash": 0.003}}, False),
        ({"kind": "outside", "truth": (), "hidden": "ripple", "verdict": "none", "effects": ()}, False),
        ({"kind": "outside", "truth": (), "hidden": "ripple", "effects": ("asymmetry",)}, False),
    ],
)  # fmt: skip
def test_a_confidence_holds_where_nothing_that_counts_is_left_out_and_nothing_false_is_named(
    case: Make, said: dict[str, object], holds: bool
) -> None:
    assert confidence_holds(case(**said)) is holds


def test_the_best_constant_gains_nothing_and_the_truth_everything(case: Make) -> None:
    came = [{}] * 3 + [{"effects": ("lash",)}]
    assert brier_gain([case(confidence=0.75, **each) for each in came]) == pytest.approx(0.0)
    assert brier_gain([case(confidence=float(not each), **each) for each in came]) == 1.0
    assert brier_gain([case(), case(confidence=None, effects=("lash",))]) is None


def test_bins_of_200_are_asked_whether_their_hit_rate_agrees(case: Make) -> None:
    """Five bins, of which the fourth states 80 % and holds in 60."""
    said = [
        case(confidence=stated, effects=("asymmetry",) if i < 200 * rate else ("lash",))
        for stated, rate in ((0.2, 0.2), (0.4, 0.4), (0.6, 0.6), (0.8, 0.6), (0.95, 0.95))
        for i in range(200)
    ]
    found = [one.met for one in lines(said) if one.target == "in its interval"]
    assert found == ["met", "met", "met", "missed", "met"]
    assert [one.met for one in lines(said[1:]) if one.target == "in its interval"] == []


def test_intervals_count_from_400_parameters_on(case: Make) -> None:
    said = [case()] * 380 + [case(inside={"asymmetry.alpha": False})] * 19
    assert line(said, "rightly found, visible", "parameters inside their 95 % interval").met == "too few"
    assert line([*said, case()], "rightly found, visible", "parameters inside their 95 % interval").met == "met"


def test_what_is_handed_on_is_held_to_the_noise_free_force_whatever_its_name(case: Make) -> None:
    said = [case(gap_cut_gains_out=cut) for cut in (0.9, 0.5, -0.01, None)]
    said.append(case(effects=("lash",), gap_cut_gains_out=-0.2))
    found = {line.figure: line for line in lines(said) if line.about.startswith("effects handed on")}
    farther, much = found.values()
    assert (farther.value, farther.count, farther.met) == (0.5, 4, "missed")
    assert (much.value, much.count, much.met) == (0.25, 4, "missed")


def test_gap_cuts_are_of_the_rightly_named_alone(case: Make) -> None:
    said = [case(gap_cut=cut) for cut in (0.5, 0.9, 0.95)] + [case(effects=("lash",), gap_cut=-3.0)]
    assert line(said, "rightly named, visible", "gap cut, median").value == pytest.approx(0.9)


def test_a_target_is_met_at_its_limit(case: Make) -> None:
    said = [case()] * 95 + [case(verdict="none", effects=())] * 5
    assert line(said, "visible", "right, or ambiguous with the truth").met == "met"
    said.append(case(verdict="none", effects=()))
    assert line(said, "visible", "right, or ambiguous with the truth").met == "missed"


def test_every_case_has_one_cell_of_the_matrix(case: Make) -> None:
    said = [
        case(),
        case(verdict="ambiguous", rivals=("lash",)),
        case(visible_gap=0.001, verdict="none", effects=()),
        case(kind="outside", truth=(), hidden="ripple", verdict="unexplained", effects=()),
        case(kind="none", truth=(), hidden="none", effects=("lash", "asymmetry")),
    ]
    matrix = confusion(said)
    assert matrix.counts.sum() == len(said)
    assert matrix.counts[matrix.rows.index("asymmetry"), matrix.columns.index("asymmetry")] == 1
    assert matrix.counts[matrix.rows.index("none"), matrix.columns.index("several")] == 1


def test_tables_picture_and_page_are_written(case: Make, small: Callable[..., RunConfig], tmp_path: Path) -> None:
    blind = small("blind.seed=1", "blind.tuning=true").blind
    assert blind is not None
    folder = tmp_path / "written"
    printed = write([case(), case(effects=("lash",))], folder, Control(), blind)
    assert "no result" in printed[0]
    assert len(printed) < 45
    assert {path.name for path in folder.iterdir()} == {
        "rates.csv",
        "calibration.csv",
        "confusion.csv",
        "confusion.png",
        "summary.json",
    }
    with (folder / "confusion.csv").open(encoding="utf-8") as file:
        rows = list(csv.reader(file))
    assert sum(int(cell) for row in rows[1:] for cell in row[1:]) == 2
