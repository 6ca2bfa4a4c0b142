"""The MAT-file, read by SciPy and interpolated by Octave, is our own table."""

from __future__ import annotations

import io
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from exported_dampers import DAMPERS, content_of, largest
from scipy.interpolate import RegularGridInterpolator
from scipy.io import loadmat

from pzd.export.content import Content
from pzd.export.formats import formats

OCTAVE = shutil.which("octave-cli") or shutil.which("octave")
IN_OCTAVE = """
load('{mat}'); given = dlmread('{points}');
if ndims(table) == 3
  found = interpn(bp1, bp2, bp3, table, given(:, 1), given(:, 2), given(:, 3));
elseif min(size(table)) == 1
  found = interp1(bp1, table, given(:, 2));
else
  found = interp2(bp2, bp1, table, given(:, 2), given(:, 1));
end
printf('%.17g\\n', found);
"""


def loaded(content: Content) -> dict[str, np.ndarray]:
    """The variables of the file as SciPy reads them."""
    found: dict[str, np.ndarray] = loadmat(io.BytesIO(formats()["mat"].files(content)["my-run.mat"]), squeeze_me=True)
    return found


def ours(content: Content, U: np.ndarray, v: np.ndarray, T: np.ndarray) -> np.ndarray:
    """Our own reading of the table, linear between its temperatures."""
    if len(content.lookups) == 1:
        return content.lookups[0].force(U, v)
    low, high = (float(t) for t in content.temperatures if t is not None)
    share = (T - low) / (high - low)
    return (1.0 - share) * content.lookups[0].force(U, v) + share * content.lookups[1].force(U, v)


def warmth(content: Content, rng: np.random.Generator, size: int) -> np.ndarray:
    """Temperatures within the table."""
    known = [t for t in content.temperatures if t is not None] or [0.0]
    return rng.uniform(known[0], known[-1], size)


def test_octave_interpolates_the_table_as_we_do(
    content: Content, points: tuple[np.ndarray, np.ndarray], tmp_path: Path, rng: np.random.Generator
) -> None:
    if OCTAVE is None:
        pytest.skip("Octave is not installed: apt-get install octave")
    U, v = points
    T = warmth(content, rng, U.size)
    (tmp_path / "my-run.mat").write_bytes(formats()["mat"].files(content)["my-run.mat"])
    np.savetxt(tmp_path / "points.txt", np.column_stack([U, v, T]), fmt="%.17g")
    script = IN_OCTAVE.format(mat=tmp_path / "my-run.mat", points=tmp_path / "points.txt")
    done = subprocess.run([OCTAVE, "--no-gui", "-qf", "--eval", script], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    found = np.array(done.stdout.split(), dtype=float)
    assert found.size == U.size >= 1000
    assert np.max(np.abs(found - ours(content, U, v, T))) <= 1e-9 * largest(content)


def test_scipy_interpolates_the_table_as_we_do(
    content: Content, points: tuple[np.ndarray, np.ndarray], rng: np.random.Generator
) -> None:
    found = loaded(content)
    U, v = points
    T = warmth(content, rng, U.size)
    axes = [found[name] for name in ("bp1", "bp2", "bp3") if name in found]
    wanted = {1: (v,), 2: (U, v), 3: (U, v, T)}[len(axes)]
    read = RegularGridInterpolator(axes, found["table"])(np.column_stack(wanted))
    assert np.max(np.abs(read - ours(content, U, v, T))) <= 1e-9 * largest(content)
    assert all(np.all(np.diff(axis) > 0.0) for axis in axes)


def test_a_control_signal_of_the_inverse_gives_the_force_that_was_asked_for() -> None:
    content = content_of(DAMPERS["orifice"])
    found, lookup = loaded(content), content.lookups[0]
    v, share = np.meshgrid(found["inverse_bp1"], found["inverse_bp2"], indexing="ij")
    low, high = found["inverse_low"][:, np.newaxis], found["inverse_high"][:, np.newaxis]
    missed = lookup.force(found["inverse"], v) - (low + share * (high - low))
    assert np.max(np.abs(missed)) <= 1e-9 * largest(content)
    assert found["inverse"].min() == 0.0
    assert found["inverse"].max() == 150.0


def test_beyond_the_last_speed_a_clamped_table_is_level_and_a_model_goes_on() -> None:
    for outside in ("clamp", "model"):
        content = content_of(DAMPERS["plain"], outside=outside, speed_max_m_per_s=0.2)
        found = loaded(content)
        slope = np.diff(found["table"][:, -2:], axis=1)[:, 0] / np.diff(found["bp2"][-2:])
        beyond = found["table"][:, -1] + slope * 0.3
        assert np.max(np.abs(beyond - content.lookups[0].force(found["bp1"], found["bp2"][-1] + 0.3))) < 1e-6


def test_the_effects_and_the_base_are_structures_of_the_file() -> None:
    found = loaded(content_of(DAMPERS["orifice"]))
    damper = found["damper"].item()
    names = found["damper"].dtype.names
    parts = dict(zip(names, damper, strict=True))
    assert float(parts["effects"].item()[0].item()[0]) == 2500.0
    assert parts["base"].dtype.names == ("voltage_V", "temperature_degC", "T0_N", "C_Ns_per_m", "k_N_per_m")


def test_an_empty_cell_is_no_number_in_table_and_inverse() -> None:
    found = loaded(content_of(DAMPERS["orifice"], outside="error"))
    beyond = np.abs(found["bp2"]) > 0.6 * (1.0 + 1e-9)
    assert beyond.any()
    assert np.isnan(found["table"][:, beyond]).all()
    assert np.isnan(found["inverse"][beyond]).all()
    assert np.isfinite(found["table"][:, ~beyond]).all()
    assert np.isfinite(found["inverse"][~beyond]).all()
