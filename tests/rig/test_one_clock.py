"""Channels of several clocks in one file: brought to one, with the delays told and nothing invented."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from written_files import refused, run

from pzd.cli.app import status
from pzd.record import Array
from pzd.rig.files.guess import guessed
from pzd.rig.files.one_clock import _follows, resampled

STROKE, FREQUENCY, FRICTION, DAMPING = 0.02, 1.5, 150.0, 900.0


def motion(time: Array) -> tuple[Array, Array]:
    angle = 2.0 * np.pi * FREQUENCY * time
    return STROKE * np.sin(angle), STROKE * 2.0 * np.pi * FREQUENCY * np.cos(angle)


def force_at(time: Array, friction: float | Array = FRICTION) -> Array:
    return friction * np.sign(motion(time)[1]) + DAMPING * motion(time)[1]


def damping_of(record: Any) -> tuple[float, float]:
    """Friction and damping by least squares where the sign of the speed is clear."""
    v = (
        motion(record.time)[1]
        if np.allclose(motion(record.time)[0], record.displacement, atol=1e-6)
        else record.velocity
    )
    clear = np.abs(v) > 0.1 * np.abs(v).max()
    design = np.stack([np.sign(v), v], axis=1)[clear]
    friction, damping = np.linalg.lstsq(design, record.force[clear], rcond=None)[0]
    return float(friction), float(damping)


def tdms(path: Path, groups: dict[str, dict[str, tuple[Array, dict[str, Any]]]]) -> None:
    from nptdms import ChannelObject, TdmsWriter

    with TdmsWriter(path) as writer:
        for group, channels in groups.items():
            writer.write_segment([ChannelObject(group, head, *both) for head, both in channels.items()])


def waveform(rate: float, begins: float = 0.0, offset: float = 0.0, unit: str = "") -> dict[str, Any]:
    start = np.datetime64("2024-03-05T10:11:12.5", "us") + np.timedelta64(round(begins * 1e6), "us")
    return {"wf_start_time": start, "wf_start_offset": offset, "wf_increment": 1.0 / rate, "unit_string": unit}


NAMED = {"columns": {"time": "time", "displacement": "Stroke", "force": "Load"}}


def two_clocks(
    path: Path, rates: tuple[float, float], begins: float, offset: float = 0.0, seconds: float = 4.0
) -> None:
    own = [np.arange(round(seconds * rate)) / rate for rate in rates]
    late = own[1] + begins + offset
    tdms(
        path,
        {
            "Rig": {
                "Stroke": (1e3 * motion(own[0])[0], waveform(rates[0], unit="mm")),
                "Load": (force_at(late), waveform(rates[1], begins, offset, "N")),
            }
        },
    )


@pytest.mark.parametrize("rates", [(500.0, 1000.0), (1000.0, 500.0), (2048.0, 600.0), (500.0, 500.0)])
@pytest.mark.parametrize(("begins", "offset"), [(0.137, 0.0), (0.0, 0.137), (-0.2, 0.0)])
def test_waveforms_that_begin_apart_are_one_test(
    tmp_path: Path, rates: tuple[float, float], begins: float, offset: float
) -> None:
    # Read as they stand the damping would be -290 for 900: the force is a fifth of a cycle late.
    two_clocks(tmp_path / "a.tdms", rates, begins, offset)
    rig = run(tmp_path, {"path": "a.tdms"} | NAMED)
    (record,) = rig.records
    assert damping_of(record) == pytest.approx((FRICTION, DAMPING), rel=5e-3)
    # On the clock of the file, which begins with its earliest channel.
    assert record.time[0] == pytest.approx(max(begins + offset, 0.0) - min(begins, 0.0), abs=1.0 / min(rates))
    clocks = [row for row in rig.ingested if row.step == "clock"]
    assert len(clocks) == 1
    assert f"{abs(begins + offset):.6g} s" in clocks[0].was
    assert clocks[0].quantity in ("displacement", "force")


def test_a_force_with_flanks_is_never_interpolated(tmp_path: Path) -> None:
    two_clocks(tmp_path / "a.tdms", (1000.0, 500.0), 0.0)
    (record,) = run(tmp_path, {"path": "a.tdms"} | NAMED).records
    assert record.rate == pytest.approx(500.0)
    assert set(np.sign(record.force)) <= set(np.sign(force_at(np.arange(2000) / 500.0)))
    assert np.abs(record.force).min() > 0.99 * FRICTION


def test_a_smooth_channel_follows_the_quicker_clock_to_a_millionth(tmp_path: Path) -> None:
    two_clocks(tmp_path / "a.tdms", (250.0, 2000.0), 0.0123)
    (record,) = run(tmp_path, {"path": "a.tdms"} | NAMED).records
    assert record.rate == pytest.approx(2000.0)
    assert record.time[0] == pytest.approx(0.0123)
    assert record.displacement == pytest.approx(motion(record.time)[0], abs=1e-6 * STROKE)


def test_interpolation_is_band_limited() -> None:
    """To 1 % of the amplitude at half the band; a straight line between samples misses 29 % there."""
    clock = np.arange(400) * 0.01
    between = np.arange(10.0, 390.0, 0.37) * 0.01
    for share, miss in ((0.2, 1e-4), (0.5, 0.01), (0.7, 0.1)):
        wave = np.sin(np.pi * share * clock / 0.01 + 0.3)
        found = resampled(clock, wave, between, held=False)
        assert np.abs(found - np.sin(np.pi * share * between / 0.01 + 0.3)).max() < miss


def mdf(path: Path, groups: list[list[tuple[str, Array, Array, str]]]) -> None:
    from asammdf import MDF, Signal

    with MDF(version="4.10") as file:
        for group in groups:
            file.append([Signal(values, time, unit=unit, name=name) for name, time, values, unit in group])
        file.save(path)


def late_groups(path: Path, begins: float = 2.0) -> None:
    """Displacement from the start at 1 kHz, force from 2 s at 500 Hz, a command of 10 Hz in steps of 2 s."""
    quick = np.arange(12_000) * 1e-3
    late = begins + np.arange(round((12.0 - begins) * 500)) / 500.0
    slow = np.arange(120) * 0.1
    command = 2.0 * (np.floor(slow / 2.0) % 3.0)
    friction = 60.0 + 80.0 * 2.0 * (np.floor(late / 2.0) % 3.0)
    mdf(
        path,
        [
            [("Stroke", quick, 1e3 * motion(quick)[0], "mm")],
            [("Load", late, force_at(late, friction), "N")],
            [("CoilCmd", slow, command.astype(np.int16), "V")],
        ],
    )


COMMANDED = {"columns": NAMED["columns"] | {"voltage": "CoilCmd"}}


def test_a_command_is_held_and_nothing_stands_before_the_last_channel_begins(tmp_path: Path) -> None:
    late_groups(tmp_path / "a.mf4")
    rig = run(tmp_path, {"path": "a.mf4"} | COMMANDED)
    (record,) = rig.records
    assert record.voltage is not None
    assert set(record.voltage) == {0.0, 2.0, 4.0}
    assert record.time[0] == pytest.approx(2.0)
    assert record.voltage == pytest.approx(2.0 * (np.floor(record.time / 2.0 + 1e-9) % 3.0))
    levels = 60.0 + 80.0 * record.voltage
    assert record.force == pytest.approx(force_at(record.time, levels), abs=1e-6)
    told = [f"{row.step} {row.quantity}: {row.was} -> {row.became}" for row in rig.ingested]
    assert any("2000 rows of 'Stroke' before 2 s, where 'Load' begins" in one for one in told)
    assert any("clock voltage: column 'CoilCmd'" in one and "held from sample to sample" in one for one in told)
    assert any("clock displacement: column 'Stroke'" in one and "2 s earlier than 'Load'" in one for one in told)


def test_init_sees_the_channels_of_all_clocks_and_check_says_what_was_done(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    late_groups(tmp_path / "a.mf4")
    text = "\n".join(guessed([Path("a.mf4")]))
    for line in ("displacement: Stroke", "force: Load", "voltage: CoilCmd"):
        assert line in text
    Path("own.yaml").write_text(text, encoding="utf-8")
    assert status(["check", "own.yaml", "-v"]) == 0
    assert "2 s earlier than 'Load'" in capsys.readouterr().out


def test_a_pause_of_a_channel_is_a_gap_and_not_interpolated(tmp_path: Path) -> None:
    quick, slow = np.arange(6000) * 1e-3, np.arange(3000) * 2e-3
    slow = slow[(slow < 2.0) | (slow > 2.5)]
    groups = [
        [("Load", quick, force_at(quick), "N")],
        [("Stroke", slow, 1e3 * motion(slow)[0], "mm")],
    ]
    mdf(tmp_path / "a.mf4", groups)
    rig = run(tmp_path, {"path": "a.mf4"} | NAMED)
    (record,) = rig.records
    assert record.displacement == pytest.approx(motion(record.time)[0], abs=1e-6)
    assert np.diff(record.time).max() > 0.5
    assert "dropped samples" in {finding.check for finding in rig.entries[0].findings}


def test_channels_without_a_common_time_are_refused(tmp_path: Path) -> None:
    one, two = np.arange(2000) * 1e-3, 5.0 + np.arange(2000) * 1e-3
    mdf(tmp_path / "a.mf4", [[("Stroke", one, motion(one)[0], "m")], [("Load", two, force_at(two), "N")]])
    (said,) = refused(tmp_path, {"path": "a.mf4"} | NAMED)
    assert "'Load' begins at 5 s, when 'Stroke' has ended (1.999 s): they have no time in common" in said
    assert "table: NAME" not in said  # no table holds both


def test_two_recordings_in_two_groups_stay_two_tests(tmp_path: Path) -> None:
    own = np.arange(2000) / 500.0
    groups = {
        name: {
            "Stroke": (1e3 * motion(own)[0], waveform(500.0, begins, unit="mm")),
            "Load": (force_at(own), waveform(500.0, begins, unit="N")),
        }
        for name, begins in (("Run 1", 0.0), ("Run 2", 60.0))
    }
    tdms(tmp_path / "a.tdms", groups)
    assert [record.time.size for record in run(tmp_path, {"path": "a.tdms"} | NAMED).records] == [2000, 2000]


def test_each_recording_is_completed_by_the_channel_that_runs_beside_all(tmp_path: Path) -> None:
    own, long = np.arange(2000) / 500.0, np.arange(80) * 1.0
    groups: dict[str, dict[str, tuple[Array, dict[str, Any]]]] = {
        name: {
            "Stroke": (1e3 * motion(own)[0], waveform(500.0, begins, unit="mm")),
            "Load": (force_at(own), waveform(500.0, begins, unit="N")),
        }
        for name, begins in (("Run 1", 5.0), ("Run 2", 60.0))
    }
    groups["Cabinet"] = {"Oil": (20.0 + 0.1 * long, waveform(1.0, unit="degC"))}
    tdms(tmp_path / "a.tdms", groups)
    first, second = run(tmp_path, {"path": "a.tdms", "columns": NAMED["columns"] | {"temperature": "Oil"}}).entries
    assert first.temperature_degC == pytest.approx(20.7, abs=0.2)
    assert second.temperature_degC == pytest.approx(26.2, abs=0.2)


def test_whether_a_channel_follows_does_not_depend_on_its_unit(rng: np.random.Generator) -> None:
    """A channel of 1e200 overflowed, with a warning of numpy in the terminal."""
    smooth, rough = np.sin(np.linspace(0.0, 9.0, 400)), rng.standard_normal(400)
    for scale in (1e-200, 1.0, 1e200):
        assert _follows(scale * smooth)
        assert not _follows(scale * rough)
