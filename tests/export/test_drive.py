"""The history that drives a stand, read back by others: its clock, loops and ramps, and the limits of the stand."""

from __future__ import annotations

import io
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from exported_dampers import DAMPERS, content_of
from scipy.io import loadmat

from pzd.artefacts import NextTest
from pzd.export.drive import Drive, Plan, drive, plan_of
from pzd.export.formats import formats
from pzd.record import Record
from pzd.rig.config import FilesEntry, Limits
from pzd.rig.files.formats import rpc3
from pzd.schema.errors import ConfigError

AMPLITUDE, FREQUENCY, MIDDLE = 0.012, 1.7, 0.003


def recorded() -> Record:
    """A record that reaches 20 mm and 0.3 m/s."""
    time = np.arange(2000) / 500.0
    w = 0.3 / 0.02
    x, v = 0.02 * np.sin(w * time) + MIDDLE, 0.3 * np.cos(w * time)
    return Record("a", None, time, x, v, np.gradient(v, time), v, np.where(time < 2.0, 20.0, 120.0))


def next_test(**changed: Any) -> NextTest:
    """What diagnose asks for."""
    found = {"waveform": "sine", "frequency_Hz": FREQUENCY, "amplitude_m": AMPLITUDE, "voltage_V": 80.0}
    return NextTest(**{**found, "separates": (), "middle_m": MIDDLE, **changed})


def planned(found: NextTest | None = None, asked: str | None = None, **limits: Any) -> Plan:
    """A plan on the stand of that record."""
    return plan_of(found, asked, [recorded()], Limits(**limits), DAMPERS["plain"])


def exported(made: Drive) -> dict[str, bytes]:
    """The files of a history."""
    return dict(formats()["drive"].files(replace(content_of(DAMPERS["plain"]), drive=made)))


def test_loops_repeat_to_rounding_between_ramps_from_and_to_rest() -> None:
    made = drive(planned(next_test()), loops=7)
    x, start = made.displacement - MIDDLE, made.ramp_samples
    loops = x[start : start + 7 * made.loop_samples].reshape(7, -1)
    np.testing.assert_allclose(loops, np.broadcast_to(loops[0], loops.shape), atol=1e-15)
    np.testing.assert_allclose(
        loops[0], AMPLITUDE * np.sin(2.0 * math.pi * np.arange(made.loop_samples) / made.loop_samples), atol=1e-15
    )
    assert made.loop_samples * made.step == pytest.approx(1.0 / FREQUENCY, rel=1e-14)
    speed, top = np.diff(x) / made.step, 2.0 * math.pi * FREQUENCY * AMPLITUDE
    assert np.max(np.abs(speed)) <= top * (1.0 + 1e-9)
    assert x[0] == x[-1] == pytest.approx(0.0, abs=1e-15)
    assert abs(speed[0]) + abs(speed[-1]) <= 1e-6 * top
    assert np.max(np.abs(np.diff(speed))) / made.step <= 1.5 * 2.0 * math.pi * FREQUENCY * top


def test_a_stepped_signal_changes_as_the_next_test_asks() -> None:
    made = drive(planned(next_test(waveform="sine, voltage stepped", voltage_V=(20.0, 120.0))))
    assert made.signal is not None
    one = made.signal[made.ramp_samples : made.ramp_samples + made.loop_samples]
    assert sorted(set(one)) == [20.0, 120.0]
    assert np.count_nonzero(np.diff(one)) == 3


@pytest.mark.parametrize(
    "asked", [None, "{kind: triangle, frequency_Hz: 1, amplitude_m: 0.01}", "{kind: random, rms_m: 0.004}"]
)
def test_every_form_is_read_back_by_another_reader(asked: str | None, tmp_path: Path) -> None:
    made = drive(planned(next_test(), asked, stroke_m=0.5, speed_m_per_s=5.0))
    files = exported(made)
    (csv,), (drv,), (mat,) = ([n for n in files if n.endswith(end)] for end in (".csv", ".drv", ".mat"))
    table = pd.read_csv(io.BytesIO(files[csv]), comment="#")
    np.testing.assert_array_equal(table["displacement_m"], made.displacement)
    np.testing.assert_array_equal(table["time_s"], made.time)
    read = loadmat(io.BytesIO(files[mat]), squeeze_me=True)
    np.testing.assert_array_equal(read["displacement_m"], made.displacement)
    said = {name: read["drive"][name].item() for name in ("loops", "loop_samples", "ramp_samples", "step_s")}
    assert said == {
        "loops": made.loops,
        "loop_samples": made.loop_samples,
        "ramp_samples": made.ramp_samples,
        "step_s": made.step,
    }
    assert str(read["units"]["displacement_m"]) == "m"
    (tmp_path / drv).write_bytes(files[drv])
    (sheet,) = rpc3.tables(tmp_path / drv, FilesEntry(path=drv))
    columns = dict(zip(sheet.header, sheet.cells, strict=True))
    count = made.displacement.size
    step = np.max(np.abs(made.displacement)) / 32000.0
    np.testing.assert_allclose(columns["displacement_m"][:count], made.displacement, atol=0.51 * step)
    np.testing.assert_allclose(columns["time"][:count], made.time, atol=1e-12)
    np.testing.assert_allclose(columns["voltage_V"][:count], made.signal, rtol=2e-5)


def test_rpc_iii_is_read_by_a_reader_of_other_people(tmp_path: Path) -> None:
    reader = pytest.importorskip("rpc_reader.rpc_reader", reason="rpc-reader is not installed: pip install rpc-reader")
    made = drive(planned(next_test()))
    (name,) = [name for name in exported(made) if name.endswith(".drv")]
    path = (tmp_path / name).with_suffix(".rsp")
    path.write_bytes(exported(made)[name])
    found = reader.ReadRPC(path)
    found.import_rpc_data_from_file()
    data, (time, _) = np.asarray(found.get_data()), found.get_time()
    step = np.max(np.abs(made.displacement)) / 32000.0
    np.testing.assert_allclose(data[: made.displacement.size, 0], made.displacement, atol=0.51 * step)
    np.testing.assert_allclose(np.diff(np.asarray(time, dtype=float)), made.step, rtol=1e-2)  # of single precision


@pytest.mark.parametrize(
    ("limits", "told"),
    [
        ({"stroke_m": 0.02}, "a stroke of 0.024 m, of 0.02 m (rig.limits.stroke_m)"),
        ({"speed_m_per_s": 0.1}, "a speed of 0.1282 m/s, of 0.1 m/s (rig.limits.speed_m_per_s)"),
        ({"frequency_Hz": 1.0}, "a frequency of 1.7 Hz, of 1 Hz (rig.limits.frequency_Hz)"),
        ({"force_N": 500.0}, "(rig.limits.force_N)"),
        ({"voltage_V": (0.0, 60.0)}, "a control signal of 80 to 80, of 0 to 60"),
    ],
)
def test_what_the_stand_cannot_do_is_refused_and_less_is_taken(limits: dict[str, Any], told: str) -> None:
    with pytest.raises(ConfigError) as refused:
        drive(planned(next_test(), **limits))
    assert any(told in message for message in refused.value.messages)
    drive(planned(next_test(amplitude_m=0.002, frequency_Hz=0.9, voltage_V=40.0), **{"stroke_m": 0.05, **limits}))


def test_without_a_next_test_a_waveform_is_asked_for_and_then_taken() -> None:
    with pytest.raises(ConfigError, match="asks for no next test; give one by --waveform"):
        planned()
    with pytest.raises(ConfigError, match="takes a block with kind: "):
        planned(asked="sine")
    with pytest.raises(ConfigError, match="--waveform: amplitude_m: Field required"):
        planned(asked="{kind: sine, frequency_Hz: 2}")
    assert drive(planned(asked="{kind: sine, frequency_Hz: 2, amplitude_m: 0.01}")).loops == 10


def test_a_motion_that_does_not_repeat_makes_no_loops(tmp_path: Path) -> None:
    pulled = pd.DataFrame({"time_s": np.arange(20) / 10.0, "displacement_m": 1e-3 * np.arange(20)})
    pulled.to_csv(tmp_path / "pull.csv", index=False)
    plan = replace(planned(asked="{kind: file, path: pull.csv}"), folder=tmp_path)
    with pytest.raises(ConfigError, match="takes a motion that repeats"):
        drive(plan)
