"""An effect whose parameters differ by voltage has to mean something between the voltages, too."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest
from campaign import damper_of, sines
from test_kept_back import campaign_of

from pzd.damper.model import Damper
from pzd.diagnosis.adoption import interpolation_check
from pzd.diagnosis.cross_validation import CrossValidation, cross_validation_of

THREE = (0.0, 50.0, 150.0)
TESTS = ((0.5, 0.02), (2.0, 0.03))
Values = Mapping[str, tuple[float, ...]]


def with_values(effect: str, values: Values) -> Damper:
    return damper_of(THREE).with_effect(effect, {**values, "at_voltage_V": THREE})


@pytest.fixture
def validation(rng: np.random.Generator) -> CrossValidation:
    damper = damper_of(THREE)
    return cross_validation_of(campaign_of(sines(damper, rng, THREE, tests=TESTS, cycles=3)), damper, 0.0025)


@pytest.mark.parametrize(
    ("effect", "values"),
    [
        ("rounded_yield", {"w_s": (0.004, 0.012, 0.03)}),
        ("second_branch", {"T0_2": (100.0, 200.0, 400.0), "k_2": (3e4, 5e4, 8e4)}),
        ("bouc_wen", {"F_h": (70.0, 140.0, 210.0), "x_h": (2e-3, 2e-3, 3e-3), "sigma": (1.0, 1.0, 2.0)}),
    ],
)
def test_parameters_that_go_steadily_with_the_voltage_lie_between(
    effect: str, values: Values, validation: CrossValidation
) -> None:
    assert interpolation_check(damper_of(THREE), validation)
    assert interpolation_check(with_values(effect, values), validation)


def test_pairs_of_values_that_only_go_together_do_not(validation: CrossValidation) -> None:
    """A large force over a large length and a small one over a small length, but never a large one over a small one."""
    pairs = {"F_h": (2000.0, 1.0, 2000.0), "x_h": (0.2, 1e-6, 0.2), "sigma": (1.0, 1.0, 1.0)}
    assert not interpolation_check(with_values("bouc_wen", pairs), validation)


def test_the_unit_of_the_control_signal_makes_no_difference(rng: np.random.Generator) -> None:
    """In millivolts the same damper is judged the same."""
    volts = with_values("bouc_wen", {"F_h": (900.0, 1.0, 1.0), "x_h": (0.2, 1e-6, 1e-6), "sigma": (1.0, 1.0, 1.0)})
    for scale in (1.0, 1e-3, 1e3):
        base = [row.model_copy(update={"voltage_V": scale * (row.voltage_V or 0.0)}) for row in volts.base]
        values = {**volts.effects["bouc_wen"], "at_voltage_V": tuple(scale * v for v in THREE)}
        damper = Damper(base=tuple(base)).with_effect("bouc_wen", values)
        records = sines(Damper(base=tuple(base)), rng, [scale * v for v in THREE], tests=TESTS, cycles=3)
        assert not interpolation_check(
            damper, cross_validation_of(campaign_of(records), Damper(base=tuple(base)), 0.0025)
        )
