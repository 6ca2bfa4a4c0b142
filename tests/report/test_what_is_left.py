"""Pictures of what is left: by frequency, by how it is spread, and each test fitted alone."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from pzd.damper.compose import respond
from pzd.damper.model import BaseRow, Damper
from pzd.damper.motion import Motion
from pzd.record import Array, Record
from pzd.report.plots.left_quantiles import quantiles
from pzd.report.plots.left_spectrum import between_cycles, spectra
from pzd.report.plots.tests_alone import fitted_alone

RATE = 500.0


def sine(force: Array, frequency: float = 1.0, name: str = "sine") -> Record:
    """A record of that force in a sine of 20 mm."""
    time, w = np.arange(force.size) / RATE, 2.0 * np.pi * frequency
    x, v = 0.02 * np.sin(w * time), 0.02 * w * np.cos(w * time)
    return Record(name, None, time, x, v, -(w**2) * x, force, np.zeros(force.size))


def seen(*records: Record, left: Array | None = None) -> Any:
    """A context in which the damper leaves the whole force before diagnose, and `left` of it after."""

    def simulated(record: Record) -> tuple[Array, Array]:
        return np.zeros(record.force.size), record.force - (record.force if left is None else left)

    return SimpleNamespace(sampled=records, records=records, simulated=simulated, level=lambda _: 0.0)


def test_the_bands_hold_the_power_of_what_is_left_where_it_is() -> None:
    """A harmonic of 10 N at 3 Hz has 7.07 N in the band about 3 Hz, and half of it after diagnose."""
    force = 10.0 * np.sin(2.0 * np.pi * 3.0 * np.arange(8000) / RATE)
    middles, before, after, _ = spectra(seen(sine(force), left=0.5 * force), [sine(force)])
    band = int(np.argmax(before))
    assert 2.6 < middles[band] < 3.4
    assert before[band] == pytest.approx(10.0 / np.sqrt(2.0), rel=0.02)
    assert np.sum(before**2) == pytest.approx(50.0, rel=0.01)
    assert after == pytest.approx(0.5 * before)


def test_what_repeats_is_no_noise_and_what_does_not_is_all_noise(rng: np.random.Generator) -> None:
    time = np.arange(8000) / RATE
    repeats = 10.0 * np.sin(2.0 * np.pi * 3.0 * time)
    noise = 4.0 * rng.standard_normal(time.size)
    displacement = 0.02 * np.sin(2.0 * np.pi * time)
    assert np.std(between_cycles(time, displacement, repeats)) < 0.01
    assert np.std(between_cycles(time, displacement, repeats + noise)) == pytest.approx(4.0, rel=0.05)
    assert between_cycles(time, np.cumsum(rng.standard_normal(time.size)), noise) is None


def test_noise_lies_on_the_line_and_rare_large_misses_leave_it(rng: np.random.Generator) -> None:
    noise = rng.standard_normal(20_000)
    normal, found = quantiles(seen(sine(noise)), 0)
    assert np.max(np.abs(found - normal)) < 0.2
    jumps = np.where(rng.random(noise.size) < 0.02, 10.0, 1.0) * noise
    normal, found = quantiles(seen(sine(jumps)), 0)
    assert found[-1] > 1.1 * normal[-1]
    assert found[-10] < 0.8 * normal[-10]


def test_each_test_alone_tells_its_own_friction() -> None:
    """T0 that rises from test to test by a tenth, as an oil that cools or a stand that drifts would show it."""
    records = []
    for number in range(5):
        still = sine(np.zeros(3000), name=f"test {number}")
        row = BaseRow(T0_N=300.0 * 1.1**number, C_Ns_per_m=2700.0, k_N_per_m=2e5)
        records.append(sine(respond(Damper(base=(row,)), Motion.of(still)), name=still.name))
    context = seen(*records)
    context.identified = SimpleNamespace(measures=())
    found = fitted_alone(context)
    assert [test.over["order of the files"] for test in found] == [1.0, 2.0, 3.0, 4.0, 5.0]
    assert [test.row.T0_N for test in found] == pytest.approx(list(300.0 * 1.1 ** np.arange(5)), rel=0.01)
