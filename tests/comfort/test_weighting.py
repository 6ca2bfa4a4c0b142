"""The weighting is that of the standard, and no artefact of sampling, padding or starting."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

from pzd.comfort.weighting import WK, Weighting, response, weighted

WD = Weighting("Wd", 0.4, 100.0, 2.0, 2.0, 0.63, None)
TABLE = Path(__file__).parent / "reference" / "wk_wd_third_octave.csv"
MISPRINT_HZ = 10.0


def printed() -> list[dict[str, float]]:
    with TABLE.open(encoding="utf-8") as file:
        return [{name: float(cell) for name, cell in row.items()} for row in csv.DictReader(file)]


def factors(weighting: Weighting, column: str) -> np.ndarray:
    return 1000.0 * np.abs(response(weighting, np.array([row[column] for row in printed()])))


def test_wk_of_1997_is_the_formula_at_nominal_centres() -> None:
    table = np.array([row["Wk_x1000_ISO2631-1_1997_Table3"] for row in printed()])
    assert np.abs(factors(WK, "f_nominal_Hz") / table - 1.0).max() < 0.00285


def test_wk_of_2017_is_the_formula_at_true_centres() -> None:
    table = np.array([row["Wk_x1000_ISO8041-1_2017_AnnexB"] for row in printed()])
    assert np.abs(factors(WK, "f_true_Hz_10^(n/10)") / table - 1.0).max() < 0.000345


def test_the_response_without_the_upward_step_is_wd() -> None:
    rows = printed()
    table = np.array([row["Wd_x1000_ISO2631-1_1997_Table3"] for row in rows])
    kept = np.array([row["f_nominal_Hz"] != MISPRINT_HZ for row in rows])
    assert np.abs(factors(WD, "f_nominal_Hz") / table - 1.0)[kept].max() < 0.0062


@pytest.mark.parametrize("weighting", [WK, WD], ids=["Wk", "Wd"])
def test_the_response_is_the_analytic_one_from_half_a_hertz_to_80(weighting: Weighting) -> None:
    rows = [row for row in printed() if 0.49 < row["f_true_Hz_10^(n/10)"] < 81.0]
    name = "Wk" if weighting is WK else "Wd"
    table = np.array([row[f"{name}_x1000_analytic_at_true"] for row in rows])
    found = 1000.0 * np.abs(response(weighting, np.array([row["f_true_Hz_10^(n/10)"] for row in rows])))
    assert len(rows) == 23
    assert np.abs(found / table - 1.0).max() < 1e-4


@pytest.mark.parametrize("weighting", [WK, WD], ids=["Wk", "Wd"])
@pytest.mark.parametrize("rate", [200.0, 250.0, 1000.0, 4000.0])
def test_a_sine_at_every_true_centre_is_weighted_to_a_thousandth_at_any_rate(weighting: Weighting, rate: float) -> None:
    """Over whole periods of a settled sine, by its projection on sine and cosine."""
    name = "Wk" if weighting is WK else "Wd"
    for row in printed():
        frequency = row["f_true_Hz_10^(n/10)"]
        if not 0.49 < frequency < 81.0:
            continue
        time = np.arange(round(40.0 * rate)) / rate
        settled = slice(round(12.0 * rate), round(32.0 * rate))
        found = weighted(np.sin(2.0 * np.pi * frequency * time), rate, weighting)[settled]
        shape = np.stack([f(2.0 * np.pi * frequency * time[settled]) for f in (np.sin, np.cos)], axis=1)
        size = np.linalg.norm(np.linalg.lstsq(shape, found, rcond=None)[0])
        assert 1000.0 * size == pytest.approx(row[f"{name}_x1000_analytic_at_true"], rel=1e-3)


@pytest.mark.parametrize(("frequency", "factor"), [(2.25, 0.5740), (4.5, 1.0143)])
def test_wk_at_the_papers_frequencies(frequency: float, factor: float) -> None:
    assert abs(response(WK, np.array([frequency]))[0]) == pytest.approx(factor, abs=5e-5)


@pytest.mark.parametrize("rate", [200.0, 500.0, 1000.0])
@pytest.mark.parametrize("frequency", [0.5, 2.25, 4.5, 20.0, 63.0, 80.0])
def test_a_settled_sine_is_multiplied_by_the_response(rate: float, frequency: float) -> None:
    time = np.arange(round(24.0 * rate)) / rate
    settled = weighted(np.sin(2.0 * np.pi * frequency * time), rate)[round(8.0 * rate) :]
    expected = abs(response(WK, np.array([frequency]))[0]) / np.sqrt(2.0)
    assert np.sqrt(np.mean(settled**2)) == pytest.approx(expected, rel=2e-3)


def test_the_weighting_has_settled_after_four_seconds() -> None:
    rate = 500.0
    for phase in np.linspace(0.0, np.pi, 5):
        time = np.arange(round(20.0 * rate)) / rate
        settled = weighted(np.cos(2.0 * np.pi * 2.25 * time + phase), rate)[round(4.0 * rate) :]
        assert np.sqrt(2.0 * np.mean(settled**2)) == pytest.approx(0.5740, rel=3e-4)


def test_the_end_of_a_ride_does_not_wrap_round_to_its_start() -> None:
    rate = 500.0
    ride = np.zeros(5000)
    ride[-50:] = 10.0
    assert np.abs(weighted(ride, rate)[:4000]).max() < 2e-4 * 10.0


def test_a_constant_gravity_decays_in_the_weighted_history() -> None:
    rate = 500.0
    assert np.abs(weighted(np.full(10000, 9.81), rate)[round(8.0 * rate) :]).max() < 1e-5


def test_weighting_is_linear_and_shifts_with_time(rng: np.random.Generator) -> None:
    ride = np.concatenate([np.zeros(500), rng.normal(size=2500)])
    later = np.concatenate([np.zeros(250), ride])[: ride.size]
    once, moved = weighted(ride, 500.0), weighted(later, 500.0)
    assert np.abs(moved[1000:] - once[750:-250]).max() < 1e-2 * np.abs(once).max()
    assert np.allclose(weighted(3.0 * ride, 500.0), 3.0 * once)
