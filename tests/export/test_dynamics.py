"""The damper with its dynamics, in C and as FMUs, beside our own on sines, a road and a switching control signal."""

from __future__ import annotations

import json
import math
import shutil
import subprocess
import zipfile
from collections.abc import Mapping
from io import BytesIO
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from exported_dampers import DAMPERS, EXPORTED, base, content_of
from scipy.ndimage import gaussian_filter1d

from pzd.damper.compose import TOLERANCE
from pzd.damper.model import Damper
from pzd.damper.motion import Motion
from pzd.export.certificate import ALIKE, NAME, by_library, by_program, difference
from pzd.export.content import Content
from pzd.export.dynamics import Dynamics, data_of
from pzd.export.formats import formats
from pzd.record import Record
from pzd.schema.errors import FilesError
from pzd.signals.iso8608 import classes, profile

GCC = shutil.which("gcc")
needs_gcc = pytest.mark.skipif(GCC is None, reason="gcc is not installed: apt-get install gcc")
RATE = 2000.0
QUICK = ("plain", "rounded", "lag", "thinning", "hysteresis", "pocket", "frame")
"""Those for the gate: the element, and the effects that have no closed form."""
AT_LIMITS = ("elasto-plastic", "rigid", "stiff")
"""Under a constant control signal our own closed form is exact there, while the march, and C with it, is just off the
limit, and a sample on the very reversal may show either side of the jump; test_fmu.py has them on inputs that vary."""
SINGLE = 3e-4
"""Largest difference of single precision, as a share of the peak: a hundred pieces at their tolerance, as many as lie
within the time in which the oil forgets, where the control signal moves in every step."""
ALL = [
    name if name in QUICK else pytest.param(name, marks=pytest.mark.ci) for name in EXPORTED if name not in AT_LIMITS
]


def motions(rng: np.random.Generator) -> Mapping[str, Motion]:
    """Two sines, a road under a wheel, and a sine whose control signal switches, on one clock."""
    time = np.arange(round(2.0 * RATE)) / RATE
    warm = 20.0 + 10.0 * time
    found = {}
    for frequency, amplitude in ((1.0, 0.02), (11.0, 0.004)):
        w = 2.0 * math.pi * frequency
        x, v = amplitude * np.sin(w * time), amplitude * w * np.cos(w * time)
        found[f"{frequency:g} Hz"] = Motion(time, x, v, -w * w * x, np.full(time.size, 70.0), warm)
    speed = 15.0
    x, slope, bend = profile(classes()["C"], 100.0, rng)(speed * time)
    found["road"] = Motion(time, x - x[0], speed * slope, speed**2 * bend, 75.0 + 75.0 * np.sin(9.0 * time), warm)
    sine = found["1 Hz"]
    levels = rng.choice([0.0, 60.0, 150.0], 40).repeat(time.size // 40)
    found["switching"] = Motion(time, sine.displacement, sine.velocity, sine.acceleration, levels, warm)
    return found


def shares(content: Content, run, inputs_held: bool, rng: np.random.Generator) -> dict[str, float]:
    """Largest difference on each motion as a share of the peak."""
    found = motions(rng)
    if not content.controlled:
        for name, motion in found.items():
            found = {**found, name: Motion(motion.time, motion.displacement, motion.velocity, motion.acceleration)}
    return {name: difference(content, name, motion, run, inputs_held).share for name, motion in found.items()}


@needs_gcc
@pytest.mark.parametrize("name", ALL)
def test_c_has_our_force_to_a_millionth_of_the_peak(name: str, rng: np.random.Generator) -> None:
    content = content_of(EXPORTED[name])
    found = shares(content, by_program(formats()["c-dynamics"].files(content)), False, rng)
    assert max(found.values()) <= ALIKE, found


@needs_gcc
@pytest.mark.parametrize("name", ALL)
def test_c_of_single_precision_has_it_to_a_few_ten_thousandths(name: str, rng: np.random.Generator) -> None:
    content = content_of(EXPORTED[name])
    run = by_program(formats()["c-dynamics"].files(content), "-DDAMPER_SINGLE")
    found = shares(content, run, False, rng)
    assert max(found.values()) <= SINGLE, found


@needs_gcc
@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("name", ALL)
def test_the_library_of_an_fmu_has_our_force(name: str, version: int, rng: np.random.Generator) -> None:
    content = content_of(EXPORTED[name])
    with zipfile.ZipFile(BytesIO(formats()["fmu"].files(content)[f"my-run-fmi{version}.fmu"])) as archive:
        (member,) = [one for one in archive.namelist() if one.startswith("binaries/")]
        library = archive.read(member)
    token = data_of(content, Dynamics.of(content.damper))[1]
    found = shares(content, by_library(library, version, token), version == 3, rng)
    assert max(found.values()) <= ALIKE, found


MEASURED = {
    "utfsm-mr": (
        base((0.0, None, 87.33, 678.6, 4.0e19), (0.5, None, 440.9, 3350.0, 1.24e7), (1.0, None, 678.7, 3881.0, 1.42e7)),
        {
            "preload_offset": {"F_0": 46.6},
            "rounded_yield": {"w_s": 0.00566},
            "second_branch": {
                "T0_2": (48.3, 159.5, 470.1),
                "k_2": (4.81e5, 6.78e5, 1.52e6),
                "at_voltage_V": (0.0, 0.5, 1.0),
            },
            "gas_spring": {"k_g": 729.0},
        },
    ),
    "utfpr-mr": (
        base(
            (0.0, None, 54.7, 721.0, 1.33e6),
            (0.8712, None, 195.4, 1504.0, 1.89e6),
            (1.98, None, 356.1, 1948.0, 1.91e6),
            (3.212, None, 620.5, 4339.0, 1.98e6),
        ),
        {
            "rounded_yield": {
                "w_s": (0.00178, 0.00117, 0.0071, 0.00807),
                "at_voltage_V": (0.0, 0.8712, 1.98, 3.212),
            },
            "bouc_wen": {
                "F_h": (21.6, 51.8, 59.9, 68.9),
                "x_h": (0.0215, 0.0478, 0.000614, 0.146),
                "sigma": (50.0, 50.0, 50.0, 43.1),
                "at_voltage_V": (0.0, 0.8712, 1.98, 3.212),
            },
        },
    ),
}
"""The two measured dampers as `pzd diagnose` adopted them, to three or four digits: what is exported."""


@needs_gcc
@pytest.mark.parametrize("name", MEASURED)
def test_a_measured_damper_is_exported_and_has_our_force_on_its_own_records(name: str, shared: Path) -> None:
    rows, effects = MEASURED[name]
    content = content_of(Damper(base=rows, effects=effects))
    with zipfile.ZipFile(BytesIO(formats()["fmu"].files(content)["my-run-fmi2.fmu"])) as archive:
        (member,) = [one for one in archive.namelist() if one.startswith("binaries/")]
        library = archive.read(member)
    token = data_of(content, Dynamics.of(content.damper))[1]
    runs = by_library(library, 2, token), by_program(formats()["c-dynamics"].files(content))
    files = sorted((shared / "data" / name / "converted").glob("*.csv"))[:3]
    assert files
    for file in files:
        table = pd.read_csv(file, comment="#")
        (column,) = [head for head in table.columns if head.startswith("displacement")]
        time = table["time_s"].to_numpy(float)
        x = gaussian_filter1d(table[column].to_numpy(float) * (1e-3 if column.endswith("mm") else 1.0), 5.0)
        v = np.gradient(x, time)
        top = rows[-1].voltage_V or 0.0
        signals = [table[head].to_numpy(float) for head in table.columns if head.startswith(("current", "voltage"))]
        motion = Motion(time, x, v, np.gradient(v, time), signals[0] if signals else np.full(x.size, top))
        for run in runs:
            assert difference(content, file.stem, motion, run, False).share <= ALIKE


def record_of(motion: Motion, name: str) -> Record:
    """A record of a motion, whose force is not asked."""
    force = np.zeros(motion.time.size)
    return Record(
        name, None, motion.time, motion.displacement, motion.velocity, motion.acceleration, force, motion.voltage
    )


@needs_gcc
@pytest.mark.parametrize("to", ["c-dynamics", "fmu"])
def test_a_certificate_says_how_far_apart_the_forces_are_and_where(to: str, rng: np.random.Generator) -> None:
    content = content_of(EXPORTED["plain"])
    records = [record_of(motion, name) for name, motion in motions(rng).items()]
    certified = formats()[to].certified
    assert certified is not None
    written = certified(content, records, {"pzd": "0.1.0"})
    assert set(written) >= set(formats()[to].files(content))
    if to == "fmu":
        texts = []
        for data in written.values():
            with zipfile.ZipFile(BytesIO(data)) as archive:
                texts.append(archive.read(f"documentation/{NAME}"))
    else:
        texts = [written[NAME], written[f"single-{NAME}"]]
    for text in texts:
        found = json.loads(text)
        assert [one["record"] for one in found["records"]] == [record.name for record in records]
        worst = max(found["records"], key=lambda one: one["share_of_peak"])
        assert found["largest_difference"] == worst
        assert found["same"] is (worst["share_of_peak"] <= ALIKE)
        assert found["versions"]["pzd"] == "0.1.0"
        assert found["tolerance_of_a_piece"] == TOLERANCE
    assert json.loads(texts[0])["same"]


@needs_gcc
def test_a_certificate_shows_a_library_of_another_damper(rng: np.random.Generator) -> None:
    content, other = content_of(EXPORTED["plain"]), content_of(EXPORTED["passive"])
    run = by_program(formats()["c-dynamics"].files(other))
    found = difference(content, "1 Hz", motions(rng)["1 Hz"], run, False)
    assert found.share > 0.01


@needs_gcc
def test_the_sources_compile_without_a_warning_in_either_precision(tmp_path: Path) -> None:
    for name, data in formats()["c-dynamics"].files(content_of(EXPORTED["all"])).items():
        (tmp_path / name).write_bytes(data)
    strict = (
        "-std=c99",
        "-O1",
        "-Wall",
        "-Wextra",
        "-Werror",
        "-pedantic",
        "-Wno-unused-parameter",
        "-Wdouble-promotion",
    )
    for flags in ((), ("-DDAMPER_SINGLE",)):
        command = [str(GCC), *strict, *flags, "-c", "element.c", "laws.c"]
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
        assert (done.returncode, done.stderr) == (0, "")


def test_without_a_compiler_there_is_nothing_to_certify(
    monkeypatch: pytest.MonkeyPatch, rng: np.random.Generator
) -> None:
    monkeypatch.setattr("pzd.export.fmi.shutil.which", lambda _: None)
    for to in ("c-dynamics", "fmu"):
        certified = formats()[to].certified
        assert certified is not None
        with pytest.raises(FilesError, match=r"no C compiler|holds no library of this machine"):
            certified(content_of(DAMPERS["plain"]), [record_of(motions(rng)["1 Hz"], "a")], {})
