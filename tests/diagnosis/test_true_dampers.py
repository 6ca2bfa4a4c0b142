"""A plain damper from anywhere explains its own tests: what is left beside it is noise, for the fit and for the gap."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from pzd.damper.model import BaseRow, Damper
from pzd.diagnosis.campaign import Campaign, Evidence, evidence_of
from pzd.diagnosis.cleaned_records import centred_on, clean
from pzd.diagnosis.config import DiagnoseConfig
from pzd.diagnosis.fit.likelihood import WeightedRecord, shown_force
from pzd.diagnosis.fit.problem import Budget
from pzd.diagnosis.roles import split
from pzd.record import mid_stroke
from tests.studies.plain_study import SEED, Case, drawn, judged, rig_of


@dataclass(frozen=True)
class Weighed:
    """A true damper, and its tests weighed by it."""

    damper: Damper
    campaign: Campaign
    evidence: Evidence

    def misfit_a_residual(self, observation: WeightedRecord) -> float:
        """Compute the mean square residual of a test in units of noise."""
        force = shown_force(observation, self.damper)
        left = observation.residual_and_slopes(force, np.zeros((force.size, 0)))[:, 0]
        return float(left @ left) / left.size


def weighed(case: Case, seed: int) -> Weighed:
    """Weigh the tests of a case by its true damper."""
    levels = case.campaign.values if len(case.dampers) > 1 else (None,)
    true = Damper(
        base=tuple(
            BaseRow(voltage_V=value, T0_N=d.friction, C_Ns_per_m=d.damping, k_N_per_m=d.stiffness)
            for value, d in zip(levels, case.dampers, strict=True)
        )
    )
    recorded = clean(rig_of(case, seed).records)
    cleaned = centred_on(recorded, mid_stroke(p.record.displacement for p in recorded))
    roles = split(cleaned, None, 5.0)
    campaign = Campaign(cleaned, roles, DiagnoseConfig().nuisance, 1, Budget(np.inf))
    return Weighed(true, campaign, evidence_of(campaign, true))


def of_the_study(number: int) -> Weighed:
    """Weigh the tests of a case of `make plain-study`."""
    return weighed(drawn(SEED, 600)[number], SEED)


@pytest.mark.parametrize(
    "number",
    [
        pytest.param(213, id="rigid, sampled at no multiple of the cycle, each test with its gain and offset"),
        pytest.param(443, id="rigid, tests up to a millisecond early or late: five samples"),
        pytest.param(476, id="a spring that forgets in a quarter of a cycle, offsets of a hundredth"),
        pytest.param(334, id="rigid, 59 samples a cycle: splines ring beside the jumps"),
        pytest.param(78, id="rigid, a random test among others"),
        pytest.param(379, id="rigid, a cycle that begins at a reversal"),
    ],
)
def test_the_true_damper_leaves_noise(number: int) -> None:
    """Each case was said to lack something, as its own damper seemed to leave 0.3 to 8 % of peak."""
    found = of_the_study(number)
    assert max(map(found.misfit_a_residual, found.evidence.whole.observations)) < 1.5
    gaps = [np.sqrt(max(check.power, 0.0)) / check.peak for check in found.campaign.checks(found.damper)]
    assert max(gaps) < DiagnoseConfig().visible


@pytest.mark.parametrize(
    ("seed", "number"),
    [
        pytest.param(20261301, 111, id="steps of 24 um hide the corners of a triangle of 4.8 mm"),
        pytest.param(20261301, 271, id="steps of 59 um, a triangle of 38 mm, steps that err alike at two levels"),
        pytest.param(20261301, 456, id="friction alone, steps of 83 um in a triangle of 3.4 mm"),
        pytest.param(20261301, 533, id="steps of 93 um, three levels"),
        pytest.param(20261301, 438, id="40 samples a cycle: what is between them is not known either"),
        pytest.param(SEED, 505, id="39 samples a cycle, steps and noise"),
    ],
)
def test_corners_that_noise_and_steps_hide_leave_no_gap(seed: int, number: int) -> None:
    """The motion rings beside a corner of which the fast harmonics are missing: 10 % of the speed for a few samples.

    They were said to be none, or as large as what noise lets be seen of them, which may be nothing.
    """
    found = weighed(drawn(seed, 600)[number], seed)
    gaps = [np.sqrt(max(check.power, 0.0)) / check.peak for check in found.campaign.checks(found.damper)]
    assert max(gaps) < DiagnoseConfig().visible


def test_true_dampers_from_everywhere_leave_noise() -> None:
    cases = drawn(107, 16)
    worst = []
    for case in cases:
        found = weighed(case, 107)
        worst.append(max(map(found.misfit_a_residual, found.evidence.whole.observations)))
    assert max(worst) < 1.5
    assert np.median(worst) < 1.1


def test_a_late_test_of_a_rigid_damper_is_found_over_the_whole_range() -> None:
    """The search along the slope of a force that jumps ends at the nearest jump, half a millisecond off and more."""
    found = of_the_study(443)
    for observation in found.evidence.whole.observations:
        at = observation.delayed(shown_force(observation, found.damper))
        delays = np.linspace(-1.5e-3, 1.5e-3, 121)
        tried = np.append(delays, observation.likeliest_delay(at))
        left = observation.standardised(np.column_stack([observation.measured - at(d) for d in tried]))
        *others, found_there = np.sum(left**2, axis=0) + (tried / observation.delay_s) ** 2
        assert found_there < min(others) + 0.5


def test_tests_that_the_steps_of_a_channel_misread_alike_know_no_more_than_one() -> None:
    """Three levels in one motion: the same rounded samples three times."""
    case = drawn(SEED, 600)[72]
    alike = clean(rig_of(case, SEED).records)[:3]
    assert [p.read_alike for p in alike] == [3, 3, 3]


def test_a_stiff_spring_that_no_sample_shows_makes_no_gap() -> None:
    """Friction that turns within a sample: the fit tells no spring from another, the flank asks for the rigid one."""
    assert judged(drawn(SEED, 600)[483], SEED).kind == "none"
