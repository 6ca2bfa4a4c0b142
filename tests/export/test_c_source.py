"""The C for a control unit, compiled with every warning and sanitizer, does what our own table and comfort law do."""

from __future__ import annotations

import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from exported_dampers import DAMPERS, content_of, largest

from pzd.export.content import Content
from pzd.export.formats import formats
from pzd.force_table.lookup import Lookup
from pzd.schema.errors import ConfigError
from pzd.simulate.control.demand import TIE_BREAKS, farther_end, least_acceleration_forces

GCC = shutil.which("gcc")
STRICT = ("-std=c99", "-O1", "-Wall", "-Wextra", "-Werror", "-pedantic", "-Wconversion", "-Wdouble-promotion")
SANE = ("-fsanitize=address,undefined", "-fno-sanitize-recover=all")
MAIN = r"""
#include <stdio.h>
#include "damper.h"
int main(void)
{
    float T, U, F, v, x[2], rate[2], low, high, force[2], signal[2];
    while (scanf("%f %f %f %f %f %f %f %f", &T, &U, &F, &v, &x[0], &x[1], &rate[0], &rate[1]) == 8) {
        damper_range(T, v, &low, &high);
        damper_comfort(T, x, rate, force, signal);
        printf("%.9g %.9g ", (double)damper_force(T, U, v), (double)damper_signal(T, F, v));
        printf("%.9g %.9g ", (double)low, (double)high);
        printf("%.9g %.9g %.9g %.9g\n", (double)force[0], (double)force[1], (double)signal[0], (double)signal[1]);
    }
    return 0;
}
"""
needs_gcc = pytest.mark.skipif(GCC is None, reason="gcc is not installed: apt-get install gcc")


def built(content: Content, folder: Path, *flags: str) -> Path:
    """A program that reads points and prints what the source makes of them."""
    for name, data in formats()["c"].files(content).items():
        (folder / name).write_bytes(data)
    (folder / "main.c").write_text(MAIN)
    command = [str(GCC), *STRICT, *flags, "main.c", "damper.c", "-o", "program", "-lm"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    return folder / "program"


def at_temperature(content: Content, temperature: float) -> Lookup:
    """Our own table at a temperature."""
    return Lookup.of(content.table, temperature if len(content.temperatures) > 1 else content.temperatures[0])


def comfort(content: Content, lookup: Lookup, x: np.ndarray, rate: np.ndarray) -> np.ndarray:
    """Our own forces of both axles for the smallest acceleration at K."""
    car = content.car
    D = tuple(float(d) for d in car.force_to_comfort())
    ratio, n = np.array(car.motion_ratios), np.array(car.dampers)
    low, high = lookup.range(ratio * rate)
    low, high = n * ratio * low, n * ratio * high
    a0 = float(np.sum(np.array(D) * np.array(car.stiffnesses) * x))
    forces, tie = np.zeros(2), TIE_BREAKS[content.tie_break]
    least_acceleration_forces(a0, D, low, high, tie, farther_end(a0, D, low, high), forces)
    return forces


@needs_gcc
@pytest.mark.parametrize(
    ("name", "outside", "tie_break"),
    [
        (name, outside, tie_break) if index == nth else pytest.param(name, outside, tie_break, marks=pytest.mark.ci)
        for index, (name, outside) in enumerate([("plain", "clamp"), ("orifice", "model"), ("warm", "model")])
        for nth, tie_break in enumerate(["smallest", "equal_share", "largest"])
    ],
)
def test_force_range_signal_and_comfort_law_are_ours(
    name: str, outside: str, tie_break: str, tmp_path: Path, rng: np.random.Generator
) -> None:
    plain = content_of(DAMPERS[name], outside=outside, speed_max_m_per_s=0.6)
    car = replace(plain.car, motion_ratios=(0.9, 1.1), dampers=(2.0, 1.0))
    content = replace(plain, car=car, tie_break=tie_break)
    grid, size = content.grid, 2000
    top = largest(content)
    axle = top * max(n * r for n, r in zip(car.dampers, car.motion_ratios, strict=True))
    T = np.repeat(rng.uniform(15.0, 65.0, 20), size // 20)
    U = rng.uniform(grid.voltages[0] - 10.0, grid.voltages[-1] + 10.0, size)
    v = rng.choice([-1.0, 1.0], size) * 0.7 * 10.0 ** rng.uniform(-6.0, 0.0, size)
    v[::100] = rng.choice([0.0, -0.0], v[::100].size)
    F = rng.uniform(-1.2, 1.2, size) * top
    x, rate = rng.normal(0.0, 0.03, (size, 2)), rng.normal(0.0, 0.2, (size, 2))
    given = np.column_stack([T, U, F, v, x, rate]).astype(np.float32).astype(np.float64)
    program = built(content, tmp_path, *SANE)
    text = "\n".join(" ".join(f"{value!r}" for value in row) for row in given.tolist())
    done = subprocess.run([program], input=text, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    found = np.array(done.stdout.split(), dtype=np.float64).reshape(size, 8)
    T, U, F, v, x, rate = (*given[:, :4].T, given[:, 4:6], given[:, 6:])
    for warm in np.unique(T):
        here = warm == T
        lookup = at_temperature(content, warm)
        force, signal, low, high = found[here, :4].T
        assert np.max(np.abs(force - lookup.force(U[here], v[here]))) <= 1e-6 * top
        ours = np.stack(lookup.range(v[here]))
        assert np.max(np.abs(np.stack([low, high]) - ours)) <= 1e-6 * top
        wanted = np.clip(F[here], *ours)
        assert np.max(np.abs(lookup.force(signal, v[here]) - wanted)) <= 1e-6 * top
        for k in np.flatnonzero(here):
            forces = comfort(content, lookup, x[k], rate[k])
            assert np.max(np.abs(found[k, 4:6] - forces)) <= 1e-6 * axle
            shared = lookup.force(found[k, 6:], np.array(car.motion_ratios) * rate[k])
            gives = np.array(car.dampers) * np.array(car.motion_ratios) * shared
            assert np.max(np.abs(gives - forces)) <= 1e-6 * axle


@needs_gcc
def test_the_lowest_of_several_signals_is_taken_as_ours_is(tmp_path: Path) -> None:
    damper = DAMPERS["plain"].model_copy(
        update={"base": (*DAMPERS["plain"].base[:2], DAMPERS["plain"].base[0].model_copy(update={"voltage_V": 150.0}))}
    )
    content = content_of(damper)
    lookup = content.lookups[0]
    v, F = np.float64(np.float32(0.3)), 0.5 * sum(float(lookup.force(u, 0.3)) for u in (0.0, 50.0))
    done = subprocess.run(
        [built(content, tmp_path)], input=f"20 0 {F} {v} 0 0 0.1 0.1", capture_output=True, text=True, check=True
    )
    assert float(done.stdout.split()[1]) == pytest.approx(float(lookup.voltage_for(F, v)), rel=1e-4)


@needs_gcc
def test_the_source_calls_nothing_but_arithmetic(tmp_path: Path) -> None:
    built(content_of(DAMPERS["warm"]), tmp_path)
    subprocess.run([str(GCC), *STRICT, "-c", "damper.c"], cwd=tmp_path, check=True)
    if shutil.which("nm") is None:
        pytest.skip("nm is not installed: apt-get install binutils")
    symbols = subprocess.run(["nm", "-u", "damper.o"], cwd=tmp_path, capture_output=True, text=True, check=True).stdout
    assert set(re.findall(r"U (\w+)", symbols)) <= {
        "fminf",
        "fmaxf",
        "fabsf",
        "hypotf",
        "_GLOBAL_OFFSET_TABLE_",
        "__stack_chk_fail",
    }


def test_the_source_names_version_and_config_and_is_the_same_twice() -> None:
    content = content_of(DAMPERS["warm"])
    written = formats()["c"].files(content)
    assert written == formats()["c"].files(replace(content))
    assert all(content.origin.encode() in data for data in written.values())


def test_what_a_control_unit_cannot_hold_is_refused() -> None:
    for name in ("passive", "single"):
        with pytest.raises(ConfigError, match="the table has no second control signal"):
            formats()["c"].files(content_of(DAMPERS[name]))
    with pytest.raises(ConfigError, match="cannot hold the empty cells"):
        formats()["c"].files(content_of(DAMPERS["plain"], outside="error"))
