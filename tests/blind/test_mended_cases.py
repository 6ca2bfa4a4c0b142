"""Cases of blind-motions.yaml on which the diagnosis failed, each by a fault that other tests may meet as well."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from pzd.artefacts import Diagnosis
from pzd.blind.benchmark import Methods, diagnose_case
from pzd.blind.case import Places
from pzd.blind.hide import BenchmarkSetup, hide
from pzd.blind.plan import plan
from pzd.config import RunConfig, load
from pzd.quantities import Control
from pzd.schema.validate import read_json

CONFIG = Path(__file__).resolve().parents[2] / "configs" / "blind-motions.yaml"
FIRST_SCORED = 20261200
"""Seeds of scored runs begin here; these two were begun and given up, and are in the ledger."""
CASES = {
    "two tests of one voltage, 0.2 degC apart, were two conditions": (9, "00019", {"lash"}),
    "the voltage steps past a tested one within a sample": (20261205, "00176", set()),
    "a friction jumps at more than forty samples of a test": (
        20261205,
        "00088",
        {"piezo_hysteresis", "stribeck_friction"},
    ),
    "a hysteresis is as wide as the noise of the voltage": (20261216, "00036", {"lash"}),
    "what is left without the effect is slow, and bends the rest": (20261216, "00013", {"lash"}),
}


@pytest.mark.ci
@pytest.mark.parametrize("fault", CASES)
def test_what_is_hidden_is_named_and_nothing_else(
    fault: str, setup_of: Callable[[RunConfig], BenchmarkSetup], tmp_path: Path
) -> None:
    seed, case, hidden = CASES[fault]
    tuning = "true" if seed < FIRST_SCORED else "false"
    config = load(CONFIG, [f"blind.seed={seed}", f"blind.tuning={tuning}"])
    setup, places = setup_of(config), Places(tmp_path)
    (planned,) = (each for each in plan(setup.blind) if each.id == case)
    hide(setup, planned, places)
    diagnose_case(
        Methods(config.identify, config.diagnose, config.rig.limits, setup.control, config.seed), places.case(case)
    )
    found = read_json(places.case(case) / "diagnosis.json", Diagnosis, Control())
    assert (found.verdict, set(found.effects)) == ("named" if hidden else "none", hidden)
