"""The friction of a seal beside T0: it turns round with the rod, and takes no name from what is missing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from synthetic import TWO, all_but, damper_of, diagnosed, sines

from pzd.artefacts import Diagnosed
from pzd.diagnosis import thresholds
from pzd.record import Record

TESTS = ((0.5, 0.01), (0.5, 0.03), (2.0, 0.01), (2.0, 0.02), (3.0, 0.015))
LOOKED_FOR = ("asymmetry", "rounded_yield", "preload_offset", "lash", "stribeck_friction", "sensor_delay")


def rubbed(records: tuple[Record, ...], friction: float, speed: float = 5e-4) -> tuple[Record, ...]:
    """The same tests with the friction of a seal on the rod [N], which has turned at so many m/s."""
    return tuple(replace(r, force=r.force + friction * np.tanh(r.velocity / speed)) for r in records)


def records_of(rng: np.random.Generator, friction: float, **effects: dict[str, float]) -> tuple[Record, ...]:
    records = sines(damper_of(TWO, **effects), rng, TWO, tests=TESTS, noise=0.003, colour=0.5)
    return rubbed(records, friction)


def told(records: tuple[Record, ...]) -> Diagnosed:
    return diagnosed(records, forbid=all_but(*LOOKED_FOR))


@pytest.mark.ci
def test_an_asymmetry_is_found_beside_the_friction_of_a_seal(rng: np.random.Generator) -> None:
    """That friction is no other effect but one on the rod, with which it is `ambiguous` where noise hides its turn."""
    for friction, draw in zip((15.0, 30.0), rng.spawn(2), strict=True):
        found = told(records_of(draw, friction, asymmetry={"alpha": 0.15}))
        diagnosis = found.diagnosis
        assert diagnosis.verdict in ("named", "ambiguous"), diagnosis.reason
        assert {*diagnosis.effects} - {"stribeck_friction"} == {"asymmetry"}
        assert diagnosis.parameters["asymmetry"]["alpha"].value == pytest.approx(0.15, rel=0.03)


@pytest.mark.ci
def test_beside_a_seal_the_simple_model_misses_what_it_misses_without(
    rng: np.random.Generator, monkeypatch: pytest.MonkeyPatch
) -> None:
    friction = 30.0
    drawn = (records_of(draw, friction, asymmetry={"alpha": 0.15}) for draw in rng.spawn(4))
    judged = ((records, told(records)) for records in drawn)
    records, found = next((r, f) for r, f in judged if "seal" in f.damper.effects)  # noise hides it in some
    assert (found.diagnosis.verdict, found.diagnosis.effects) == ("named", ("asymmetry",)), found.diagnosis.reason
    assert found.damper.effects["seal"]["F_s"] == pytest.approx(friction, rel=0.25)
    assert "beside the friction of a seal" in found.diagnosis.reason
    monkeypatch.setattr(thresholds, "SEAL_LEAVES", 0.0)
    without = told(records).diagnosis
    assert without.verdict == "unexplained"
    assert found.diagnosis.gap is not None
    assert without.gap is not None
    assert found.diagnosis.gap.before == without.gap.before
    assert found.diagnosis.gap.after < without.gap.after


def test_where_no_seal_rubs_none_is_there(rng: np.random.Generator) -> None:
    found = told(records_of(rng, 0.0, asymmetry={"alpha": 0.15}))
    assert (found.diagnosis.verdict, found.diagnosis.effects) == ("named", ("asymmetry",)), found.diagnosis.reason
    assert "seal" not in found.damper.effects
