"""The first screen: a sentence, the loop that is missed with its difference, what closes the gap, the best policy."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from pzd.artefacts import Rig
from pzd.report.blocks import amount, typewritten
from pzd.report.config import ReportConfig
from pzd.report.page import answer, told
from pzd.report.plots.answer import best_policy, closing, missed_loop


@pytest.fixture
def context_of(monkeypatch: pytest.MonkeyPatch) -> Any:
    """What the report of a run is made from."""

    def context(run: Any) -> Any:
        seen: list[Any] = []
        monkeypatch.setattr("pzd.report.page.page", lambda found, jobs: seen.append(found) or "")
        run.told()
        return seen[0]

    return context


def test_the_sentence_names_what_is_missing_and_how_far_the_error_falls(run: Any, context_of: Any) -> None:
    """In r.m.s.: W_s goes from 0.0121 = 0.11^2 to 0.0009 = 0.03^2."""
    said = answer(context_of(run)).replace("\xa0", " ")
    assert said == (
        "The simple model lacks turbulent flow through a sharp orifice (97 % sure): with it the error on tests that no "
        "fit has seen falls from 11 % to 3 % of the force, r.m.s.; noise alone leaves 2.8 %."
    )


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"verdict": "none", "effects": ()}, "The simple model describes this damper as well as these tests can tell"),
        (
            {"verdict": "unexplained", "effects": ()},
            "Something is missing that the library of effects does not explain",
        ),
        ({"verdict": "ambiguous", "effects": ()}, "These tests do not settle whether anything is missing"),
        (
            {"verdict": "ambiguous", "rivals": ("shear_thinning",)},
            "The simple model lacks orifice quadratic or shear thinning, alone or together; these tests do not ",
        ),
        ({"gap": None}, "The simple model lacks turbulent flow through a sharp orifice (97"),
    ],
)
def test_every_verdict_has_its_sentence(run: Any, context_of: Any, changes: dict[str, Any], said: str) -> None:
    shown = answer(context_of(run.with_diagnosis(**changes)))
    assert shown.startswith(said)
    assert shown.endswith(".")


def test_what_the_user_says_of_the_damper_stands_in_the_head(run: Any) -> None:
    page = run.told(ReportConfig(about={"serial number": 117, "operator": "N. <N>"})).page
    head = page.partition('class="answer-line"')[0]
    assert "<dt>serial number</dt><dd>117</dd>" in head
    assert "<dt>operator</dt><dd>N. &lt;N&gt;</dd>" in head


def test_what_the_drive_lacks_is_shown_where_the_control_signal_moves(run: Any, context_of: Any) -> None:
    """No constant test misses anything of a lag; the mean of cycles in which the signal steps would be no cycle."""
    steady = run.rig.records[0]
    stepped = replace(
        steady,
        name="stepped",
        voltage=np.where(steady.time < 0.5 * steady.time[-1], 0.0, 150.0),
        force=steady.force + 900.0 * (np.abs(steady.time - 0.5 * steady.time[-1]) < 0.05),
    )
    moved = Rig(
        (*run.rig.records, stepped), (*run.rig.entries, run.rig.entries[0].model_copy(update={"name": stepped.name}))
    )
    context = context_of(replace(run, rig=moved))
    (panel,) = missed_loop(context)
    assert panel.caption.startswith("stepped at 0 to 150\u00a0V")
    assert stepped not in context.tests.shown
    assert "stepped, 0 to 150\u00a0V, 22\u00a0°C" in context.tests.labels(moved.records)


def test_the_difference_below_is_measured_less_model_on_a_scale_of_its_own(run: Any, context_of: Any) -> None:
    """The simple model lacks q w |w|: with q = 1510 N s2/m2 and w of some 0.3 m/s more than a hundred newtons."""
    (panel,) = missed_loop(context_of(run))
    upper, lower = panel.figure.axes
    measured, simple, final = (line.get_ydata() * 1000.0 for line in upper.lines)
    zero, missed, left = (line.get_ydata() for line in lower.lines)
    assert np.all(np.asarray(zero) == 0.0)
    assert missed == pytest.approx(measured - simple)
    assert left == pytest.approx(measured - final)
    assert np.abs(missed).max() > 100.0 > np.abs(left).max()
    assert f"up to {amount(np.abs(missed).max(), 'N', 2)}" in panel.caption
    assert lower.get_ylim()[1] < 0.5 * 1000.0 * upper.get_ylim()[1]


def test_the_bars_are_errors_in_percent_of_the_force_with_the_interval_of_the_adopted(
    run: Any, context_of: Any
) -> None:
    context = context_of(run)
    gap = context.diagnosed.diagnosis.gap
    (panel,) = closing(context)
    (ax,) = panel.figure.axes
    assert [(bar.get_width() / 100.0) ** 2 for bar in ax.patches] == pytest.approx(
        [gap.before, gap.after, gap.noise_floor, 0.0009, 0.004]
    )
    assert [label.get_text() for label in ax.get_yticklabels()] == [
        "held-out tests:", "simple model", "with orifice quadratic", "noise floor",
        "seen tests:", "orifice quadratic", "shear thinning",
    ]  # fmt: skip
    held_out, candidate = (lines.get_segments()[0][:, 0] for lines in ax.collections)
    assert (held_out / 100.0) ** 2 == pytest.approx([gap.after + s * 1.96 * gap.standard_error for s in (-1.0, 1.0)])
    assert (candidate / 100.0) ** 2 == pytest.approx([0.004 + s * 1.96 * 0.0005 for s in (-1.0, 1.0)])


def test_the_best_policy_is_the_one_with_the_least_a_w_and_stands_out(run: Any, context_of: Any) -> None:
    """Dynamically the best fixed voltage beats the controlled one, by the table not: the nearest to a car counts."""
    (panel,) = best_policy(context_of(run))
    bold = [text.get_text() for text in panel.figure.axes[0].texts if text.get_weight() == "bold"]
    assert bold == ["best fixed voltage"]
    assert "best fixed voltage is the most comfortable" in panel.caption


def test_the_terminal_ends_with_what_the_page_begins_with_in_signs_that_it_has(run: Any, context_of: Any) -> None:
    """The best policy leads, and the law of the paper is told beside it with the reason why it falls behind."""
    found = run.told()
    first, best, why = found.answer
    assert first == typewritten(answer(context_of(run)))
    assert best.startswith("Which policy rides best? 2.25 Hz sine: best fixed voltage 62 V, a_w ")
    assert "The law of the paper (policy comfort) beside the best fixed voltage, dynamic: 2.25 Hz sine: a_w " in why
    assert "It knows neither the lag of the valve nor the oil spring." in why
    assert all(line.isascii() for line in found.answer)


def test_without_rides_the_terminal_tells_of_the_damper_alone(run: Any) -> None:
    assert len(run.with_rides([]).told().answer) == 1


def test_without_a_control_the_rides_are_told_in_sentences_that_end_once(
    run: Any, context_of: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    context = context_of(run)
    monkeypatch.setattr(type(context), "controlled", False)
    _, felt, *_ = told(context)
    assert felt.startswith("What does the passenger feel? ")
    assert felt.endswith(".")
    assert ".." not in felt
