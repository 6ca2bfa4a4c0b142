"""Clocks: stamps of few digits, and those that contradict the config, count samples, jump or exchange day and month."""

from __future__ import annotations

import re
import tracemalloc
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from written_files import CANONICAL, FORCE, TIME, X, lines, refused, run, write, wrong

from pzd.damper.element import element_force
from pzd.record import Array
from pzd.rig.files.guess import guessed

AMPLITUDE, FREQUENCY = 0.02, 1.0


def recorded(time: Array, stamps: Array) -> list[str]:
    """The lines of a file: a sine as it was at some moments [s], beside what the clock says of them."""
    x = AMPLITUDE * np.sin(2.0 * np.pi * FREQUENCY * time)
    force = element_force(x, float(np.median(np.diff(time))), 300.0, 2700.0, 2e5)
    return lines({"time_s": stamps, "displacement_m": x, "force_N": force, "voltage_V": np.full(time.size, 100.0)})


@pytest.mark.parametrize("rate", [512.0, 300.0, 700.0])
@pytest.mark.parametrize("down", [np.round, np.floor], ids=["rounded", "cut off"])
def test_a_speed_derived_over_rounded_stamps_is_that_of_the_clock_behind_them(
    tmp_path: Path, rate: float, down: np.ufunc
) -> None:
    """Left as they are, stamps of 1 ms scatter the speed of a 512 Hz record by 2 % and more."""
    time = np.arange(4000) / rate
    write(tmp_path / "a.csv", recorded(time, down(time * 1e3) / 1e3))
    rig = run(tmp_path)
    (record,) = rig.records
    inside = slice(100, -100)
    about = record.time - record.time[0]
    assert np.max(np.abs(about - time)) < 1e-4
    speed = 2.0 * np.pi * FREQUENCY * AMPLITUDE
    exact = speed * np.cos(2.0 * np.pi * FREQUENCY * time)
    assert np.max(np.abs(record.velocity - exact)[inside]) < 1e-3 * speed
    (said,) = [row for row in rig.ingested if row.step == "clock"]
    assert said.was == "stamps rounded to 0.001 s"
    assert said.became.startswith(f"a regular clock of {rate:.4g}")


@pytest.mark.parametrize("clock", ["even", "wavers", "gap", "two rates"])
def test_a_clock_that_is_not_rounded_is_left_as_it_is(tmp_path: Path, clock: str, rng: np.random.Generator) -> None:
    time = np.arange(2000) / 500.0
    if clock == "wavers":
        time = time + 2e-4 * rng.uniform(-1.0, 1.0, time.size)
    elif clock == "gap":
        time[1000:] += 0.002
    elif clock == "two rates":
        time[1000:] = time[1000] + np.arange(1000) / 400.0
    write(tmp_path / "a.csv", recorded(time, time))
    rig = run(tmp_path)
    np.testing.assert_allclose(rig.records[0].time, time, atol=1e-8)
    assert not [row for row in rig.ingested if row.step == "clock"]


# ---------------------------------------------------------------- clocks that contradict the config or count samples

WITHOUT_TIME = {"displacement_m": X, "force_N": FORCE}


@pytest.mark.parametrize(("header", "scale"), [("time_s", 1.0), ("t", 1e3), ("Time [ms]", 1e3), ("Zeit [s]", 1.0)])
def test_a_rate_beside_a_column_of_time_is_refused_where_they_differ(tmp_path: Path, header: str, scale: float) -> None:
    """Counted at 1250 Hz, a record of 500 Hz is 2.5 times as quick, and C 0.4 of what it is."""
    write(tmp_path / "a.csv", lines({header: TIME * scale, **WITHOUT_TIME}))
    (said,) = wrong(tmp_path, {"path": "a.csv", "rate_Hz": 1250.0})
    assert "rig.files.0.rate_Hz: column" in said
    assert "(got 1250)" in said
    # Each of the two remedies is accepted.
    entry: dict[str, Any] = {"path": "a.csv"} | ({} if header == "time_s" else {"columns": {"time": header}})
    if header == "t":
        entry["units"] = {"time": "ms"}
    assert run(tmp_path, entry).records[0].rate == pytest.approx(500.0)
    (counted,) = run(tmp_path, {"path": "a.csv", "rate_Hz": 1250.0, "columns": {"time": ""}}).entries
    assert counted.rate_Hz == pytest.approx(1250.0)
    assert "clock" in [finding.check for finding in counted.findings]


@pytest.mark.parametrize("column", ["agrees", "rounded", "counts", "dates"])
def test_a_rate_beside_a_column_that_does_not_contradict_it_stands(tmp_path: Path, column: str) -> None:
    stamps: dict[str, Any] = {
        "agrees": TIME,
        "rounded": np.round(TIME, 2),
        "counts": np.arange(TIME.size),
        "dates": [f"25.03.2024 10:00:{t:06.3f}" for t in TIME],
    }
    write(tmp_path / "a.csv", lines({"Time [s]": stamps[column], **WITHOUT_TIME}))
    (entry,) = run(tmp_path, {"path": "a.csv", "rate_Hz": 500.0}).entries
    assert entry.findings == ()


def test_numbers_of_samples_are_no_seconds(tmp_path: Path) -> None:
    """Read as seconds, samples at 500 Hz make C 500 times as large."""
    samples = np.arange(TIME.size)
    write(tmp_path / "a.csv", lines({"Sample": samples, **WITHOUT_TIME}))
    declared = {"path": "a.csv", "columns": {"time": "Sample"}, "units": {"time": "s"}}
    (said,) = refused(tmp_path, declared)
    assert "a.csv:2: time: column 'Sample' counts samples, no seconds; say rate_Hz: N" in said
    assert run(tmp_path, {"path": "a.csv", "rate_Hz": 500.0}).entries[0].rate_Hz == pytest.approx(500.0)
    write(tmp_path / "a.csv", lines({"time_s": samples, **WITHOUT_TIME}))
    (said,) = refused(tmp_path)
    assert "a.csv:2: the clock counts whole seconds, one a row" in said
    for remedy, rate in (
        ({"rate_Hz": 500.0}, 500.0),
        ({"units": {"time": "ms"}}, 1e3),
        ({"units": {"time": "s"}}, 1.0),
    ):
        (entry,) = run(tmp_path, {"path": "a.csv", **remedy}).entries
        assert entry.rate_Hz == pytest.approx(rate)
        assert ("clock" in [finding.check for finding in entry.findings]) == (rate == 1.0)


def test_a_jump_of_a_day_is_refused_at_once_and_read_where_it_is_cut(tmp_path: Path) -> None:
    time = np.where(TIME < 0.5, TIME, TIME + 86400.0)
    write(tmp_path / "a.csv", lines({"time_s": [f"{t:.3f}" for t in time], **WITHOUT_TIME}))
    tracemalloc.start()
    (said,) = refused(tmp_path)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 50e6  # B; the day on the grid of the samples took 8 GB
    assert "a.csv:252: the clock jumps by 86400 s here, in a record of 0.996 s beside" in said
    (gap,) = re.findall(r"split: \{gap_s: ([0-9.]+)\}", said)
    assert len(run(tmp_path, {"path": "a.csv", "split": {"gap_s": float(gap)}}).records) == 2


def test_dates_whose_day_comes_first_are_refused_over_midnight_with_the_format_that_reads_them(tmp_path: Path) -> None:
    start = datetime(2024, 2, 1, 23, 59, 59, 500000)  # noqa: DTZ001  # a logger knows no zone
    stamps = [(start + timedelta(seconds=t)).strftime("%d/%m/%Y %H:%M:%S.%f") for t in TIME.tolist()]
    write(tmp_path / "a.csv", lines({"when": stamps, **WITHOUT_TIME}))
    entry = {"path": "a.csv", "columns": {"time": "when"}, "units": {"time": "%m/%d/%Y %H:%M:%S.%f"}}
    (said,) = refused(tmp_path, entry)
    assert "a.csv:252: the clock jumps by 2.592e+06 s here" in said
    (form,) = re.findall(r'say units: \{time: "(.*)"\}', said)
    (record,) = run(tmp_path, entry | {"units": {"time": form}}).records
    assert record.time - record.time[0] == pytest.approx(TIME, abs=1e-6)


def test_a_pause_within_a_record_is_a_finding_still(tmp_path: Path) -> None:
    time = np.where(TIME < 0.5, TIME, TIME + 0.4)
    write(tmp_path / "a.csv", lines({"time_s": time, **WITHOUT_TIME}))
    assert "dropped samples" in [finding.check for finding in run(tmp_path).entries[0].findings]


def test_another_rate_without_a_pause_is_cut_in_the_file(tmp_path: Path) -> None:
    time = np.concatenate((TIME, TIME[-1] + np.arange(1, 501) * 1e-2))
    x = 0.01 * np.sin(2.0 * np.pi * 5.0 * time)
    rows = lines({"time_s": time, "displacement_m": x, "force_N": 900.0 * np.gradient(x, time)})
    write(tmp_path / "a.csv", rows)
    (said,) = refused(tmp_path)
    assert said.endswith(
        "a.csv:502: the clock goes on at 100 Hz here, at 500 Hz before; a record has one rate: write "
        "the rows from here on into a file of their own"
    )
    write(tmp_path / "a.csv", rows[:501])
    write(tmp_path / "b.csv", [rows[0], *rows[501:]])
    assert [round(record.rate) for record in run(tmp_path).records] == [500, 100]


def test_a_counted_clock_is_asked_about_no_milliseconds(tmp_path: Path) -> None:
    """The advice of once, units: {time: ms}, was refused in its turn: said twice, under rate_Hz and units."""
    write(tmp_path / "a.csv", lines(WITHOUT_TIME))
    assert run(tmp_path, {"path": "a.csv", "rate_Hz": 0.5}).entries[0].rate_Hz == pytest.approx(0.5)


def test_a_clock_of_too_few_digits_is_counted_as_the_refusal_says(tmp_path: Path) -> None:
    later = 10.0 + np.arange(TIME.size) / 3000.0
    write(tmp_path / "a.csv", lines({"time_s": [f"{t:.5g}" for t in later], **WITHOUT_TIME}))
    (said,) = refused(tmp_path)
    (rate,) = re.findall(r"say rate_Hz: ([0-9.]+) or", said)
    for columns in ({}, {"columns": {"time": ""}}):
        (entry,) = run(tmp_path, {"path": "a.csv", "rate_Hz": float(rate), **columns}).entries
        assert entry.rate_Hz == pytest.approx(3000.0, rel=5e-3)


def test_a_clock_that_begins_again_is_another_test_and_the_column_that_numbers_them_cuts_it(tmp_path: Path) -> None:
    numbers = np.repeat([1.0, 2.0], TIME.size)
    columns = {"Test No": numbers} | {name: np.tile(values, 2) for name, values in CANONICAL.items()}
    write(tmp_path / "a.csv", lines(columns))
    (said,) = refused(tmp_path)
    assert "another test begins there; say split: {column: Test No} or write each into a file of its own" in said
    assert len(run(tmp_path, {"path": "*.csv", "split": {"column": "Test No"}}).records) == 2
    assert any(line.startswith("      split: {column: Test No}") for line in guessed([tmp_path / "a.csv"]))


def test_without_a_column_that_numbers_the_tests_a_clock_that_goes_back_cuts_the_file(tmp_path: Path) -> None:
    write(tmp_path / "a.csv", lines({name: np.tile(values, 3) for name, values in CANONICAL.items()}))
    (said,) = refused(tmp_path)
    (gap,) = re.findall(r"say split: \{gap_s: ([0-9.]+)\} which cuts where the clock goes back as well, or", said)
    assert len(run(tmp_path, {"path": "*.csv", "split": {"gap_s": float(gap)}}).records) == 3


def test_a_column_that_tells_some_of_the_tests_apart_cuts_no_file(tmp_path: Path) -> None:
    """Cut at its labels the clock begins again in each part, and cut at the clock two dampers would be one."""
    corner = [label for label in ("LF", "LR") for _ in range(2 * TIME.size)]
    write(tmp_path / "a.csv", lines({"Corner": corner, **{k: np.tile(v, 4) for k, v in CANONICAL.items()}}))
    (said,) = refused(tmp_path)
    assert "column 'Corner' tells only some of them apart: write each into a file of its own" in said
    for split in ({"column": "Corner"}, {"event": "Corner", "begins": "LR"}):
        said = refused(tmp_path, {"path": "a.csv", "split": split})[0]
        assert said.endswith("another test begins there: write each into a file of its own")


def test_tests_of_other_lengths_in_one_file_are_told_as_such(tmp_path: Path) -> None:
    half = TIME.size // 2
    rows = np.concatenate([np.arange(TIME.size), np.arange(half), np.arange(half)])
    numbers = np.repeat([1.0, 2.0, 3.0], [TIME.size, half, half])
    columns = {"test": numbers} | {name: np.asarray(values)[rows] for name, values in CANONICAL.items()}
    write(tmp_path / "a.csv", lines(columns))
    (said,) = refused(tmp_path)
    assert "another test begins there; say split: {column: test}" in said
    assert len(run(tmp_path, {"path": "*.csv", "split": {"column": "test"}}).records) == 3


@pytest.mark.parametrize("bits", [8, 16])
def test_a_counter_of_so_many_bits_begins_again_and_is_no_other_test(bits: int, tmp_path: Path) -> None:
    """Of a time in milliseconds, as a microcontroller counts it, that has begun before the record."""
    wrapped = (2**bits - 100 + 2 * np.arange(TIME.size)) % 2**bits
    write(tmp_path / "a.csv", lines({"time_ms": wrapped.astype(float), **WITHOUT_TIME}))
    spec = {"path": "a.csv", "columns": {"time": "time_ms"}, "units": {"time": "ms"}}
    (said,) = refused(tmp_path, spec)
    assert f"the clock begins again after {2**bits} ticks, a counter of so many bits; say rate_Hz: 500 and" in said
    for columns in ({}, {"columns": {"time": ""}}):
        (entry,) = run(tmp_path, {"path": "a.csv", "rate_Hz": 500, **columns}).entries
        assert entry.rate_Hz == pytest.approx(500.0)


def test_rows_that_repeat_a_time_or_run_backwards_are_told_as_such_and_what_is_advised_is_accepted(
    tmp_path: Path,
) -> None:
    text = lines(CANONICAL)
    write(tmp_path / "a.csv", [*text[:3], text[2], text[2], *text[3:]])
    (said,) = refused(tmp_path)
    assert said.endswith("; take the rows that repeat a time out")
    write(tmp_path / "a.csv", [text[0], *text[:0:-1]])
    (said,) = refused(tmp_path)
    assert said.endswith("; the rows run backwards: turn them round")
    write(tmp_path / "a.csv", text)
    assert len(run(tmp_path).records) == 1


def test_a_row_without_a_value_is_not_to_be_taken_out_where_no_column_holds_the_time(tmp_path: Path) -> None:
    """It would shift all rows behind it by a sample, without a word."""
    text = lines(WITHOUT_TIME)
    text[7] = text[7].rpartition(",")[0] + ","
    write(tmp_path / "a.csv", text)
    (said,) = refused(tmp_path, {"path": "a.csv", "rate_Hz": 500, "columns": {"time": ""}})
    assert "empty cell; write the mean of its neighbours there: no column holds the time" in said
