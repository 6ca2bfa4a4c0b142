"""A measured vibration is rated by the standard, whatever the rate, the offset and the instant at which it begins."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import pzd
from pzd.comfort.conformance import CLAUSES, checks, page
from pzd.comfort.rating import POSITIONS
from pzd.comfort.weighting import WEIGHTINGS, WF, WK, response, weighted, weighted_record

TABLE = Path(__file__).parent / "reference" / "wk_wd_third_octave.csv"


def tone(frequency: float, rate: float, seconds: float, phase: float = 1.0) -> np.ndarray:
    return np.sin(2.0 * np.pi * frequency * np.arange(round(seconds * rate)) / rate + phase)


def test_tones_agree_with_the_analytic_columns_to_a_thousandth() -> None:
    with TABLE.open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert rows
    for row in rows:
        for frequency, of in ((float(row["f_true_Hz_10^(n/10)"]), "true"), (float(row["f_nominal_Hz"]), "nominal")):
            rate, periods = 2000.0, max(round(20.0 * frequency), 8)
            record = tone(frequency, rate, periods / frequency)
            for axis, name in (("z", "Wk"), ("x", "Wd")):
                found = pzd.rate(record + 9.81, rate, axis=axis).a_w * np.sqrt(2.0)
                assert 1000.0 * found == pytest.approx(float(row[f"{name}_x1000_analytic_at_{of}"]), rel=1.5e-3), row


@pytest.mark.parametrize("rate", [50.0, 100.0, 333.0, 1000.0])
@pytest.mark.parametrize("phase", [0.0, 1.0, np.pi / 2.0])
@pytest.mark.parametrize("offset", [0.0, 9.81, -100.0])
def test_neither_an_offset_nor_the_first_instant_counts(rate: float, phase: float, offset: float) -> None:
    expected = abs(response(WK, np.array([1.3]))[0]) / np.sqrt(2.0)
    record = tone(1.3, rate, 10.0, phase)
    assert pzd.rate(record + offset, rate).a_w == pytest.approx(expected, rel=2e-3)
    from_rest = np.sqrt(np.mean(weighted(record + offset, rate) ** 2))
    assert offset == 0.0 or from_rest > 1.02 * expected  # what was seen before: the offset as a step


def test_a_record_from_the_middle_of_a_ride_is_rated_as_it_was_in_the_ride(rng: np.random.Generator) -> None:
    """Noise cannot be foretold: of the whole ride one knows what was before, of the piece one does not."""
    rate = 500.0
    shaken = np.convolve(rng.standard_normal(60000), np.hanning(100) / 50.0, "same")
    piece = slice(20000, 25000)
    true = np.sqrt(np.mean(weighted(shaken, rate)[piece] ** 2))
    assert pzd.rate(shaken[piece] + 9.81, rate).a_w == pytest.approx(true, rel=0.03)


def test_every_weighting_has_its_published_peak_and_corners() -> None:
    """Wf is largest at 0.17 Hz and Wj is flat from 6 to 80 Hz; none passes a constant."""
    frequency = np.logspace(-2.0, 2.5, 2000)
    assert frequency[np.argmax(np.abs(response(WF, frequency)))] == pytest.approx(0.17, rel=0.03)
    flat = np.abs(response(WEIGHTINGS["Wj"], np.linspace(8.0, 40.0, 50)))
    assert np.ptp(flat) < 0.08
    for weighting in WEIGHTINGS.values():
        assert abs(response(weighting, np.array([0.0]))[0]) == 0.0


def test_the_total_value_is_that_of_the_weighted_axes(rng: np.random.Generator) -> None:
    record = rng.standard_normal((4000, 3)) + np.array([0.2, 0.0, 9.8])
    found = pzd.rate(record, 400.0, axis="xyz")
    single = [pzd.rate(record[:, n], 400.0, axis=axis).a_w for n, axis in enumerate("xyz")]
    np.testing.assert_allclose(found.a_w, single, rtol=1e-12)
    assert found.a_v == pytest.approx(np.sqrt(np.sum(np.square(single))))
    assert found.rating.health.a8 == pytest.approx(max(1.4 * single[0], 1.4 * single[1], single[2]))
    assert list(found.to_frame()["weighting"]) == ["Wd", "Wd", "Wk"]


def test_scale_time_and_unit(rng: np.random.Generator) -> None:
    record = rng.standard_normal(5000)
    one, twice = pzd.rate(record, 500.0), pzd.rate(2.0 * record, 500.0)
    for name in ("a_w", "mtvv", "vdv", "msdv"):
        assert getattr(twice, name) == pytest.approx(2.0 * getattr(one, name), rel=1e-9)
    assert twice.crest_factor == pytest.approx(one.crest_factor)
    in_g = pzd.rate(record / 9.80665 + 1.0, 500.0, unit="g")
    assert in_g.a_w == pytest.approx(one.a_w, rel=1e-6)


def test_gravity_in_g_is_told(rng: np.random.Generator) -> None:
    """The mean of a vertical acceleration is 9.81 m/s2, or none; 1 is that of one in g."""
    ride = 0.05 * rng.standard_normal(4000)
    assert "is the unit g?" in repr(pzd.rate(1.0 + ride, 500.0))
    for told in (pzd.rate(1.0 + ride, 500.0, unit="g"), pzd.rate(ride, 500.0), pzd.rate(1.0 + ride, 500.0, axis="x")):
        assert "unit g" not in repr(told)


def test_every_position_has_its_axes_and_rates_them() -> None:
    record = tone(5.0, 500.0, 8.0)
    for position, axes in POSITIONS.items():
        for axis, direction in axes.items():
            found = pzd.rate(record, 500.0, axis=axis, position=position)
            expected = abs(response(direction.weighting, np.array([5.0]))[0]) / np.sqrt(2.0)
            assert found.a_w == pytest.approx(expected, rel=1e-3)
            assert found.a_v == pytest.approx(direction.comfort * found.a_w)


@pytest.mark.parametrize(
    ("change", "error", "words"),
    [
        ({"axis": "w"}, ValueError, "must be one of x, y, z"),
        ({"position": "seet"}, ValueError, "did you mean seat"),
        ({"unit": "mm"}, ValueError, "m/s2, g"),
        ({"rate_Hz": 10.0}, ValueError, "50 samples a second"),
        ({"rate_Hz": "fast"}, TypeError, "must be a number"),
        ({"axis": "xyz"}, ValueError, r"\(n, 3\)"),
        ({"axis": 3}, TypeError, "must be text"),
        ({"acceleration": [1.0]}, ValueError, "2 samples"),
        ({"acceleration": [1.0, np.nan, 2.0]}, ValueError, "index 1"),
        ({"acceleration": ["a", "b"]}, TypeError, "numbers"),
        ({"hours": 0.0}, ValueError, "24 at most"),
    ],
)
def test_a_mistake_is_named(change: dict[str, object], error: type[Exception], words: str) -> None:
    with pytest.raises(error, match=words):
        pzd.rate(**{"acceleration": np.sin(np.arange(1000.0)), "rate_Hz": 100.0, **change})


def test_rest_is_rated_as_nothing() -> None:
    found = pzd.rate(np.full(1000, 9.81), 100.0)
    assert (found.a_w, found.vdv, found.crest_factor) == (0.0, 0.0, 0.0)
    assert found.rating.health.by_directive[0].startswith("below the action value")


def test_a_tone_at_the_end_of_a_long_record_is_no_matter_of_its_start() -> None:
    rate = 200.0
    record = np.concatenate([np.zeros(4000), tone(5.0, rate, 20.0, 0.0)])
    assert np.max(np.abs(weighted_record(record, rate)[:3900])) < 1e-5


# ---------------------------------------------------------------- files


def write(path: Path, **columns: np.ndarray) -> Path:
    names = list(columns)
    rows = zip(*columns.values(), strict=True)
    heads = [name.replace("__", " [").replace("_per_", "/") + ("]" if "__" in name else "") for name in names]
    path.write_text("\n".join([",".join(heads), *(",".join(f"{v:.9g}" for v in row) for row in rows)]) + "\n")
    return path


def test_a_file_is_rated_as_its_arrays(tmp_path: Path, pzd_here: Callable, rng: np.random.Generator) -> None:
    time, record = np.arange(4000) / 400.0, rng.standard_normal((4000, 3))
    file = write(
        tmp_path / "ride.csv",
        time__s=time + 5.0,
        acc_x__g=record[:, 0],
        acc_y__g=record[:, 1],
        acc_z__g=record[:, 2] + 1.0,
    )
    done = pzd_here("rate", file, "--axis", "xyz", "--json")
    assert done.returncode == 0, done.stderr
    found, expected = json.loads(done.stdout), pzd.rate(record, 400.0, axis="xyz", unit="g").as_dict()
    assert found["a_v"] == pytest.approx(expected["a_v"], rel=1e-6)
    assert found["a_w"] == {axis: pytest.approx(value, rel=1e-6) for axis, value in expected["a_w"].items()}
    assert found["columns"] == ["acc_x [g]", "acc_y [g]", "acc_z [g]"]
    assert "vibration total value" in pzd_here("rate", file, "--axis", "xyz").stdout


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"time__s": lambda t: np.where(t > 5.0, t + 3.0, t)}, "the clock leaps by 3"),
        ({"time__s": lambda t: np.where(t > 5.0, t - 1.0, t)}, "time does not increase"),
    ],
)
def test_a_clock_that_leaps_is_refused(change, words: str, tmp_path: Path, pzd_here: Callable) -> None:
    time = np.arange(1000) / 100.0
    file = write(tmp_path / "ride.csv", time__s=change["time__s"](time), a_z__g=np.sin(time))
    done = pzd_here("rate", file)
    assert (done.returncode, words in done.stderr) == (3, True), done.stderr


def test_what_cannot_be_told_is_asked_for_and_doing_it_works(tmp_path: Path, pzd_here: Callable) -> None:
    time = np.arange(1000) / 100.0
    file = write(tmp_path / "ride.csv", time__s=time, left=np.sin(time), right=np.cos(time))
    done = pzd_here("rate", file)
    assert done.returncode == 2
    assert "say --column z=HEADER" in done.stderr
    done = pzd_here("rate", file, "--column", "z=left")
    assert "say --unit m/s2 or --unit g" in done.stderr
    done = pzd_here("rate", file, "--column", "z=left", "--unit", "g", "--json")
    assert json.loads(done.stdout)["a_w"] == pytest.approx(pzd.rate(np.sin(time), 100.0, unit="g").a_w, rel=1e-6)


def test_a_uneven_clock_is_straightened(tmp_path: Path, pzd_here: Callable, rng: np.random.Generator) -> None:
    time = np.arange(4000) / 400.0
    shaken = time + 5e-4 * rng.uniform(-1.0, 1.0, time.size)
    file = write(tmp_path / "ride.csv", time__s=shaken, a_z__m_per_s2=np.sin(2.0 * np.pi * 3.0 * shaken))
    found = json.loads(pzd_here("rate", file, "--json").stdout)
    assert found["a_w"] == pytest.approx(abs(response(WK, np.array([3.0]))[0]) / np.sqrt(2.0), rel=2e-3)


# ---------------------------------------------------------------- conformance


@pytest.mark.ci
def test_every_clause_keeps_within_a_fiftieth_of_its_tolerance() -> None:
    assert max(check.share for check in checks()) < 0.02
    assert {check.what.split()[0] for check in checks()} >= {*WEIGHTINGS, "MTVV", "VDV", "MSDV", "a_v"}
    assert len(CLAUSES) == len({clause.__name__ for clause in CLAUSES})


@pytest.mark.ci
def test_the_page_is_what_the_command_prints(root: Path) -> None:
    written = (root / "docs" / "conformance.md").read_text(encoding="utf-8").splitlines()
    assert written == page(), "pzd rate --conformance > docs/conformance.md"
