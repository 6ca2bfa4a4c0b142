"""Offset, gain and delay of a test may only take away from a residual; the delay shows at jumps as well."""

from __future__ import annotations

import numpy as np
import pytest

from pzd.record import Array
from pzd.signals.jumps import jumps
from pzd.signals.nuisance import NuisanceConfig, likely_delay, nuisance_forces


def forces(kind: str) -> tuple[Array, Array]:
    """Predicted force, and a residual beyond the priors: where force and offset look alike, bounds bend an estimate."""
    t = np.linspace(0.0, 4.0 * np.pi, 400)
    predicted = {
        "nearly constant": 1000.0 + 10.0 * np.sin(t),
        "flanks": 500.0 * np.tanh(40.0 * np.sin(t)),
        "sine": 800.0 * np.sin(t),
    }[kind]
    return predicted, {
        "nearly constant": 300.0 * np.sin(t) - 20.0,
        "flanks": 400.0 * np.cos(t) * np.exp(-((np.sin(t) / 0.05) ** 2)) + 60.0,
        "sine": 600.0 * np.cos(t) + 90.0,
    }[kind]


@pytest.mark.parametrize("kind", ["nearly constant", "flanks", "sine"])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_what_a_test_explains_never_makes_the_residual_larger(kind: str, sign: float, rng: np.random.Generator) -> None:
    predicted, residual = forces(kind)
    calm = rng.random(predicted.size) < 0.9
    whole = np.ones(predicted.size, dtype=np.bool_)
    nothing = np.zeros((predicted.size, 0))
    for config in (NuisanceConfig(), NuisanceConfig(offset=0.2, delay_s=0.05, gain=0.001)):
        parts = nuisance_forces(sign * residual, predicted, 100.0, 1.0, config, nothing, calm, whole)
        left = sign * residual - sum(parts)
        assert left[calm] @ left[calm] <= (residual[calm] @ residual[calm]) * (1.0 + 1e-12)


@pytest.mark.parametrize("delay", [-1.2e-3, -4e-4, 0.0, 4e-4, 1.2e-3])
def test_dry_friction_shows_a_delay_at_its_jumps_alone(delay: float, rng: np.random.Generator) -> None:
    """A force of 300 N either way at 5 kHz, up to six samples late or early: everywhere else it is as it was."""
    time = np.arange(5000) / 5000.0
    signal = 2.0 * np.pi * 9.7 * time + 0.4

    def late(by: float) -> Array:
        return 300.0 * np.sign(np.sin(signal - 2.0 * np.pi * 9.7 * by))

    measured = late(delay) + 0.3 * rng.standard_normal(time.size)
    beside = np.convolve(jumps(measured) > 0.0, np.ones(13), "same") > 0.5  # as the average of cycles marks them
    found = likely_delay(measured, late, 0.09, NuisanceConfig(), ~beside)
    assert found == pytest.approx(delay, abs=0.2e-3)
